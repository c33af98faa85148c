// A container that compares what it does with what its bounds rest on.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/watching/bound_watch.hpp"

#include <atomic>
#include <functional>
#include <optional>
#include <thread>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "takt/base/available_cpus.hpp"
#include "takt/base/simulated_clock.hpp"
#include "takt/containers/component.hpp"
#include "takt/containers/configuration/configuration_file_test.hpp"
#include "takt/containers/container.hpp"
#include "takt/containers/process_usage.hpp"
#include "takt/nodes/lifecycle_node.hpp"
#include "takt/sched/threads/thread_attributes.hpp"
#include "takt/testing/eventually.hpp"

namespace takt::test {
namespace {

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::Not;
using Deviation = ProcessResult::Deviation;

struct Seen {
  int number = 0;
};
TAKT_MESSAGE(Seen, "test/msg/Seen", number);

/// The next execution of the timer takes 300 ms; set when it has begun.
std::atomic<bool> must_hang{false}, hangs{false};
/// The next execution gives its thread another policy; unset when it has.
std::atomic<bool> must_demote{false};
/// The next execution makes another timer, or changes its own parameters; unset when it has.
std::atomic<bool> must_make{false}, must_change{false};
/// Each execution sends to `u`, by a publisher that it makes.
std::atomic<bool> must_send{false};
/// Each execution gives its timer a release of its own, soon.
std::atomic<bool> must_hurry{false};
/// No execution sends.
std::atomic<bool> sends_nothing{false};
/// The next execution of the receiver drops its subscription; unset when it has.
std::atomic<bool> must_drop{false};
/// Of the sender that was made last, for a thread of the test.
std::weak_ptr<Publisher<Seen>> its_publisher;
/// The managed receiver that was made last.
std::atomic<LifecycleNode*> managed_receiver{nullptr};

/// Of the sender; it shows the real time until a test lets it simulate.
const auto watched_clock = std::make_shared<SimulatedClock>(Clock::steady(), false);

NodeOptions with_watched_clock(NodeOptions options) {
  options.clock = watched_clock.get();
  return options;
}

/// A timer that takes as long as its parameter says, and sends to `t`.
class WatchedSender : public Node {
 public:
  explicit WatchedSender(const NodeOptions& options) : Node("sender", with_watched_clock(options)) {
    const Nanoseconds work = std::chrono::microseconds(declare_parameter<std::int64_t>("work", 0));
    publisher_ = create_publisher<Seen>("t", 10, {.published_by = {"tick"}});
    its_publisher = publisher_;
    timer_ = create_timer("tick", 10ms, [this, work] {
      const TimePoint begin = Clock::steady().now();
      if (must_hang.exchange(false)) {
        hangs.store(true);
        while (Clock::steady().now() < begin + 300ms) std::this_thread::yield();
      }
      if (must_make.load()) {
        later_ = create_timer("later", 10ms, [] {});
        must_make.store(false);
      }
      if (must_change.load()) {
        set_callback_parameters({.callbacks = {{"tick", {.priority = 7}}}});
        must_change.store(false);
      }
      if (must_send.load()) create_publisher<Seen>("u", 10)->publish(Seen{});
      if (must_hurry.load()) timer_->release_at(timer_->due() - 9ms);
      if (must_demote.load()) {
        apply({.name = "one", .policy = ThreadPolicy::batch}, Realtime::prefer);
        must_demote.store(false);
      }
      const Nanoseconds before = thread_cpu_time();
      while (thread_cpu_time() - before < work) {
      }
      if (!sends_nothing.load()) publisher_->publish(Seen{});
    });
  }

 private:
  Publisher<Seen>::SharedPtr publisher_;
  Timer::SharedPtr timer_, later_;
};

class WatchedReceiver : public Node {
 public:
  explicit WatchedReceiver(const NodeOptions& options)
      : Node("receiver", options),
        subscription_(create_subscription<Seen>("t", 10,
                                                [this](const Seen&) {
                                                  if (!must_drop.load()) return;
                                                  subscription_.reset();
                                                  must_drop.store(false);
                                                })),
        other_(create_subscription<Seen>("u", 10, [](const Seen&) {})) {}

 private:
  std::shared_ptr<void> subscription_, other_;
};

class WatchedManaged : public LifecycleNode {
 public:
  explicit WatchedManaged(const NodeOptions& options)
      : LifecycleNode("managed", options),
        subscription_(create_subscription<Seen>("t", 10, [](const Seen&) {})) {
    managed_receiver.store(this);
  }

 private:
  std::shared_ptr<void> subscription_;
};

/// Is triggered twice, one after the other.
class WatchedTriggered : public Node {
 public:
  explicit WatchedTriggered(const NodeOptions& options)
      : Node("triggered", options), condition_(create_guard_condition("again", [this] {
          if (!std::exchange(is_second_, true)) condition_->trigger();
        })) {
    condition_->trigger();
  }

 private:
  bool is_second_ = false;
  GuardCondition::SharedPtr condition_;
};

std::string with_work(int work_us, const char* policy = "") {
  return fmt::format(R"(
realtime: prefer
machine: {{exclusive: true, rt_runtime: unlimited, overheads: {{dispatch: 1ms, wake: 1ms}}}}
analysis: {{watch: true}}
threads: {{one: {{affinity: [{}]{}}}}}
executors: {{default: {{type: events, threads: [one]}}}}
chains: [{{name: c, path: [s/tick, r/t]}}]
container:
  name: watched
  components:
    - component: takt::test::WatchedSender
      name: s
      executor: default
      parameters: {{work: {}}}
      callbacks: {{tick: {{execution: 1ms}}}}
    - component: takt::test::WatchedReceiver
      name: r
      executor: default
      callbacks: {{t: {{execution: 1ms}}}}
)",
                     available_cpus().front(), policy, work_us);
}

/// Runs it until the receiver has got something.
std::vector<Deviation> deviations_of(const std::string& text,
                                     const std::function<void(Container&)>& meanwhile = {}) {
  const ConfigurationFile file("watched.yaml", text);
  Container container(file.read());
  container.start();
  container.release();
  EXPECT_TRUE(eventually([&] {
    const auto rows = container.statistics().callbacks;
    return std::any_of(rows.begin(), rows.end(),
                       [](const auto& each) { return each.callback == "t" && each.received >= 2; });
  }));
  if (meanwhile) meanwhile(container);
  container.hold();
  container.stop();
  return container.result().deviations.value();
}

auto is(const std::string& id, const std::string& text) {
  return AllOf(Field(&Deviation::id, id), Field(&Deviation::text, HasSubstr(text)),
               Field(&Deviation::chains, ElementsAre("c")));
}

TEST(BoundWatch, SeesWhatIsLongerThanWasAssumed) {
  EXPECT_THAT(deviations_of(with_work(0)), Not(Contains(is("as_declared", "processor time"))));
  const auto found = deviations_of(with_work(30'000));  // each takes 2 ms, with its dispatch
  EXPECT_THAT(found, Contains(is("as_declared", "'/s/tick' took 30.")));
  EXPECT_THAT(found, Contains(is("bound", "'/s/tick' ended ")));
  EXPECT_THAT(found, Contains(is("bound", "chain 'c' took ")));
}

TEST(BoundWatch, SeesChanges) {
  const auto found = deviations_of(with_work(0), [](Container& container) {
    container.change_parameters("{s: {callbacks: {tick: {priority: 3}}}}");
    const GetStatistics::Response now = container.statistics();
    EXPECT_TRUE(now.watches_bounds);
    EXPECT_THAT(now.deviations,
                Contains(Field(&GetStatistics::Deviation::id, "nothing_is_changed")));
  });
  EXPECT_THAT(found, Contains(is("nothing_is_changed", "parameters")));
}

// The model was asked for a callback that is gone: the container crashed.
TEST(BoundWatch, OutlivesTheCallbacksOfAChain) {
  const auto found = deviations_of(with_work(0), [](Container& container) {
    container.unload(2);
    container.change_parameters("{s: {callbacks: {tick: {priority: 3}}}}");
  });
  EXPECT_THAT(found, Contains(is("nothing_is_changed", "unload")));
  EXPECT_THAT(found, Contains(is("nothing_is_changed", "parameters")));
}

// What has not ended when a run does was compared with nothing.
TEST(BoundWatch, SeesWhatWaitsAtTheEnd) {
  const auto found = deviations_of(with_work(0), [](Container&) {
    must_hang.store(true);
    EXPECT_TRUE(eventually([] { return hangs.load(); }));
    const TimePoint since = Clock::steady().now();
    EXPECT_TRUE(eventually([&] { return Clock::steady().now() > since + 150ms; }));
  });
  EXPECT_THAT(found, Contains(is("bound", "'/s/tick' waits for ")));
  EXPECT_THAT(found, Contains(is("bound", "'/s/tick' ended ")));  // after the timers were held
}

TEST(BoundWatch, SaysWhyNothingCanBeWatched) {
  std::string text = with_work(0);
  text.replace(text.find("exclusive: true, "), 17, "");
  const ConfigurationFile file("unbounded.yaml", text);
  EXPECT_THAT([&] { Container container(file.read()); },
              ::testing::ThrowsMessage<Error>(HasSubstr("no chain has a bound")));
}

// A component changed its own thread, and the watch said that nothing had deviated.
TEST(BoundWatch, SeesWhoChangesAThread) {
  const auto found = deviations_of(with_work(0), [](Container&) {
    must_demote.store(true);
    EXPECT_TRUE(eventually([] { return !must_demote.load(); }));
  });
  EXPECT_THAT(found,
              Contains(is("realtime_granted", "thread 'one' was SCHED_OTHER of priority 0")));
}

// That nothing is made later was assumed, and not looked at.
TEST(BoundWatch, SeesWhatIsMadeLater) {
  const auto found = deviations_of(with_work(0), [](Container&) {
    must_make.store(true);
    EXPECT_TRUE(eventually([] { return !must_make.load(); }));
  });
  EXPECT_THAT(found, Contains(is("as_declared", "'/s/later' was made later")));
  EXPECT_THAT(deviations_of(with_work(0), [](Container&) {}),
              Not(Contains(is("as_declared", "was made later"))));
}

// A component that changes itself asks no container.
TEST(BoundWatch, SeesWhatANodeChanges) {
  const auto found = deviations_of(with_work(0), [](Container&) {
    must_change.store(true);
    EXPECT_TRUE(eventually([] { return !must_change.load(); }));
  });
  EXPECT_THAT(found, Contains(is("nothing_is_changed", "the parameters of '/s/tick' are others")));
}

// A dropped callback was said to wait, which nobody did.
TEST(BoundWatch, SeesWhatANodeDrops) {
  const auto found = deviations_of(with_work(0), [](Container&) {
    must_drop.store(true);
    EXPECT_TRUE(eventually([] { return !must_drop.load(); }));
    const TimePoint since = Clock::steady().now();
    EXPECT_TRUE(eventually([&] { return Clock::steady().now() > since + 50ms; }));
  });
  EXPECT_THAT(found, Contains(is("nothing_is_changed", "'/r/t' was let go")));
  EXPECT_THAT(found, Not(Contains(is("bound", "'/r/t' waits"))));
}

// It showed as messages that waited; and as nothing where the node was soon active again.
TEST(BoundWatch, SeesNodesThatRest) {
  std::string text = with_work(0) + R"(    - component: takt::test::WatchedManaged
      name: m
      executor: default
      callbacks: {t: {execution: 1us}}
)";
  text.insert(text.find("threads: {one"), "lifecycle: {bring_up: [/m]}\n");
  const auto is_active = [] {
    return managed_receiver.load()->get_current_state() == LifecycleState::active;
  };
  const auto rests = Contains(is("nothing_is_changed", "'/m' was deactivated"));
  EXPECT_THAT(deviations_of(text, [&](Container&) { EXPECT_TRUE(eventually(is_active)); }),
              Not(rests));
  EXPECT_THAT(deviations_of(text,
                            [&](Container&) {
                              EXPECT_TRUE(eventually(is_active));
                              EXPECT_TRUE(managed_receiver.load()->deactivate());
                              EXPECT_TRUE(managed_receiver.load()->activate());
                            }),
              rests);
}

// A chain on which nothing came through had no deviation: nothing was above its bound.
TEST(BoundWatch, SeesThatNothingComesThrough) {
  const auto found = deviations_of(with_work(0), [](Container& container) {
    sends_nothing.store(true);
    const auto ticks = [&] { return container.statistics().callbacks.front().received; };
    const std::uint64_t before = ticks();
    EXPECT_TRUE(eventually([&] { return ticks() > before + 5; }));
  });
  sends_nothing.store(false);
  EXPECT_THAT(found, Contains(is("as_declared", "instances of chain 'c'")));
}

// Under simulated time its timers run at any speed.
TEST(BoundWatch, SeesSimulatedTime) {
  const auto found = deviations_of(with_work(0), [](Container&) { watched_clock->simulate(true); });
  watched_clock->simulate(false);
  EXPECT_THAT(found, Contains(is("nothing_is_changed", "'/s/tick' follows simulated time")));
}

// Something triggers more often than its arrival states.
TEST(BoundWatch, SeesTimersThatComeTooOften) {
  const auto comes_too_often = Contains(is("as_declared", "arrivals of '/s/tick' came within"));
  EXPECT_THAT(deviations_of(with_work(0)), Not(comes_too_often));
  must_hurry.store(true);
  const auto found = deviations_of(with_work(0), [](Container& container) {
    EXPECT_TRUE(eventually([&] {  // one of these is on time
      const auto rows = container.statistics().callbacks;
      return std::any_of(rows.begin(), rows.end(),
                         [](const auto& each) { return each.received >= 20; });
    }));
  });
  EXPECT_THAT(found, comes_too_often);
  must_hurry.store(false);
}

// A publisher that nobody knew of: what it sends took no time in the analysis.
TEST(BoundWatch, SeesWhatNothingWasToSend) {
  const auto runs = Contains(is("as_declared", "'/r/u' ran, and nothing was to come to it"));
  EXPECT_THAT(deviations_of(with_work(0)), Not(runs));
  must_send.store(true);
  EXPECT_THAT(deviations_of(with_work(0)), runs);
  must_send.store(false);
}

// No callback has sent them, so no sender's arrivals were too many.
TEST(BoundWatch, SeesWhatAThreadSends) {
  const auto are_too_many = Contains(is("as_declared", "messages were sent to '/r/t'"));
  EXPECT_THAT(deviations_of(with_work(0)), Not(are_too_many));
  EXPECT_THAT(deviations_of(with_work(0),
                            [](Container&) {
                              const auto publisher = its_publisher.lock();
                              for (int i = 0; i < 1000; ++i) publisher->publish(Seen{});
                            }),
              are_too_many);
}

TEST(BoundWatch, SeesTriggersThatComeTooOften) {
  const auto found = deviations_of(with_work(0) + R"(    - component: takt::test::WatchedTriggered
      name: g
      executor: default
      callbacks: {again: {execution: 1us, arrival: {period: 10s}}}
)");
  EXPECT_THAT(found, Contains(is("as_declared", "arrivals of '/g/again' came within")));
}

// What comes from outside beside senders of the file was in no comparison.
TEST(BoundWatch, CountsWhatComesFromOutsideBesideSenders) {
  std::string text = with_work(0);
  text.replace(text.find("t: {execution: 1ms}"), 19, "t: {execution: 1ms, arrival: {period: 10s}}");
  const ConfigurationFile file("outside.yaml", text);
  const SystemDescription description = file.read();
  const Container container(description);
  const ModelledProcess process = container.modelled();
  const SystemModel model = make_system_model(description, container.plan().chains, {&process, 1});
  BoundWatch watch(model, analyze(model), process);
  watch.begin({});
  CallbackStatistics seen;
  seen.node = "/r";
  seen.callback = "t";
  for (const std::uint64_t count : {0u, 1u, 3u}) {  // one may come in a moment, two may not
    seen.from_outside = count;
    EXPECT_THAT(watch.found(), Not(Contains(is("as_declared", "from outside"))));
    watch.look({}, {seen}, {}, false);
  }
  EXPECT_THAT(watch.found(), Contains(is("as_declared", "2 messages came to '/r/t' from outside")));
}

// By a thread of this process, as those of DDS are.
TEST(BoundWatch, SeesWhoPreempts) {
  std::atomic<bool> has_begun{false}, may_end{false};
  bool has_rights = true;
  std::thread rival([&] {
    const ThreadState state = apply({.name = "rival",
                                     .policy = ThreadPolicy::fifo,
                                     .priority = 20,
                                     .affinity = {available_cpus().front()}},
                                    Realtime::prefer);
    has_rights = state.refused.empty();
    has_begun.store(true);
    EXPECT_TRUE(!has_rights || eventually([&] { return may_end.load(); }));
  });
  EXPECT_TRUE(eventually([&] { return has_begun.load(); }));  // a busy machine begins it late
  std::vector<Deviation> found;
  const auto is_seen = Contains(AnyOf(is("nothing_else_runs", "of this process, named 'rival'"),
                                      is("nothing_else_runs", "something ran before 'one'")));
  EXPECT_NO_THROW(found = deviations_of(with_work(5'000, ", policy: SCHED_FIFO, priority: 10")));
  may_end.store(true);
  rival.join();
  if (!has_rights) GTEST_SKIP() << "no right to real-time priorities";
  EXPECT_THAT(found, is_seen);
}

// Where the watch began before a thread had its policy, nobody looked at its CPU.
/// nullopt: without the right to see or to have it.
std::optional<std::vector<Deviation>> seen_of_a_rival() {
  const ConfigurationFile file("late.yaml", with_work(0, ", policy: SCHED_FIFO, priority: 10"));
  const SystemDescription description = file.read();
  const Container container(description);
  const ModelledProcess process = container.modelled();
  const SystemModel model = make_system_model(description, container.plan().chains, {&process, 1});
  BoundWatch watch(model, analyze(model), process);
  watch.begin({});
  std::atomic<int> late{0};
  std::atomic<bool> has_rights{true}, may_end{false};
  const auto set = [&](const char* name, int priority) {
    const ThreadAttributes asked{.name = name,
                                 .policy = ThreadPolicy::fifo,
                                 .priority = priority,
                                 .affinity = {available_cpus().front()}};
    if (!apply(asked, Realtime::prefer).refused.empty()) has_rights.store(false);
  };
  std::thread one([&] {
    set("one", 10);
    late.store(gettid());
    const TimePoint end = Clock::steady().now() + 1min;
    while (Clock::steady().now() < end && !may_end.load()) {  // it runs all the time
    }
  });
  EXPECT_TRUE(eventually([&] { return late.load() != 0; }));
  watch.look({}, {}, {}, false);  // what ran until now has not filled the kernel's buffer
  std::atomic<int> rounds{0};     // it sleeps between two
  std::thread rival([&] {
    set("rival", 20);
    EXPECT_TRUE(eventually([&] {
      ++rounds;
      return may_end.load();
    }));
  });
  EXPECT_TRUE(eventually([&] { return !has_rights.load() || rounds.load() > 20; }));
  watch.look({late.load()}, {}, {}, false);
  may_end.store(true);
  one.join();
  rival.join();
  if (!has_rights.load() || !watch.note().empty()) return {};
  return watch.found();
}

// Beside a full machine Linux throttles the thread, and the kernel's buffer may be full before the
// rival has come.
TEST(BoundWatch, SeesWhoPreemptsAThreadThatBeginsLate) {
  const auto is_seen = Contains(is("nothing_else_runs", "of this process, named 'rival'"));
  std::vector<Deviation> last;
  for (int attempt = 0; attempt < 5; ++attempt) {
    const auto found = seen_of_a_rival();
    if (!found) GTEST_SKIP() << "no right to see or to have it";
    last = *found;
    if (::testing::Value(last, is_seen)) return;
  }
  EXPECT_THAT(last, is_seen);
}

}  // namespace
}  // namespace takt::test

TAKT_REGISTER_COMPONENT(takt::test::WatchedSender, "takes its time")
TAKT_REGISTER_COMPONENT(takt::test::WatchedReceiver, "receives")
TAKT_REGISTER_COMPONENT(takt::test::WatchedManaged, "receives while it is active")
TAKT_REGISTER_COMPONENT(takt::test::WatchedTriggered, "triggers itself")
