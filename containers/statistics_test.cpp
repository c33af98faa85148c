// What a running container reports: get_statistics, and /diagnostics.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "takt/containers/container.hpp"
#include "takt/containers/diagnostics.hpp"
#include "takt/containers/set_callback_parameters.hpp"
#include "takt/containers/statistics_interval.hpp"
#include "takt/testing/eventually.hpp"
#include "takt/testing/peer_process.hpp"
#include "takt/transport/local_topics.hpp"

namespace takt::statistics_test {
namespace {

using namespace std::chrono_literals;
using diagnostic_msgs::msg::DiagnosticArray;
using diagnostic_msgs::msg::DiagnosticStatus;
using testing::Contains;
using testing::Field;
using testing::Ge;

struct Beat {
  int number = 0;
};
TAKT_MESSAGE(Beat, "test/msg/StatisticsBeat", number);

std::atomic<int> heard{0};

/// A timer of a millisecond, and in another group what hears it.
class Heart : public Node {
 public:
  explicit Heart(const NodeOptions& options) : Node("heart", options) {
    const bool is_idle = declare_parameter("idle", false);
    timer_ = create_timer("timer", is_idle ? Nanoseconds(1h) : Nanoseconds(1ms),
                          [this] { publisher_->publish(Beat{}); });
    if (is_idle) return;
    subscription_ = create_subscription<Beat>(
        "beat", 10, [](const Beat&) { ++heard; },
        create_callback_group("ear", CallbackGroupType::MutuallyExclusive));
  }

 private:
  const std::shared_ptr<Publisher<Beat>> publisher_ = create_publisher<Beat>("beat", 10);
  std::shared_ptr<Timer> timer_;
  std::shared_ptr<Subscription<Beat>> subscription_;
};

SystemDescription hearts() {
  [[maybe_unused]] static const bool is_registered = [] {
    components().add("test::Heart", {"heart", [](const NodeOptions& options) {
                                       return std::make_unique<Component>(
                                           Component{std::make_shared<Heart>(options)});
                                     }});
    return true;
  }();
  SystemDescription system;
  system.name = "body";
  system.threads.push_back({.attributes = {.name = "container"}});
  system.executors.push_back({.name = "fast", .type = "events"});
  system.components.push_back({.type = "test::Heart", .executor = "fast"});
  return system;
}

/// One that runs.
class Running {
 public:
  explicit Running(const SystemDescription& system) : container(system) {
    container.start();
    container.release();
  }
  ~Running() {
    container.hold();
    container.stop();
  }
  bool goes_on(int more) const {
    const int before = heard.load();
    return eventually([&] { return heard.load() >= before + more; });
  }
  Container container;
};

template <class Rows>
const auto& row(const Rows& rows, const std::string& name) {
  const auto named = [&](const auto& each) {
    if constexpr (requires { each.callback; })
      return each.node + "/" + each.callback == name;
    else
      return each.name == name;
  };
  const auto found = std::find_if(rows.begin(), rows.end(), named);
  if (found == rows.end()) throw Error("no row is called " + name);
  return *found;
}

/// Asks as `takt top` does.
class Asker {
 public:
  Asker() { executor_->add_node(node); }
  template <class S>
  typename S::Response ask(const std::string& service, const typename S::Request& request = {}) {
    const auto client = node->template create_client<S>(service);
    const auto answer = client->async_send_request(request);
    EXPECT_EQ(executor_->spin_until_future_complete(answer, 60s), FutureReturnCode::SUCCESS);
    return answer.get().value();
  }
  const std::shared_ptr<Node> node = std::make_shared<Node>("asker");

 private:
  const std::unique_ptr<Executor> executor_ = executors().make("events", {});
};

// In this order, while it runs: nothing, a trace, its pages, nothing.
TEST(TraceContainer, RecordsARunningContainer) {
  const Running running(hearts());
  Asker asker;
  const auto ask = [&](const TraceContainer::Request& request) {
    return asker.ask<TraceContainer>("/body/trace", request);
  };
  EXPECT_THAT(ask({.command = "stop"}).reason, testing::HasSubstr("it is not traced"));
  EXPECT_THAT(ask({.command = "start", .clock = "sundial"}).reason,
              testing::HasSubstr("'sundial' is not a clock"));
  EXPECT_THAT(ask({.command = "paint"}).reason,
              testing::HasSubstr("valid: start, stop, read, forget"));
  ASSERT_TRUE(running.goes_on(3));
  const std::int64_t before = Clock::steady().now().time_since_epoch().count();
  EXPECT_EQ(ask({.command = "start", .clock = "boottime"}).reason, "");
  EXPECT_THAT(ask({.command = "start", .clock = "boottime"}).reason,
              testing::HasSubstr("traced already"));
  ASSERT_TRUE(running.goes_on(520));  // of two callbacks: more than one page
  const auto stopped = ask({.command = "stop"});
  ASSERT_EQ(stopped.reason, "");
  EXPECT_EQ(stopped.clock, "boottime");
  ASSERT_GE(stopped.pages, 2u);
  const auto& thread = row(stopped.threads, "fast");
  EXPECT_EQ(thread.executor, "fast");
  EXPECT_EQ(thread.executor_type, "events");
  EXPECT_EQ(thread.overwritten, 0u);
  std::map<std::string, int> counts;
  std::uint64_t last = 0;  // of the timer's releases: none is missing, none is there twice
  for (std::uint32_t page = 0; page < stopped.pages; ++page) {
    for (const auto& event : ask({.command = "read", .page = page}).events) {
      const auto& callback = stopped.callbacks.at(event.callback);
      ++counts[callback.name + " " + callback.kind];
      EXPECT_LE(event.ready_ns, event.picked_ns);
      EXPECT_LE(event.start_ns, event.end_ns);
      EXPECT_GE(event.end_ns, before);
      EXPECT_EQ(event.cause != 0, callback.kind == "subscription");
      EXPECT_GT(event.sequence, last);
      last = event.sequence;
    }
  }
  EXPECT_EQ(counts.size(), 2u);
  EXPECT_GE(counts["/heart/beat subscription"], 520);
  EXPECT_LE(std::abs(counts["/heart/beat subscription"] - counts["/heart/timer timer"]), 1);
  // A stop that failed may come again, and no new start destroys what it has left.
  EXPECT_EQ(ask({.command = "stop"}).pages, stopped.pages);
  EXPECT_EQ(ask({.command = "read"}).events.size(), TraceContainer::kMostOfPage);
  EXPECT_THAT(ask({.command = "start", .clock = "boottime"}).reason,
              testing::HasSubstr("its last trace was not written yet"));
  EXPECT_EQ(ask({.command = "forget"}).reason, "");
  EXPECT_THAT(ask({.command = "read"}).reason, testing::HasSubstr("there is no trace to read"));
  EXPECT_THAT(ask({.command = "stop"}).reason, testing::HasSubstr("it is not traced"));
}

TEST(GetStatistics, TellsWhatARunningContainerHasDone) {
  const Running running(hearts());
  Asker asker;
  ASSERT_TRUE(running.goes_on(3));
  const auto before = asker.ask<GetStatistics>("/body/get_statistics");
  ASSERT_TRUE(running.goes_on(10));
  const auto now = asker.ask<GetStatistics>("/body/get_statistics");
  EXPECT_EQ(now.pid, getpid());
  EXPECT_GT(now.time_ns, before.time_ns);
  EXPECT_GE(now.cpu_time_ns, before.cpu_time_ns);
  const auto& fast = row(now.executors, "fast");
  EXPECT_EQ(fast.type, "events");
  EXPECT_EQ(fast.scheduler, "fifo");
  const auto& thread = row(now.threads, "fast");
  EXPECT_EQ(thread.executor, "fast");
  EXPECT_EQ(thread.policy, "SCHED_OTHER");
  EXPECT_FALSE(thread.affinity.empty());
  EXPECT_GT(thread.cpu_time_ns, row(before.threads, "fast").cpu_time_ns);
  EXPECT_GT(thread.wakeups, 0u);
  EXPECT_EQ(row(now.threads, "container").executor, "container");
  const auto& ear = row(now.callbacks, "/heart/beat");
  EXPECT_EQ(ear.executor, "fast");
  EXPECT_EQ(ear.group, "ear");
  EXPECT_EQ(ear.kind, "subscription");
  EXPECT_EQ(ear.topic, "/beat");
  EXPECT_GE(ear.received, row(before.callbacks, "/heart/beat").received + 10);
  EXPECT_GE(ear.expected, ear.received);
  EXPECT_GE(ear.execution.count + 1, ear.received);
  EXPECT_GE(row(now.topics, "/beat").messages, ear.received);
  EXPECT_EQ(row(now.topics, "/beat").subscriptions, 1u);
  for (const auto& topic : now.topics) EXPECT_TRUE(topic.name.starts_with('/')) << topic.name;
  EXPECT_EQ(now.callbacks.size(), 2u);  // none of the container's own
}

TEST(GetStatistics, HasNoRowsOfWhatWasUnloaded) {
  Running running(hearts());
  ASSERT_TRUE(running.goes_on(3));
  running.container.unload(running.container.components().front().id);
  const GetStatistics::Response now = running.container.statistics();
  EXPECT_TRUE(now.callbacks.empty());
  for (const auto& topic : now.topics) EXPECT_EQ(topic.subscriptions, 0u) << topic.name;
}

TEST(GetStatistics, TheIntervalIsTheDifferenceOfTwoAnswers) {
  const Running running(hearts());
  ASSERT_TRUE(running.goes_on(20));
  const GetStatistics::Response before = running.container.statistics();
  ASSERT_TRUE(running.goes_on(20));
  const GetStatistics::Response now = running.container.statistics();
  const StatisticsInterval last = interval(before, now);
  EXPECT_DOUBLE_EQ(last.seconds, static_cast<double>(now.time_ns - before.time_ns) / 1e9);
  const auto& ear = row(last.callbacks, "/heart/beat");
  const auto counted =
      row(now.callbacks, "/heart/beat").received - row(before.callbacks, "/heart/beat").received;
  EXPECT_DOUBLE_EQ(ear.rate, static_cast<double>(counted) / last.seconds);
  ASSERT_TRUE(ear.latency.p50 && ear.execution.p99);
  EXPECT_LE(*ear.latency.p50, *ear.latency.p99);
  EXPECT_LE(*ear.latency.p99, *ear.latency.max);
  const auto& fast = row(last.executors, "fast");
  EXPECT_EQ(fast.threads, 1u);
  EXPECT_GE(fast.rate, ear.rate);
  EXPECT_GT(fast.cpu_percent, 0);
  // Of another process, or of none: nobody knows how long that was.
  GetStatistics::Response other = before;
  ++other.pid;
  EXPECT_EQ(interval(other, now).seconds, 0);
  EXPECT_EQ(row(interval({}, now).callbacks, "/heart/beat").rate, 0);
  // Of a callback that has begun again.
  GetStatistics::Response more = before;
  for (auto& callback : more.callbacks) callback.received += 1'000'000;
  EXPECT_EQ(row(interval(more, now).callbacks, "/heart/beat").rate, 0);
}

// Numbers come from the wire: any of them may be anything.
TEST(GetStatistics, NumbersOfAStrangerAreHarmless) {
  GetStatistics::Times now, before;
  now.buckets = {0, 5, UINT16_MAX, 9};
  now.counts = {1, 2, 3};
  before.buckets = {5, 7};
  before.counts = {9};
  const Histogram part = now.since(before);
  EXPECT_EQ(part.count(), 1u);
  GetStatistics::Response first, second;
  first.time_ns = INT64_MAX;
  second.time_ns = INT64_MIN;
  second.callbacks.push_back({.received = UINT64_MAX, .expected = 1, .dropped = UINT64_MAX});
  EXPECT_EQ(interval(first, second).seconds, 0);
}

TEST(GetStatistics, ShowsAChangedPriority) {
  const Running running(hearts());
  Asker asker;
  const auto answer = asker.ask<SetCallbackParameters>(
      "/body/set_callback_parameters",
      {"heart: {callbacks: {beat: {priority: 7, deadline: 3ms, budget: 2ms}}}"});
  EXPECT_TRUE(answer.success) << answer.reason;
  const GetStatistics::Response now = running.container.statistics();
  const auto& ear = row(now.callbacks, "/heart/beat");
  EXPECT_EQ(ear.priority, 7);
  EXPECT_EQ(Nanoseconds(ear.deadline_ns), 3ms);
  EXPECT_EQ(Nanoseconds(ear.budget_ns), 2ms);
}

// Services and diagnostics are there, and nobody asks.
TEST(GetStatistics, NobodyWakesUpForItWhileNobodyAsks) {
  SystemDescription system = hearts();
  system.dds.emplace().domain = test_domain();
  system.dds->discovery = DiscoveryRange::off;
  system.executors.push_back({.name = "idle", .type = "single_threaded"});
  system.components.push_back({.type = "test::Heart",
                               .name = "sleeper",
                               .executor = "idle",
                               .parameters = {{"idle", true}}});
  const Running running(system);
  std::map<std::string, std::uint64_t> before;
  ASSERT_TRUE(eventually([&] {  // all have begun to sleep
    if (!running.goes_on(20)) return false;
    bool is_idle = true;
    for (const char* name : {"idle", "container", "requests"}) {
      const std::uint64_t wakeups = row(running.container.statistics().threads, name).wakeups;
      is_idle = std::exchange(before[name], wakeups) == wakeups && is_idle;
    }
    return is_idle;
  }));
  ASSERT_TRUE(running.goes_on(1500));  // longer than the period of diagnostics
  const GetStatistics::Response now = running.container.statistics();
  for (const auto& [name, wakeups] : before) EXPECT_EQ(row(now.threads, name).wakeups, wakeups);
}

// ---- /diagnostics ----

/// Subscribes to it, and waits for the next message.
class Watcher {
 public:
  Watcher() { executor_->add_node(node_); }
  bool hears_one() {
    const int before = count_;
    const auto limit = std::chrono::steady_clock::now() + 60s;
    while (count_ == before && std::chrono::steady_clock::now() < limit) executor_->spin_once(1s);
    return count_ > before;
  }
  const DiagnosticStatus& status(const std::string& name) const { return row(last_.status, name); }

 private:
  int count_ = 0;
  DiagnosticArray last_;
  const std::shared_ptr<Node> node_ = std::make_shared<Node>("watcher");
  const std::shared_ptr<Subscription<DiagnosticArray>> subscription_ =
      node_->create_subscription<DiagnosticArray>("/diagnostics", 10,
                                                  [this](const DiagnosticArray& array) {
                                                    ++count_;
                                                    last_ = array;
                                                  });
  const std::unique_ptr<Executor> executor_ = executors().make("events", {});
};

SystemDescription with_dds() {
  SystemDescription system = hearts();
  system.dds.emplace().domain = test_domain();
  system.dds->discovery = DiscoveryRange::off;
  return system;
}

TEST(Diagnostics, ArePublishedWhileSomebodySubscribes) {
  const Running running(with_dds());
  for (int round = 0; round < 2; ++round) {  // again, after a pause
    Watcher watcher;
    ASSERT_TRUE(watcher.hears_one());
    const DiagnosticStatus& ear = watcher.status("body: callback /heart/beat");
    EXPECT_EQ(ear.level, DiagnosticStatus::OK);
    EXPECT_EQ(ear.message, "ok");
    EXPECT_EQ(ear.hardware_id, "body");
    const auto rate = std::find_if(ear.values.begin(), ear.values.end(),
                                   [](const auto& pair) { return pair.key == "rate_hz"; });
    ASSERT_NE(rate, ear.values.end());
    EXPECT_GT(std::stod(rate->value), 0);
    EXPECT_EQ(watcher.status("body: executor fast").level, DiagnosticStatus::OK);
    EXPECT_EQ(watcher.status("body: container").values.at(0).value, std::to_string(getpid()));
  }
}

TEST(Diagnostics, WarnOfMissedDeadlinesAndDroppedMessages) {
  GetStatistics::Response before{.pid = 1, .time_ns = 1}, now{.pid = 1, .time_ns = 1'000'000'001};
  now.executors.push_back({.name = "fast"});
  now.callbacks.push_back({.executor = "fast",
                           .node = "/a",
                           .callback = "b",
                           .deadline_misses = 2,
                           .latency = {},
                           .execution = {}});
  now.callbacks.back().dropped = 1;
  now.chains.push_back({.name = "c", .misses = 1, .aborted = 3, .latency = {}});
  const DiagnosticArray array = diagnostics_of("robot", before, now);
  EXPECT_EQ(row(array.status, "robot: container").level, DiagnosticStatus::OK);
  for (const char* name : {"robot: executor fast", "robot: callback /a/b"}) {
    EXPECT_EQ(row(array.status, name).level, DiagnosticStatus::WARN);
    EXPECT_EQ(row(array.status, name).message, "2 deadlines missed, 1 message dropped");
  }
  EXPECT_EQ(row(array.status, "robot: chain c").message, "1 deadline missed, 3 instances aborted");
}

TEST(Diagnostics, WarnOfWhatWasNotAsABoundAssumes) {
  GetStatistics::Response before{.pid = 1, .time_ns = 1, .watches_bounds = true};
  before.deviations.push_back(
      {.id = "as_declared", .text = "was 2 ms", .chains = {"c"}, .count = 3});
  GetStatistics::Response now = before;
  now.time_ns = 1'000'000'001;
  EXPECT_EQ(row(diagnostics_of("robot", before, now).status, "robot: bounds").level,
            DiagnosticStatus::OK);
  now.deviations.front().text = "was 4 ms";
  now.deviations.front().count = 5;
  const DiagnosticStatus status = row(diagnostics_of("robot", before, now).status, "robot: bounds");
  EXPECT_EQ(status.level, DiagnosticStatus::WARN);
  EXPECT_EQ(status.message, "was 4 ms");
  EXPECT_EQ(status.values.at(0).key, "as_declared_1");
  EXPECT_EQ(status.values.at(0).value, "was 4 ms, 5 times");
  EXPECT_EQ(interval(before, now).deviations.at(0).lately, 2U);
}

TEST(Diagnostics, AreOffWhereTheFileSaysSo) {
  SystemDescription system = with_dds();
  system.dds->diagnostics = false;
  const Running running(system);
  const std::vector<Endpoint> publishers = local_topics().publishers;
  EXPECT_TRUE(std::none_of(publishers.begin(), publishers.end(),
                           [](const Endpoint& end) { return end.topic == kDiagnosticsTopic; }));
}

// Of a stranger with as many rows as are read: executors times callbacks took takt top minutes.
TEST(StatisticsInterval, OfTheMostRowsIsLinear) {
  GetStatistics::Response answer;
  answer.pid = 1;
  for (int i = 0; i < 10'000; ++i) {
    answer.executors.push_back({.name = fmt::format("e{}", i)});
    answer.threads.push_back({.executor = fmt::format("e{}", i), .tid = i});
    answer.callbacks.push_back(
        {.executor = fmt::format("e{}", i), .received = 1, .deadline_misses = 2});
  }
  const StatisticsInterval of = interval({}, answer);
  ASSERT_EQ(of.executors.size(), 10'000U);
  EXPECT_EQ(of.executors.back().threads, 1U);
  EXPECT_EQ(of.executors.back().all_faults.deadline_misses, 2U);
}

}  // namespace
}  // namespace takt::statistics_test
