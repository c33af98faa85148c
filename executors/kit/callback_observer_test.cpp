// An executor without the engine: with a CallbackObserver, its figures are those of the engine.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/callback_observer.hpp"

#include <fmt/format.h>

#include "takt/executors/kit/kit_test.hpp"
#include "takt/executors/wait_backends/wait_backend.hpp"
#include "takt/executors/watchdog.hpp"
#include "takt/nodes/chain.hpp"

namespace takt::conformance {
namespace {

/// One thread; what was added first runs first. Nothing is added or removed while it spins.
class ByHand final : public Executor {
 public:
  ByHand(const ExecutorOptions& options, const ExecutorTraits&)
      : clock_(*options.clock),
        backend_(make_wait_backend(options.wait, clock_, 1, false)),
        observer_(options) {}
  ~ByHand() override {
    for (const auto& member : members_) member->entity->leave_owner();
  }

  void add_node(const std::shared_ptr<Node>& node) override {
    for (const auto& group : node->groups()) add_callback_group(group, node);
  }
  void remove_node(const std::shared_ptr<Node>&) override {}
  void add_callback_group(const std::shared_ptr<CallbackGroup>& group,
                          const std::shared_ptr<Node>& node) override {
    for (const auto& entity : node->entities()) {
      if (entity->group() == group) add(entity, *node);
    }
  }
  void remove_callback_group(const std::shared_ptr<CallbackGroup>&,
                             const std::shared_ptr<Node>&) override {}

  void spin(const ExceptionHandler&) override {
    CallbackObserver::Thread thread(observer_);
    backend_->enter(0, {});
    spins_ = true;
    while (!cancelled_) {
      if (!run_one(thread)) backend_->wait(0, next_release());
    }
    spins_ = cancelled_ = false;
    backend_->leave(0);
  }
  void spin_once(Nanoseconds) override {}
  void spin_some(Nanoseconds) override {
    CallbackObserver::Thread thread(observer_);
    while (run_one(thread)) {
    }
  }
  void spin_all(Nanoseconds limit) override { spin_some(limit); }
  void cancel() noexcept override {
    cancelled_ = true;
    backend_->post();
  }
  bool is_spinning() const noexcept override { return spins_; }
  void release_timers(bool released) noexcept override { observer_.release_timers(released); }
  std::size_t pending() const noexcept override { return observer_.pending(); }
  std::vector<CallbackStatistics> statistics() const override { return observer_.statistics(); }
  std::vector<ThreadStatistics> thread_statistics() const override {
    return observer_.thread_statistics();
  }
  std::vector<int> running_threads() const override { return observer_.running_threads(); }
  void begin_trace(std::size_t events) override { observer_.begin_trace(events); }
  void end_trace() noexcept override { observer_.end_trace(); }
  std::vector<ThreadStatistics> traces() const override { return observer_.traces(); }

 private:
  struct Member final : Sink {
    Member(ByHand& of, std::shared_ptr<Entity> whose, const Node& node)
        : executor(of), entity(std::move(whose)), callback(of.observer_.add(entity, node)) {}
    void announce(const Arrival&) noexcept override { executor.backend_->post(); }
    void release_changed() noexcept override { executor.backend_->post(); }
    void expect_remove() noexcept override {}
    void remove() noexcept override {
      entity->detach();
      executor.observer_.remove(callback);
    }
    ByHand& executor;
    const std::shared_ptr<Entity> entity;
    CallbackObserver::Callback& callback;
  };

  FutureReturnCode spin_until_complete(FutureState&, Nanoseconds) override {
    return FutureReturnCode::TIMEOUT;
  }
  void add(const std::shared_ptr<Entity>& entity, const Node& node) {
    Member& member = *members_.emplace_back(std::make_unique<Member>(*this, entity, node));
    {
      const std::lock_guard ownership(ownership_mutex());
      entity->set_owner(&member);
    }
    entity->attach(member);
  }
  bool run_one(CallbackObserver::Thread& thread) {
    return std::any_of(members_.begin(), members_.end(), [&](const auto& member) {
      return member->entity->ready_count() != 0 && thread.run(member->callback);
    });
  }
  TimePoint next_release() const {
    TimePoint next = kNever;
    for (const auto& member : members_) {
      next = std::min(next, member->entity->next_release().value_or(kNever));
    }
    return next;
  }

  Clock& clock_;
  const std::unique_ptr<WaitBackend> backend_;
  CallbackObserver observer_;
  std::vector<std::unique_ptr<Member>> members_;
  std::atomic<bool> spins_{false}, cancelled_{false};
};
TAKT_REGISTER_EXECUTOR_CLASS("by_hand", "for tests", ByHand)

std::string text_of(const Histogram& histogram) {
  return fmt::format("{} up to {}", histogram.count(), to_string(histogram.max()));
}

class Observer : public Kit, public ::testing::WithParamInterface<bool> {
 protected:
  std::unique_ptr<Executor> make(const std::string& type) {
    const auto watchdog = GetParam()
                              ? std::make_shared<Watchdog>(ThreadAttributes{.name = "watchdog"},
                                                           Realtime::off, clock_)
                              : nullptr;
    auto executor = executors().make(
        type, {.name = "all", .trace_events = 64, .watchdog = watchdog, .clock = &clock_});
    executor->add_node(node_);
    return executor;
  }
  std::size_t participants() const { return GetParam() ? 2 : 1; }

  // All that is said of a run.
  static std::string figures(const Executor& executor, const Chain& chain) {
    std::string text;
    for (const CallbackStatistics& row : executor.statistics()) {
      text += fmt::format(
          "{}/{}/{} {} of {}, {} dropped, {} misses, {} overruns, {} skipped, {} too late\n"
          "  latency {}, waiting {}, take {}, execution {}\n",
          row.node, row.group, row.callback, row.received, row.expected, row.dropped,
          row.deadline_misses, row.overruns, row.skipped, row.too_late.value_or(0),
          text_of(row.latency), text_of(row.waiting), text_of(row.take), text_of(row.execution));
    }
    const ChainStatistics of_chain = chain.statistics();
    text += fmt::format("chain: {}, {} misses, {} aborted, latency {}\n", of_chain.instances,
                        of_chain.misses, of_chain.aborted, text_of(of_chain.latency));
    for (const ThreadStatistics& thread : executor.thread_statistics()) {
      text += thread.asked.name + ":";
      for (const NamedTraceEvent& event : thread.trace) {
        text += fmt::format(" {} {} {}", event.name, to_string(event.start - event.ready),
                            to_string(event.end - event.start));
      }
    }
    return text + "\n";
  }

  // A timer and what it causes: too late, too long, and some of it aborted.
  std::string figures_of(const std::string& type) {
    trace_.clear();
    groups_ = 0;
    node_.reset();
    node_ = std::make_shared<Node>("node", NodeOptions{.clock = &clock_});
    const auto to_step = node_->create_publisher<Number>("step", 9);
    publishers_.clear();
    const auto timer = node_->create_timer("timer", 10ms, [&, count = 0]() mutable {
      to_step->publish(Number{++count});
      clock_.work(1ms);
    });
    const auto to_last = node_->create_publisher<Number>("last", 9);
    const auto step = node_->create_subscription<Number>("step", 9, [&](const Number& number) {
      to_last->publish(number);
      clock_.work(number.value % 2 == 0 ? 3ms : 5ms);
    });
    CallbackParameters limits{.deadline = 5ms, .budget = 4ms, .overrun = OverrunPolicy::abort};
    const auto noting = [this](const char* what) {
      return [this, what](const OverrunReport& report) {
        trace_.push_back(fmt::format("{} {} {}@{}", what, report.callback,
                                     to_string(report.execution_time), now_ms()));
      };
    };
    limits.on_deadline_miss = noting("miss");
    limits.on_overrun = noting("overrun");
    step->set_parameters(limits);
    const auto last = subscribe("last", 1ms);
    const auto chain = Chain::create({.name = "chain", .deadline = 8ms},
                                     {{node_, "timer"}, {node_, "step"}, {node_, "last"}});
    std::string text;
    begin_ms_ = static_cast<int>(clock_.now().time_since_epoch() / 1ms);
    const auto executor = make(type);
    {
      const ManualSpin spin(*executor, clock_, participants());
      clock_.advance(65ms);
      timer->cancel();
      clock_.advance(20ms);
    }
    for (const std::string& entry : trace_) text += entry + "\n";
    return text + figures(*executor, *chain);
  }
};

TEST_P(Observer, SaysWhatTheEngineSays) {
  const std::string of_engine = figures_of("events");
  EXPECT_THAT(of_engine, AllOf(::testing::HasSubstr("miss step"), ::testing::HasSubstr("overrun"),
                               ::testing::HasSubstr("aborted")));
  EXPECT_EQ(figures_of("by_hand"), of_engine);
}

INSTANTIATE_TEST_SUITE_P(Watchdog, Observer, ::testing::Bool());

TEST_F(Kit, WhatACallbackByHandThrowsLeavesItAndIsCounted) {
  const auto condition =
      node_->create_guard_condition("condition", [] { throw std::runtime_error("out of order"); });
  const auto executor = executors().make("by_hand", {.clock = &clock_});
  executor->add_node(node_);
  condition->trigger();
  EXPECT_EQ(executor->pending(), 1u);
  EXPECT_THROW(executor->spin_some(), std::runtime_error);
  EXPECT_EQ(executor->pending(), 0u);
  EXPECT_EQ(executor->statistics().at(0).received, 1u);
}

TEST(CallbackObserver, KnowsItsThreads) {
  CallbackObserver observer({.name = "two"}, 2);
  EXPECT_THAT(observer.running_threads(), ::testing::IsEmpty());
  {
    const CallbackObserver::Thread second(observer, 1);
    EXPECT_THAT(observer.running_threads(), ::testing::ElementsAre(gettid()));
  }
  EXPECT_THAT(observer.running_threads(), ::testing::IsEmpty());
  EXPECT_THROW(CallbackObserver::Thread(observer, 2), Error);
}

TEST_F(Kit, WhatAnotherExecutorHasCountedIsNotCountedByHandAgain) {
  const auto step = subscribe("step");
  {
    const auto first = make("events");
    send("step", 1);
    first->spin_some();
    EXPECT_EQ(first->statistics().at(0).received, 1u);
  }
  const auto executor = executors().make("by_hand", {.clock = &clock_});
  executor->add_node(node_);
  send("step", 2);
  executor->spin_some();
  const CallbackStatistics row = executor->statistics().at(0);
  EXPECT_EQ(row.received, 1u);
  EXPECT_EQ(row.expected, 1u);
}

}  // namespace
}  // namespace takt::conformance
