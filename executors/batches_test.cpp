// Long work in batches, on virtual CPUs: what runs between them, when a cancel is seen, and what is
// counted. What every executor does: conformance/task_test.cpp.
// SPDX-License-Identifier: Apache-2.0
#include <stop_token>
#include <tuple>
#include <vector>

#include "takt/base/available_cpus.hpp"
#include "takt/executors/conformance/conformance.hpp"
#include "takt/ros2/action_client.hpp"
#include "takt/ros2/action_server.hpp"
#include "takt/testing/band.hpp"

namespace takt::conformance {
namespace {

/// Shaped like action_tutorials_interfaces/action/Fibonacci.
struct CountTo {
  struct Goal {
    int to = 0;
  };
  struct Result {
    int reached = 0;
  };
  struct Feedback {
    int reached = 0;
  };
};
TAKT_MESSAGE(CountTo::Goal, "test_msgs/action/CountTo_Goal", to);
TAKT_MESSAGE(CountTo::Result, "test_msgs/action/CountTo_Result", reached);
TAKT_MESSAGE(CountTo::Feedback, "test_msgs/action/CountTo_Feedback", reached);

/// One execution: which callback, and when it began and ended.
using Executed = std::tuple<std::string, Nanoseconds, Nanoseconds>;

class Batches : public ::testing::Test {
 protected:
  std::shared_ptr<CallbackGroup> group(const std::string& name, const CallbackParameters& of_it) {
    auto made = node_->create_callback_group(name, CallbackGroupType::MutuallyExclusive);
    made->set_parameters(of_it);
    return made;
  }
  void run(const std::string& name, Nanoseconds duration) {
    const TimePoint start = clock_.now();
    clock_.work(duration);
    runs_.emplace_back(name, start.time_since_epoch(), clock_.now().time_since_epoch());
  }
  /// Released at once: as many batches, each of this length.
  Timer::SharedPtr work(int count, Nanoseconds each, const CallbackParameters& parameters = {}) {
    auto timer = node_->create_timer(
        "work", 1s,
        [this, count, each]() -> Task<> {
          for (int i = 0; i < count; ++i) {
            run("work", each);
            co_await batch();
          }
        },
        group("work", parameters));
    timer->release_at(clock_.now());
    return timer;
  }
  Timer::SharedPtr tick(Nanoseconds first, Nanoseconds period) {
    auto timer = node_->create_timer(
        "tick", period, [this] { run("tick", 1ms); }, group("tick", {.priority = 9}));
    timer->release_at(clock_.now() + first);
    return timer;
  }
  std::unique_ptr<Executor> spin_for(Nanoseconds duration, const std::string& type,
                                     ExecutorOptions options) {
    options.clock = &clock_;
    options.realtime = Realtime::off;  // no CPU of this machine
    auto executor = executors().make(type, options);
    executor->add_node(node_);
    const ManualSpin spin(*executor, clock_, std::max<std::size_t>(1, options.threads.size()));
    clock_.advance(duration);
    return executor;
  }
  static CallbackStatistics find(const Executor& executor, const std::string& callback) {
    for (CallbackStatistics& statistics : executor.statistics()) {
      if (statistics.callback == callback) return std::move(statistics);
    }
    return {};
  }

  ManualClock clock_{TimePoint{}, {available_cpus().front()}};
  const std::shared_ptr<Node> node_ = std::make_shared<Node>("node", NodeOptions{.clock = &clock_});
  std::vector<Executed> runs_;
};

TEST_F(Batches, WhatIsMoreUrgentRunsBetweenThem) {
  const auto work_timer = work(5, 2ms);
  const auto tick_timer = tick(1ms, 5ms);
  spin_for(15ms, "events", {.scheduler = "fixed_priority"});
  EXPECT_THAT(runs_, ElementsAre(Executed("work", 0ms, 2ms), Executed("tick", 2ms, 3ms),   //
                                 Executed("work", 3ms, 5ms), Executed("work", 5ms, 7ms),   //
                                 Executed("tick", 7ms, 8ms), Executed("work", 8ms, 10ms),  //
                                 Executed("work", 10ms, 12ms), Executed("tick", 12ms, 13ms)));
  EXPECT_EQ(tick_timer->missed(), 0u);
}

TEST_F(Batches, WhatIsLessUrgentRunsBehindTheLast) {
  const auto work_timer = work(3, 2ms, {.priority = 10});
  const auto tick_timer = tick(1ms, 50ms);
  spin_for(20ms, "events", {.scheduler = "fixed_priority"});
  EXPECT_THAT(runs_, ElementsAre(Executed("work", 0ms, 2ms), Executed("work", 2ms, 4ms),
                                 Executed("work", 4ms, 6ms), Executed("tick", 6ms, 7ms)));
}

// At a polling point, all that is ready has its turn.
TEST_F(Batches, OneRunsAtEachPollingPoint) {
  const auto work_timer = work(3, 2ms);
  const auto tick_timer = tick(1ms, 50ms);
  spin_for(20ms, "single_threaded", {});
  EXPECT_THAT(runs_, ElementsAre(Executed("work", 0ms, 2ms), Executed("tick", 2ms, 3ms),
                                 Executed("work", 3ms, 5ms), Executed("work", 5ms, 7ms)));
}

// Teper et al., RTAS 2026: the longer the batch, the more periods a second timer misses.
TEST_F(Batches, TheLongerTheyAreTheMoreReleasesOfOthersAreMissed) {
  std::vector<std::uint64_t> missed;
  for (const int batches : {40, 10, 5, 2, 1}) {
    const auto work_timer = work(batches, 40ms / batches);
    const auto tick_timer = tick(1ms, 5ms);
    spin_for(60ms, "events", {.scheduler = "fixed_priority"});
    missed.push_back(tick_timer->missed());
  }
  EXPECT_THAT(missed, ElementsAre(0u, 0u, 3u, 6u, 7u));
}

// Reactive: a batch that has begun ends; the callback that asks runs behind it.
TEST_F(Batches, ACancelIsSeenBehindTheBatch) {
  std::stop_source stop;
  const auto group = this->group("one", {});
  const auto work_timer = node_->create_timer(
      "work", 1s,
      [&]() -> Task<> {
        while (!stop.stop_requested()) {
          run("work", 4ms);
          co_await batch();
        }
      },
      group);
  work_timer->release_at(clock_.now());
  const auto stop_timer = node_->create_timer(
      "stop", 1s,
      [&] {
        run("stop", 0ms);
        stop.request_stop();
      },
      group);
  stop_timer->release_at(clock_.now() + 5ms);
  spin_for(50ms, "single_threaded", {});
  EXPECT_THAT(runs_, ElementsAre(Executed("work", 0ms, 4ms), Executed("work", 4ms, 8ms),
                                 Executed("stop", 8ms, 8ms)));
}

// Proactive: the batch asks again and again, and the callback that answers interrupts it.
TEST_F(Batches, ACancelThatInterruptsIsSeenAtOnce) {
  std::stop_source stop;
  const auto work_timer = node_->create_timer(
      "work", 1s,
      [&]() -> Task<> {
        while (!stop.stop_requested()) {
          const TimePoint start = clock_.now();
          for (int i = 0; i < 10 && !stop.stop_requested(); ++i) clock_.work(1ms);
          runs_.emplace_back("work", start.time_since_epoch(), clock_.now().time_since_epoch());
          co_await batch();
        }
      },
      group("work", {.priority = 1}));
  work_timer->release_at(clock_.now());
  const auto stop_timer = node_->create_timer(
      "stop", 1s,
      [&] {
        run("stop", 0ms);
        stop.request_stop();
      },
      group("stop", {.priority = 9}));
  stop_timer->release_at(clock_.now() + 12'500us);
  spin_for(50ms, "preemptive", {.threads = band_of(2)});
  EXPECT_THAT(runs_, ElementsAre(Executed("work", 0ms, 10ms), Executed("stop", 12'500us, 12'500us),
                                 Executed("work", 10ms, 13ms)));
}

TEST_F(Batches, AGoalIsCanceledBetweenThem) {
  const auto server = create_action_server<CountTo>(
      *node_, "count",
      [](const GoalId&, const CountTo::Goal&) { return GoalResponse::accept_and_execute; },
      [](const auto&) { return CancelResponse::accept; },
      [this](std::shared_ptr<ServerGoalHandle<CountTo>> goal) -> Task<> {
        int reached = 0;
        while (reached < goal->goal().to && !goal->is_canceling()) {
          run("count", 2ms);
          ++reached;
          co_await batch();
        }
        if (goal->is_canceling()) co_return goal->canceled({reached});
        goal->succeed({reached});
      },
      {.execute_group = group("count", {.priority = -1})});
  const auto client = create_action_client<CountTo>(*node_, "count");
  std::vector<std::string> ends;
  const auto ask = [&](int to, Nanoseconds patience) -> Task<> {
    const auto goal = co_await client->send_goal({to});
    co_await sleep_for(patience);
    co_await client->cancel_goal(goal);
    const auto end = co_await client->result(goal);
    ends.push_back(fmt::format("{} at {} after {} ms", to_string(end.state), end.result.reached,
                               clock_.now().time_since_epoch() / 1ms));
  };
  const auto timer = node_->create_timer("ask", 1s, [&]() -> Task<> {
    co_await ask(3, 50ms);
    co_await ask(1'000, 5ms);
  });
  timer->release_at(clock_.now());
  spin_for(200ms, "events", {.scheduler = "fixed_priority"});
  EXPECT_THAT(ends, ElementsAre("succeeded at 3 after 50 ms", "canceled at 3 after 56 ms"));
}

TEST_F(Batches, EachIsCountedAndChecked) {
  std::vector<std::string> overruns;
  const CallbackParameters parameters{
      .budget = 3ms, .on_overrun = [&](const OverrunReport& report) {
        overruns.push_back(
            fmt::format("{} took {} ms", report.callback, report.execution_time / 1ms));
      }};
  const auto timer = node_->create_timer(
      "work", 1s,
      [&]() -> Task<> {
        for (const Nanoseconds each : {2ms, 3ms, 5ms, 2ms}) {
          clock_.work(each);
          co_await batch();
        }
      },
      group("work", parameters));
  timer->release_at(clock_.now());
  const auto executor = spin_for(50ms, "events", {});
  EXPECT_THAT(overruns, ElementsAre("work/resumed took 5 ms"));
  EXPECT_EQ(find(*executor, "work").execution.count(), 1u);
  const CallbackStatistics resumed = find(*executor, "work/resumed");
  EXPECT_EQ(resumed.execution.count(), 4u);  // after the last batch there is the end
  EXPECT_EQ(resumed.overruns, 1u);
  EXPECT_EQ(resumed.execution.max(), 5ms);
}

}  // namespace
}  // namespace takt::conformance
