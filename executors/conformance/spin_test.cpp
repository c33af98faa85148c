// What the ways of spinning, cancelling and throwing mean. Run for every executor under
// every scheduler. The numbers in the comments are those of the rclcpp issues (or the project)
// whose defect is tested.
// SPDX-License-Identifier: Apache-2.0
#include <sys/resource.h>

#include "takt/executors/conformance/conformance.hpp"

namespace takt::conformance {
namespace {

class ConformanceSpin : public Conformance {};

// ---- Cancel and spin ----

// #1454, #3172: a cancel before spin was lost.
TEST_P(ConformanceSpin, CancelBeforeSpinEndsTheNextSpinOnly) {
  const auto executor = make(Clock::steady());
  const auto node = make_node(Clock::steady());
  std::atomic<int> ran{0};
  const auto guard = node->create_guard_condition("guard", [&] { ++ran; });
  executor->add_node(node);
  executor->cancel();
  executor->spin();  // returns
  EXPECT_FALSE(executor->is_spinning());
  SpinThread spin(*executor);
  guard->trigger();
  EXPECT_TRUE(eventually([&] { return ran == 1; }));
}

// Review of #3174.
TEST_P(ConformanceSpin, IsSpinningUntilSpinHasReturned) {
  const auto executor = make(Clock::steady());
  const auto node = make_node(Clock::steady());
  std::latch entered(1), leave(1);
  const auto guard = node->create_guard_condition("guard", [&] {
    entered.count_down();
    leave.wait();
  });
  executor->add_node(node);
  SpinThread spin(*executor);
  guard->trigger();
  entered.wait();
  executor->cancel();
  EXPECT_TRUE(executor->is_spinning());
  leave.count_down();
  spin.join();
  EXPECT_FALSE(executor->is_spinning());
}

TEST_P(ConformanceSpin, CancelFromACallbackEndsSpin) {
  const auto executor = make(Clock::steady());
  const auto node = make_node(Clock::steady());
  const auto timer = node->create_timer("timer", 1ms, [&] { executor->cancel(); });
  executor->add_node(node);
  executor->spin();
  executor->spin();
}

// `isolated` ran all that was ready in a node though a callback of spin_some had cancelled it.
TEST_P(ConformanceSpin, CancelFromACallbackIsTheEndOnTheCaller) {
  const auto executor = make(Clock::steady());
  const auto node = make_node(Clock::steady());
  int ran = 0;
  std::vector<std::shared_ptr<GuardCondition>> guards;
  for (int i = 0; i < 5; ++i) {
    guards.push_back(node->create_guard_condition("guard_" + std::to_string(i), [&] {
      if (++ran == 2) executor->cancel();
    }));
  }
  executor->add_node(node);
  Promise<int> promise;
  for (const auto& spin : std::vector<std::function<void()>>{
           [&] { executor->spin_some(); }, [&] { executor->spin_all(); },
           [&] { executor->spin_until_future_complete(promise.get_future()); }}) {
    ran = 0;
    for (const auto& guard : guards) guard->trigger();
    spin();
    EXPECT_EQ(ran, 2);
    executor->spin_all();
    EXPECT_EQ(ran, 5);
  }
}

TEST_P(ConformanceSpin, SpinningTwiceAtOnceIsAnError) {
  const auto executor = make(Clock::steady());
  const auto node = make_node(Clock::steady());
  std::string message;
  const auto timer = node->create_timer("timer", 1ms, [&] {
    try {
      executor->spin_some();
    } catch (const Error& error) {
      message = error.what();
    }
    executor->cancel();
  });
  executor->add_node(node);
  executor->spin();
  EXPECT_THAT(message, ::testing::HasSubstr(
                           "spinning already; in a callback, make it a coroutine and co_await"));
}

TEST_P(ConformanceSpin, SpinOnceRunsOneCallbackAndWaitsForItNoLongerThanAsked) {
  const auto executor = make(Clock::steady());
  const auto node = make_node(Clock::steady());
  int ran = 0;
  const auto a = node->create_guard_condition("a", [&] { ++ran; });
  const auto b = node->create_guard_condition("b", [&] { ++ran; });
  executor->add_node(node);
  executor->spin_once(1ms);
  EXPECT_EQ(ran, 0);
  a->trigger();
  b->trigger();
  executor->spin_once(0ns);
  EXPECT_EQ(ran, 1);
  executor->spin_once(0ns);
  EXPECT_EQ(ran, 2);
  std::thread later([&] { a->trigger(); });
  executor->spin_once();
  later.join();
  EXPECT_EQ(ran, 3);
  // A timer ends the wait too.
  const auto timer = is_frozen() ? nullptr : node->create_timer("timer", 2ms, [&] { ++ran; });
  if (timer == nullptr) return;
  executor->spin_once(10s);
  EXPECT_EQ(ran, 4);
}

// #471, #2462: what arrives during the call belongs to the next one.
TEST_P(ConformanceSpin, SpinSomeRunsOnlyWhatWasReadyAtTheCall) {
  ManualClock clock{TimePoint{}, virtual_cpus()};
  const auto executor = make(clock);
  const auto node = make_node(clock);
  int ran = 0;
  const auto publisher = node->create_publisher<Number>("topic", 5);
  const auto subscription = node->create_subscription<Number>("topic", 5, [&](const Number&) {
    ++ran;
    publisher->publish(Number{});  // always another
  });
  executor->add_node(node);
  publisher->publish(Number{});
  for (int call = 1; call <= 3; ++call) {
    executor->spin_some();
    EXPECT_EQ(ran, call);
  }
}

TEST_P(ConformanceSpin, SpinSomeAndSpinAllBeginNothingAfterTheirTime) {
  ManualClock clock{TimePoint{}, virtual_cpus()};
  const auto executor = make(clock);
  const auto node = make_node(clock);
  int ran = 0;
  std::vector<std::shared_ptr<GuardCondition>> guards;
  for (int i = 0; i < 4; ++i) {
    guards.push_back(node->create_guard_condition("guard_" + std::to_string(i),
                                                  [&] { clock.work(10ms), ++ran; }));
  }
  executor->add_node(node);
  for (const auto& guard : guards) guard->trigger();
  executor->spin_some(15ms);
  EXPECT_EQ(ran, 2);
  executor->spin_all(5ms);
  EXPECT_EQ(ran, 3);
  executor->spin_all();
  EXPECT_EQ(ran, 4);
}

TEST_P(ConformanceSpin, SpinAllGoesOnUntilNothingIsReady) {
  ManualClock clock{TimePoint{}, virtual_cpus()};
  const auto executor = make(clock);
  const auto node = make_node(clock);
  int left = 10;
  const auto publisher = node->create_publisher<Number>("topic", 5);
  const auto subscription = node->create_subscription<Number>("topic", 5, [&](const Number&) {
    if (--left > 0) publisher->publish(Number{});
  });
  executor->add_node(node);
  publisher->publish(Number{});
  executor->spin_all();
  EXPECT_EQ(left, 0);
}

// #1916: a future that another thread completes did not wake the executor.
TEST_P(ConformanceSpin, AFutureWakesFromAnyThread) {
  const auto executor = make(Clock::steady());
  const auto node = make_node(Clock::steady());
  executor->add_node(node);
  Promise<int> promise;
  std::thread other([&] {
    EXPECT_TRUE(eventually([&] { return executor->is_spinning(); }));
    promise.set_value(7);
  });
  EXPECT_EQ(executor->spin_until_future_complete(promise.get_future()), FutureReturnCode::SUCCESS);
  other.join();
  EXPECT_EQ(promise.get_future().get(), 7);
  EXPECT_EQ(executor->spin_until_future_complete(Promise<int>().get_future(), 1ms),
            FutureReturnCode::TIMEOUT);
  executor->cancel();
  EXPECT_EQ(executor->spin_until_future_complete(Promise<int>().get_future()),
            FutureReturnCode::INTERRUPTED);
}

// A future knew one waiter: a second one, and its end, left the first one to sleep to its time-out.
TEST_P(ConformanceSpin, AFutureWakesEverySpinThatWaitsForIt) {
  const auto executor = make(Clock::steady()), other = make(Clock::steady());
  const auto inner = executors().make("events", {});
  const auto node = make_node(Clock::steady());
  Promise<int> promise;
  const auto future = promise.get_future();
  std::atomic<bool> has_nested{false};
  const auto guard = node->create_guard_condition("guard", [&] {
    EXPECT_EQ(inner->spin_until_future_complete(future, 1ms), FutureReturnCode::TIMEOUT);
    has_nested.store(true);
  });
  executor->add_node(node);
  guard->trigger();
  std::atomic<int> returned{0};
  const auto wait_in = [&](Executor& spun) {
    EXPECT_EQ(spun.spin_until_future_complete(future), FutureReturnCode::SUCCESS);
    ++returned;
  };
  std::thread first(wait_in, std::ref(*executor));
  EXPECT_TRUE(eventually([&] { return has_nested.load(); }));
  std::thread second(wait_in, std::ref(*other));
  EXPECT_TRUE(eventually([&] { return other->is_spinning(); }));
  std::this_thread::sleep_for(2ms);  // likely both sleep
  promise.set_value(7);
  EXPECT_TRUE(eventually([&] { return returned == 2; }));
  executor->cancel();
  other->cancel();
  first.join();
  second.join();
}

// `isolated`: the exception of a callback left the executor among those that the future wakes.
TEST_P(ConformanceSpin, AFutureForgetsASpinThatAnExceptionHasEnded) {
  Promise<int> promise;
  {
    const auto executor = make(Clock::steady());
    const auto node = make_node(Clock::steady());
    const auto bad = node->create_guard_condition("bad", [] { throw std::runtime_error("mine"); });
    executor->add_node(node);
    bad->trigger();
    EXPECT_THROW(executor->spin_until_future_complete(promise.get_future()), std::runtime_error);
  }
  promise.set_value(7);  // the address sanitizer would report a use of the executor
}

// With a limit that had passed it slept all the same, 70 us, until the kernel's timer said so.
TEST_P(ConformanceSpin, DoesNotSleepWhenItsTimeHasPassed) {
  const auto executor = make(Clock::steady());
  const auto node = make_node(Clock::steady());
  const auto guard = node->create_guard_condition("guard", [] {});
  executor->add_node(node);
  const auto future = Promise<int>().get_future();
  executor->spin_once(0ns);
  const auto sleeps = [] {
    rusage usage{};
    getrusage(RUSAGE_THREAD, &usage);
    return usage.ru_nvcsw;
  };
  constexpr int kCalls = 200;
  const auto before = sleeps();
  for (int i = 0; i < kCalls; ++i) {
    executor->spin_once(0ns);
    EXPECT_EQ(executor->spin_until_future_complete(future, 0ns), FutureReturnCode::TIMEOUT);
  }
  EXPECT_LT(sleeps() - before, kCalls / 2);
}

// ---- Exceptions ----

TEST_P(ConformanceSpin, AnExceptionLeavesSpinAndTheExecutorCanSpinAgain) {
  const auto executor = make(Clock::steady());
  const auto node = make_node(Clock::steady());
  std::atomic<int> ran{0};
  const auto bad = node->create_guard_condition("bad", [] { throw std::runtime_error("mine"); });
  const auto good = node->create_guard_condition("good", [&] { ++ran; });
  executor->add_node(node);
  {
    SpinThread spin(*executor);
    bad->trigger();
    spin.join();
    ASSERT_TRUE(spin.exception);
    EXPECT_THROW(std::rethrow_exception(spin.exception), std::runtime_error);
  }
  bad->trigger();
  EXPECT_THROW(executor->spin_some(), std::runtime_error);
  good->trigger();
  executor->spin_some();
  executor->spin_some();
  EXPECT_EQ(ran, 1);
}

// #2017, #2382: one throwing callback ended the process.
TEST_P(ConformanceSpin, AHandlerGetsExceptionsAndTheOthersGoOn) {
  const auto executor = make(Clock::steady());
  const auto node = make_node(Clock::steady());
  std::atomic<int> handled{0}, ran{0};
  const auto bad = node->create_guard_condition("bad", [] { throw std::runtime_error("mine"); });
  const auto good = node->create_guard_condition("good", [&] { ++ran; });
  executor->add_node(node);
  std::thread spin([&] {
    executor->spin([&](const FailedCallback& failed) {
      EXPECT_EQ(failed.node, node->fully_qualified_name());
      EXPECT_EQ(failed.callback, "bad");
      EXPECT_THROW(std::rethrow_exception(failed.exception), std::runtime_error);
      ++handled;
      return true;
    });
  });
  for (int i = 1; i <= 3; ++i) {
    bad->trigger();
    good->trigger();
    EXPECT_TRUE(eventually([&] { return handled == i && ran == i; }));
  }
  executor->cancel();
  spin.join();
}

TEST_P(ConformanceSpin, AHandlerMayLetAnExceptionEndTheSpin) {
  const auto executor = make(Clock::steady());
  const auto node = make_node(Clock::steady());
  const auto bad = node->create_guard_condition("bad", [] { throw std::runtime_error("mine"); });
  executor->add_node(node);
  bad->trigger();
  EXPECT_THROW(executor->spin([](const FailedCallback&) { return false; }), std::runtime_error);
}

// `isolated` gave threads to what was added after a spin that a cancel had ended before it began.
TEST_P(ConformanceSpin, NothingRunsAfterASpinThatWasCancelledBefore) {
  if (is_frozen()) GTEST_SKIP() << "static: nothing is added after the first spin";
  const auto executor = make(Clock::steady());
  executor->cancel();
  executor->spin();
  const auto node = make_node(Clock::steady());
  std::thread::id ran_on;
  const auto guard =
      node->create_guard_condition("guard", [&] { ran_on = std::this_thread::get_id(); });
  guard->trigger();
  executor->add_node(node);
  executor->spin_some();
  EXPECT_EQ(ran_on, std::this_thread::get_id());
}

// `isolated` was deaf after a spin that had been woken from its last sleep by a cancel or a future:
// neither cancel nor a removal woke the next one.
TEST_P(ConformanceSpin, ACancelEndsASpinAfterOneThatWasWoken) {
  const auto executor = make(Clock::steady());
  const auto node = make_node(Clock::steady());
  const auto guard = node->create_guard_condition("guard", [] {});
  executor->add_node(node);
  for (int round = 0; round < 20; ++round) {
    Promise<int> promise;
    std::thread other([&] {
      EXPECT_TRUE(eventually([&] { return executor->is_spinning(); }));
      std::this_thread::sleep_for(1ms);  // likely, it sleeps by now; if not, this finds less
      round % 2 == 0 ? executor->cancel() : promise.set_value(1);
    });
    (void)executor->spin_until_future_complete(promise.get_future());
    other.join();
    SpinThread spin(*executor);
    EXPECT_TRUE(eventually([&] { return executor->is_spinning(); }));
    executor->cancel();
    spin.join();
  }
}

TAKT_INSTANTIATE_CONFORMANCE(ConformanceSpin);

}  // namespace
}  // namespace takt::conformance
