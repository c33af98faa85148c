// Every option that is a duration, with every duration: what is to last for ever is not over at
// once. Under a manual clock, so an executor that never came to rest would hang.
// SPDX-License-Identifier: Apache-2.0
#include "takt/testing/durations.hpp"

#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "takt/base/manual_clock.hpp"
#include "takt/executors/executor.hpp"
#include "takt/executors/wait_set.hpp"
#include "takt/ros2/action_client.hpp"
#include "takt/ros2/action_server.hpp"

namespace takt::durations_test {
namespace {

using namespace std::chrono_literals;

struct Number {
  int value = 0;
};
TAKT_MESSAGE(Number, "test_msgs/msg/Number", value);
struct Double {
  using Request = Number;
  using Response = Number;
};
struct Count {
  using Goal = Number;
  using Result = Number;
  using Feedback = Number;
};

/// One executor and one node, an hour after the clock began.
struct World {
  explicit World(const TriggerOptions& trigger = {})
      : executor(executors().make(trigger.let_period != 0ns ? "triggered" : "events",
                                  {.trigger = trigger, .clock = &clock})) {
    executor->add_node(node);
  }
  /// Lets so much time pass, and everything happen.
  void pass(Nanoseconds time) {
    executor->spin_all();
    clock.advance(time);
    executor->spin_all();
  }

  ManualClock clock{TimePoint(1h)};
  std::unique_ptr<Executor> executor;
  std::shared_ptr<Node> node = std::make_shared<Node>("node", NodeOptions{.clock = &clock});
};

/// What a duration of 0 means.
enum class Zero { none, at_once, refused };

struct Option {
  std::string name;
  Zero zero;
  /// Whether what lasts so long is over 10 ms later.
  std::function<bool(Nanoseconds)> is_over;
};

bool timer_fires(const std::function<void(Timer&, World&)>& set, Nanoseconds period) {
  World world;
  bool fires = false;
  const auto timer = world.node->create_timer("timer", period, [&] { fires = true; });
  set(*timer, world);
  world.pass(10ms);
  EXPECT_GE(static_cast<std::int64_t>(timer->missed()), 0);
  return fires;
}

bool task_goes_on(const std::function<Sleep(World&)>& sleep) {
  World world;
  bool goes_on = false;
  const auto timer = world.node->create_timer("timer", 1ms, [&]() -> Task<> {
    co_await sleep(world);
    goes_on = true;
  });
  world.pass(1ms);
  world.pass(10ms);
  return goes_on;
}

bool call_ends(Nanoseconds timeout) {
  World world;
  bool ends = false;
  const auto client = world.node->create_client<Double>("nobody", {.timeout = timeout});
  client->async_send_request({}, [&](const Number* answer) { ends = answer == nullptr; });
  world.pass(10ms);
  return ends;
}

bool result_is_forgotten(Nanoseconds timeout) {
  World world;
  const auto server = create_action_server<Count>(
      *world.node, "count",
      [](const GoalId&, const Number&) { return GoalResponse::accept_and_execute; },
      [](const auto&) { return CancelResponse::accept; },
      [](const auto& goal) { goal->succeed({7}); }, {.result_timeout = timeout});
  const auto client = create_action_client<Count>(*world.node, "count");
  std::shared_ptr<ClientGoalHandle> handle;
  client->async_send_goal({1}, {.response = [&](const auto& goal) { handle = goal; }});
  world.pass(10ms);
  int result = 0;
  client->async_get_result(handle,
                           [&](const auto&, const auto& ended) { result = ended.result.value; });
  world.executor->spin_all();
  return result != 7;
}

bool message_expires(Nanoseconds lifespan) {
  World world;
  bool has_come = false;
  const auto publisher = world.node->create_publisher<Number>("t", QoS(1).lifespan(lifespan));
  const auto subscription =
      world.node->create_subscription<Number>("t", 1, [&](const Number&) { has_come = true; });
  publisher->publish(Number{});
  world.clock.advance(10ms);
  world.pass(0ns);
  return !has_come;
}

bool deadline_is_missed(Nanoseconds deadline) {
  World world;
  bool is_missed = false;
  const QoS qos = QoS(1).deadline(deadline);
  const auto publisher = world.node->create_publisher<Number>("t", qos);
  const auto subscription = world.node->create_subscription<Number>("t", qos, [](const Number&) {});
  const auto event = world.node->create_qos_event<DeadlineMissedStatus>(
      *subscription, [&](const auto&) { is_missed = true; });
  publisher->publish(Number{});
  world.pass(0ns);
  world.pass(10ms);
  return is_missed;
}

bool has_let_period_ended(Nanoseconds period) {
  World world({.let_period = period});
  bool has_run = false;
  const auto guard = world.node->create_guard_condition("guard", [&] { has_run = true; });
  guard->trigger();
  world.pass(10ms);
  return has_run;
}

/// Whether a callback that takes 10 ms is reported by the handler.
bool is_reported(const std::function<void(CallbackParameters&, OverrunHandler)>& set) {
  World world;
  bool is_reported = false;
  CallbackParameters parameters;
  set(parameters, [&](const OverrunReport&) { is_reported = true; });
  const auto group =
      world.node->create_callback_group("group", CallbackGroupType::MutuallyExclusive);
  world.node->set_callback_parameters({.callback_groups = {{"group", parameters}}});
  const auto guard = world.node->create_guard_condition(
      "guard", [&] { world.clock.work(10ms); }, group);
  guard->trigger();
  world.pass(0ns);
  return is_reported;
}

/// Whether what waits, until its limit or a timer, ends 10 ms before the timer.
bool wait_ends(Nanoseconds limit, const std::function<void(World&)>& wait) {
  World world;
  bool has_fired = false;
  const auto timer = world.node->create_timer("timer", 10ms, [&] { has_fired = true; });
  std::thread other([&] {
    if (limit == 0ns) return;  // it does not wait
    world.clock.wait_for_participants(1);
    world.clock.advance(10ms);
  });
  wait(world);
  other.join();
  return !has_fired;
}

bool wait_set_ends(Nanoseconds limit) {
  ManualClock clock(TimePoint(1h));
  Node node("node", {.clock = &clock});
  const auto timer = node.create_timer("timer", 10ms, [] {});
  std::thread other([&] {
    if (limit == 0ns) return;
    clock.wait_for_participants(1);
    clock.advance(10ms);
  });
  bool ends = false;
  {
    WaitSet set(clock);
    set.add(timer);
    ends = set.wait(limit).empty();
  }
  other.join();
  return ends;
}

/// Whether a spin ends between two callbacks, of which the first one takes 10 ms.
bool spin_ends(const std::function<void(Executor&)>& spin) {
  World world;
  int ran = 0;
  const auto callback = [&] { ++ran, world.clock.work(10ms); };
  const auto first = world.node->create_guard_condition("first", callback);
  const auto second = world.node->create_guard_condition("second", callback);
  first->trigger();
  second->trigger();
  spin(*world.executor);
  return ran == 1;
}

const std::vector<Option>& options() {
  static const std::vector<Option> all{
      {"timer_period", Zero::refused, [](auto d) { return timer_fires([](auto&, auto&) {}, d); }},
      {"timer_reset", Zero::refused,
       [](auto d) { return timer_fires([](Timer& timer, auto&) { timer.reset(); }, d); }},
      {"release_at", Zero::at_once,
       [](auto d) {
         return timer_fires(
             [d](Timer& timer, World& world) { timer.release_at(later(world.clock.now(), d)); },
             1s);
       }},
      {"sleep_for", Zero::at_once,
       [](auto d) { return task_goes_on([d](auto&) { return sleep_for(d); }); }},
      {"sleep_until", Zero::at_once,
       [](auto d) {
         return task_goes_on(
             [d](World& world) { return sleep_until(later(world.clock.now(), d)); });
       }},
      {"call_timeout", Zero::none, call_ends},
      {"result_timeout", Zero::at_once, result_is_forgotten},
      {"lifespan", Zero::none, message_expires},
      {"deadline", Zero::refused, deadline_is_missed},
      {"let_period", Zero::at_once, has_let_period_ended},
      {"callback_deadline", Zero::refused,
       [](auto d) {
         return is_reported([d](CallbackParameters& parameters, OverrunHandler handler) {
           parameters.deadline = d;
           parameters.on_deadline_miss = std::move(handler);
         });
       }},
      {"callback_budget", Zero::refused,
       [](auto d) {
         return is_reported([d](CallbackParameters& parameters, OverrunHandler handler) {
           parameters.budget = d;
           parameters.on_overrun = std::move(handler);
         });
       }},
      {"spin_once", Zero::at_once,
       [](auto d) { return wait_ends(d, [d](World& world) { world.executor->spin_once(d); }); }},
      {"spin_until_future_complete", Zero::at_once,
       [](auto d) {
         return wait_ends(d, [d](World& world) {
           Promise<int> promise;
           const auto guard = world.node->create_timer("sets", 10ms, [&] { promise.set_value(1); });
           world.executor->spin_until_future_complete(promise.get_future(), d);
         });
       }},
      {"wait_set", Zero::at_once, wait_set_ends},
      {"spin_some", Zero::none,
       [](auto d) { return spin_ends([d](Executor& executor) { executor.spin_some(d); }); }},
      {"spin_all", Zero::none,
       [](auto d) { return spin_ends([d](Executor& executor) { executor.spin_all(d); }); }},
  };
  return all;
}

class Durations : public ::testing::TestWithParam<std::size_t> {};

// max as lifespan delivered nothing, as result_timeout forgot results at once: the sum with the
// time of now overflowed.
TEST_P(Durations, LastAsLongAsTheySay) {
  const Option& option = options()[GetParam()];
  for (const Nanoseconds duration : kDurations) {
    SCOPED_TRACE(duration.count());
    if (duration != 0ns) {
      EXPECT_EQ(option.is_over(duration), duration < 10ms);
    } else if (option.zero == Zero::refused) {
      EXPECT_THROW(option.is_over(duration), Error);
    } else {
      EXPECT_EQ(option.is_over(duration), option.zero == Zero::at_once);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Options, Durations, ::testing::Range<std::size_t>(0, options().size()),
                         [](const auto& option) { return options()[option.param].name; });

// The time since then overflowed: the timer had missed a negative number of releases.
TEST(Timer, OfTheFirstTimeOfAllMissesNoNegativeNumber) {
  World world;
  const auto timer = world.node->create_timer("timer", 1ms, [] {});
  timer->release_at(TimePoint::min());
  world.pass(10ms);
  EXPECT_GT(timer->missed(), 0u);
  EXPECT_LT(timer->missed(), std::uint64_t{INT64_MAX});
  EXPECT_GT(timer->due(), world.clock.now());
}

}  // namespace
}  // namespace takt::durations_test
