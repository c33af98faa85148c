// Callbacks that are coroutines. Run for every executor under every scheduler. The numbers in the
// comments are those of the rclcpp issues whose defect is tested.
// SPDX-License-Identifier: Apache-2.0
#include <stdexcept>

#include "takt/executors/conformance/conformance.hpp"
#include "takt/nodes/lifecycle_node.hpp"

namespace takt::conformance {
namespace {

struct Double {
  struct Request {
    int value = 0;
  };
  struct Response {
    int value = 0;
  };
};
TAKT_MESSAGE(Double::Request, "test/srv/Double_Request", value);
TAKT_MESSAGE(Double::Response, "test/srv/Double_Response", value);

void twice(const Double::Request& request, Double::Response& response) {
  response.value = 2 * request.value;
}

/// Counts who is in a mutually exclusive group.
class Exclusive {
 public:
  class Inside {
   public:
    explicit Inside(Exclusive& of) : of_(of) {
      if (++of_.inside_ > 1) of_.violated = true;
      std::this_thread::yield();
    }
    ~Inside() { --of_.inside_; }

   private:
    Exclusive& of_;
  };
  std::atomic<bool> violated{false};

 private:
  std::atomic<int> inside_{0};
};

class ConformanceTask : public Conformance {
 protected:
  ManualClock clock_{TimePoint{}, virtual_cpus()};
  const std::unique_ptr<Executor> executor_ = make(clock_);
  const std::shared_ptr<Node> node_ = make_node(clock_);
  std::vector<std::string> trace_;
  void note(std::string what) { trace_.push_back(std::move(what)); }
};

// rclcpp #773, #312, rclpy #1211: a callback that calls a service of its own group and blocks until
// the response never returns.
TEST_P(ConformanceTask, AwaitsAServiceOfItsOwnExclusiveGroup) {
  const auto service = node_->create_service<Double>("twice", twice);
  const auto client = node_->create_client<Double>("twice");
  const auto timer = node_->create_timer("ask", 10ms, [&]() -> Task<> {
    const Double::Request request{21};
    note("asks");
    const auto answer = co_await client->call(request);
    note(answer ? std::to_string(answer->value) : "no answer");
  });
  executor_->add_node(node_);
  for (int i = 1; i <= 2; ++i) {
    clock_.advance(10ms);
    executor_->spin_all();
    EXPECT_THAT(trace_, ElementsAre("asks", "42")) << "round " << i;
    trace_.clear();
  }
}

TEST_P(ConformanceTask, AwaitsAServiceOfAnotherGroupAndExclusivityHolds) {
  const auto executor = make(Clock::steady());
  const auto node = make_node(Clock::steady());
  const auto other = node->create_callback_group("other", CallbackGroupType::MutuallyExclusive);
  Exclusive exclusive;
  std::atomic<int> answered{0};
  const auto service = node->create_service<Double>(
      "twice",
      [&](const Double::Request& request, Double::Response& response) -> Task<> {
        co_await sleep_for(10us);
        response.value = 2 * request.value;
      },
      other);
  const auto client = node->create_client<Double>("twice", {}, other);
  const auto same = node->create_client<Double>("twice");
  const auto ask = [&]() -> Task<> {
    for (const auto& of : {client, same}) {
      const Double::Request request{1};
      { const Exclusive::Inside inside(exclusive); }
      const auto answer = co_await of->call(request);
      const Exclusive::Inside inside(exclusive);
      if (answer && answer->value == 2) ++answered;
    }
  };
  const auto first = node->create_timer("first", 300us, ask);
  const auto second = node->create_timer("second", 300us, ask);
  executor->add_node(node);
  const SpinThread spin(*executor);
  EXPECT_TRUE(eventually([&] { return answered >= 100; })) << answered;
  EXPECT_FALSE(exclusive.violated);
}

TEST_P(ConformanceTask, SleepsWhileOthersOfItsGroupRun) {
  const auto sleeper = node_->create_timer("sleeper", 10ms, [&]() -> Task<> {
    note("sleeps");
    co_await sleep_for(4ms);
    note("awake");
  });
  const auto ticker = node_->create_timer("ticker", 12ms, [&] { note("tick"); });
  executor_->add_node(node_);
  for (int i = 0; i < 16; ++i) {
    clock_.advance(1ms);
    executor_->spin_all();
  }
  EXPECT_THAT(trace_, ElementsAre("sleeps", "tick", "awake"));
}

TEST_P(ConformanceTask, BetweenBatchesOthersOfItsGroupRun) {
  if (!takes_turns()) GTEST_SKIP() << kNoTurns;
  const auto publisher = node_->create_publisher<Number>("numbers", 5);
  const auto subscription = node_->create_subscription<Number>(
      "numbers", 5, [&](const Number& number) { note("message " + std::to_string(number.value)); });
  const auto worker = node_->create_timer("worker", 10ms, [&]() -> Task<> {
    for (int i = 1; i <= 2; ++i) {
      note("batch " + std::to_string(i));
      publisher->publish(Number{i});
      co_await batch();
    }
    note("end");
  });
  executor_->add_node(node_);
  clock_.advance(10ms);
  executor_->spin_all();
  EXPECT_THAT(trace_, ElementsAre("batch 1", "message 1", "batch 2", "message 2", "end"));
}

TEST_P(ConformanceTask, SpinSomeRunsOneBatch) {
  int batches = 0;
  const auto worker = node_->create_timer("worker", 10ms, [&]() -> Task<> {
    for (int i = 0; i < 3; ++i) {
      ++batches;
      co_await batch();
    }
  });
  executor_->add_node(node_);
  clock_.advance(10ms);
  for (int i = 1; i <= 3; ++i) {
    executor_->spin_some();
    EXPECT_EQ(batches, i);
  }
  executor_->spin_all();
  EXPECT_EQ(batches, 3);
}

// On several workers, the next batch may begin before the last one has returned.
TEST_P(ConformanceTask, BatchesOfOneTaskAreOneAfterAnother) {
  const auto executor = make(Clock::steady());
  const auto node = make_node(Clock::steady());
  const auto reentrant = node->create_callback_group("several", CallbackGroupType::Reentrant);
  Exclusive exclusive;
  std::atomic<int> ended{0};
  const auto timer = node->create_timer(
      "worker", 100us,
      [&]() -> Task<> {
        for (int i = 0; i < 100; ++i) {
          { const Exclusive::Inside inside(exclusive); }
          co_await batch();
        }
        ++ended;
      },
      reentrant);
  executor->add_node(node);
  const SpinThread spin(*executor);
  EXPECT_TRUE(eventually([&] { return ended >= 10; })) << ended;
  EXPECT_FALSE(exclusive.violated);
}

TEST_P(ConformanceTask, AwaitsMessagesThatAreThereOrCome) {
  const auto receiver = node_->create_receiver<Number>("numbers", 5);
  const auto publisher = node_->create_publisher<Number>("numbers", 5);
  const auto reader = node_->create_timer("reader", 10ms, [&]() -> Task<> {
    for (int i = 0; i < 3; ++i) {
      const auto message = co_await receiver->receive();
      note(std::to_string(message->value));
    }
    note("end");
  });
  executor_->add_node(node_);
  publisher->publish(Number{1});
  clock_.advance(10ms);
  executor_->spin_all();
  EXPECT_THAT(trace_, ElementsAre("1"));
  publisher->publish(Number{2});
  executor_->spin_all();
  EXPECT_THAT(trace_, ElementsAre("1", "2"));
  publisher->publish(Number{3});
  publisher->publish(Number{4});  // for the next one
  executor_->spin_all();
  EXPECT_THAT(trace_, ElementsAre("1", "2", "3", "end"));
}

TEST_P(ConformanceTask, AMessageStaysUntilItsCallbackHasEndedAndTheNextOneWaits) {
  const auto publisher = node_->create_publisher<Number>("numbers", 5, {.loans = 8});
  const auto subscription =
      node_->create_subscription<Number>("numbers", 5, [&](const Number& number) -> Task<> {
        note("start " + std::to_string(number.value));
        co_await sleep_for(1ms);
        note("end " + std::to_string(number.value));
      });
  executor_->add_node(node_);
  for (int value = 1; value <= 2; ++value) publisher->publish(Number{value});
  for (int i = 0; i < 4; ++i) {
    executor_->spin_all();
    clock_.advance(1ms);
  }
  EXPECT_THAT(trace_, ElementsAre("start 1", "end 1", "start 2", "end 2"));
}

TEST_P(ConformanceTask, TimerReleasesDuringTheTaskAreMissed) {
  int begun = 0;
  const auto timer = node_->create_timer("slow", 10ms, [&]() -> Task<> {
    ++begun;
    co_await sleep_for(25ms);
  });
  executor_->add_node(node_);
  for (int i = 0; i < 50; ++i) {  // releases at 10, 20, 30, 40 and 50; the tasks end at 35 and 65
    clock_.advance(1ms);
    executor_->spin_all();
  }
  EXPECT_EQ(begun, 2);
  EXPECT_EQ(timer->missed(), 3u);
}

TEST_P(ConformanceTask, ATaskAwaitsTasksAndTheirExceptions) {
  const auto fails = [](bool now) -> Task<int> {
    co_await sleep_for(1ms);
    if (now) throw std::runtime_error("broken");
    co_return 5;
  };
  const auto timer = node_->create_timer("outer", 10ms, [&]() -> Task<> {
    note(std::to_string(co_await fails(false)));
    try {
      co_await fails(true);
    } catch (const std::runtime_error& error) {
      note(error.what());
    }
    co_await fails(true);
    note("never");
  });
  executor_->add_node(node_);
  clock_.advance(10ms);
  executor_->spin_all();
  clock_.advance(1ms);
  executor_->spin_all();
  clock_.advance(1ms);
  executor_->spin_all();
  EXPECT_THAT(trace_, ElementsAre("5", "broken"));
  clock_.advance(1ms);
  EXPECT_THROW(executor_->spin_all(), std::runtime_error);
  trace_.clear();
  clock_.advance(10ms);  // and it can begin again
  executor_->spin_all();
  clock_.advance(1ms);
  executor_->spin_all();
  EXPECT_THAT(trace_, ElementsAre("5"));
}

TEST_P(ConformanceTask, ACallWithoutAnAnswerEndsInTime) {
  const auto client = node_->create_client<Double>("nobody", {.timeout = 5ms});
  const auto timer = node_->create_timer("ask", 10ms, [&]() -> Task<> {
    const Double::Request request{1};
    note(co_await client->call(request) ? "answer" : "none");
  });
  executor_->add_node(node_);
  clock_.advance(10ms);
  executor_->spin_all();
  EXPECT_TRUE(trace_.empty());
  clock_.advance(5ms);
  executor_->spin_all();
  EXPECT_THAT(trace_, ElementsAre("none"));
}

TEST_P(ConformanceTask, WhatIsDroppedDoesNotGoOn) {
  if (is_frozen()) GTEST_SKIP() << "a static executor lets nothing go";
  struct Local {
    explicit Local(int& of) : count(++of) {}
    ~Local() { --count; }
    int& count;
  };
  int alive = 0;
  const auto client = node_->create_client<Double>("nobody");
  auto receiver = node_->create_receiver<Number>("numbers", 5);
  const auto publisher = node_->create_publisher<Number>("numbers", 5);
  auto caller = node_->create_timer("caller", 10ms, [&]() -> Task<> {
    const Local local(alive);
    const Double::Request request{1};
    co_await client->call(request);
    note("answered");
  });
  auto sleeper = node_->create_timer("sleeper", 10ms, [&]() -> Task<> {
    const Local local(alive);
    co_await sleep_for(1h);
    note("awake");
  });
  auto reader = node_->create_timer("reader", 10ms, [&]() -> Task<> {
    const Local local(alive);
    co_await receiver->receive();
    note("received");
  });
  std::shared_ptr<Timer> itself;
  itself = node_->create_timer("itself", 10ms, [&]() -> Task<> {
    const Local local(alive);
    co_await sleep_for(1ms);
    itself.reset();
    note("goes on to its next await");
    co_await sleep_for(1ms);
    note("and no further");
  });
  executor_->add_node(node_);
  clock_.advance(10ms);
  executor_->spin_all();
  EXPECT_EQ(alive, 4);
  EXPECT_EQ(client->calls_in_flight(), 1u);
  reader.reset();
  caller.reset();
  sleeper.reset();
  EXPECT_EQ(alive, 1);
  EXPECT_EQ(client->calls_in_flight(), 0u);
  for (int i = 0; i < 3; ++i) {
    clock_.advance(1ms);
    publisher->publish(Number{1});
    executor_->spin_all();
  }
  EXPECT_EQ(alive, 0);
  EXPECT_THAT(trace_, ElementsAre("goes on to its next await"));
}

TEST_P(ConformanceTask, WorkWhoseTimerIsDroppedEndsWithItsBatch) {
  if (is_frozen()) GTEST_SKIP() << "a static executor lets nothing go";
  std::shared_ptr<Timer> worker;
  int batches = 0;
  worker = node_->create_timer("worker", 10ms, [&]() -> Task<> {
    for (;;) {
      if (++batches == 3) worker.reset();
      co_await batch();
    }
  });
  executor_->add_node(node_);
  clock_.advance(10ms);
  executor_->spin_all();
  EXPECT_EQ(batches, 3);
}

TEST_P(ConformanceTask, ThoseOfALifecycleNodeRestWhileItIsNotActive) {
  const auto managed = std::make_shared<LifecycleNode>("managed", NodeOptions{.clock = &clock_});
  const auto publisher = node_->create_publisher<Number>("numbers", 5);
  const auto timer = managed->create_timer("steps", 10ms, [&]() -> Task<> {
    note("begins");
    co_await sleep_for(5ms);
    note("goes on");
  });
  const auto subscription =
      managed->create_subscription<Number>("numbers", 5, [&](const Number& number) -> Task<> {
        co_await sleep_for(1ms);
        note(std::to_string(number.value));
      });
  executor_->add_node(node_);
  executor_->add_node(managed);
  const auto run = [&](int milliseconds) {
    for (int i = 0; i < milliseconds; ++i) {
      clock_.advance(1ms);
      executor_->spin_all();
    }
  };
  managed->configure();
  managed->activate();
  run(12);
  EXPECT_THAT(trace_, ElementsAre("begins"));
  managed->deactivate();
  publisher->publish(Number{7});
  run(50);
  EXPECT_THAT(trace_, ElementsAre("begins"));
  managed->activate();
  run(5);
  EXPECT_THAT(trace_, UnorderedElementsAre("begins", "goes on", "7"));
}

TEST_P(ConformanceTask, TheSteadyStateAllocatesNothing) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
  const auto executor = make(Clock::steady());
  const auto node = make_node(Clock::steady());
  const auto service = node->create_service<Double>(
      "twice", [](const Double::Request& request, Double::Response& response) -> Task<> {
        co_await sleep_for(10us);
        response.value = 2 * request.value;
      });
  const auto client = node->create_client<Double>("twice", {.timeout = 10s});
  const auto receiver = node->create_receiver<Number>("numbers", 5);
  const auto publisher = node->create_publisher<Number>("numbers", 5, {.loans = 8});
  std::atomic<int> rounds{0};
  const auto timer = node->create_timer("ask", 100us, [&]() -> Task<> {
    const Double::Request request{1};
    co_await client->call(request);
    auto loan = publisher->borrow_loaned_message();
    publisher->publish(std::move(loan));
    co_await receiver->receive();
    co_await batch();
    co_await sleep_for(10us);
    ++rounds;
  });
  executor->add_node(node);
  {
    const SpinThread spin(*executor);
    EXPECT_TRUE(eventually([&] { return rounds >= 20; }));
  }
  for (const ThreadStatistics& thread : executor->thread_statistics()) {
    EXPECT_EQ(thread.counters.allocations, 0u) << thread.asked.name;
  }
}

// The coroutine waited for ever, and its timer or service was dead.
TEST_P(ConformanceTask, AReceiverThatIsDroppedEndsTheWait) {
  if (is_frozen()) GTEST_SKIP() << "a static executor lets nothing go";
  auto receiver = node_->create_receiver<Number>("numbers", 5);
  Receiver<Number>* const as_long_as_it_lives = receiver.get();
  const auto group = node_->create_callback_group("other", CallbackGroupType::MutuallyExclusive);
  const auto timer = node_->create_timer("timer", 10ms, [&]() -> Task<> {
    if (receiver == nullptr) co_return note("runs again");
    const auto message = co_await as_long_as_it_lives->receive();
    note(message ? "message" : "none");
  });
  const auto second = node_->create_timer(
      "second", 10ms,
      [&]() -> Task<> {
        if (receiver == nullptr) co_return;
        const auto message = co_await as_long_as_it_lives->receive();
        note(message ? "message" : "none");
      },
      group);
  executor_->add_node(node_);
  clock_.advance(10ms);
  executor_->spin_all();
  receiver.reset();
  executor_->spin_all();
  EXPECT_THAT(trace_, ElementsAre("none", "none"));
  clock_.advance(10ms);
  executor_->spin_all();
  EXPECT_THAT(trace_, ElementsAre("none", "none", "runs again"));
}

Task<std::uintptr_t> where_it_runs() {
  co_return reinterpret_cast<std::uintptr_t>(__builtin_frame_address(0));
}

// Each task that ended at once went on with the one that awaited it on top of its own frame, where
// the compiler made no tail calls: a loop of them overflowed the stack.
TEST_P(ConformanceTask, ALoopOfTasksThatEndAtOnceNeedsNoMoreStack) {
  std::uintptr_t lowest = UINTPTR_MAX, highest = 0;
  const auto timer = node_->create_timer("timer", 10ms, [&]() -> Task<> {
    for (int i = 0; i < 100'000; ++i) {
      const std::uintptr_t frame = co_await where_it_runs();
      lowest = std::min(lowest, frame);
      highest = std::max(highest, frame);
    }
  });
  executor_->add_node(node_);
  clock_.advance(10ms);
  executor_->spin_all();
  EXPECT_LT(highest - lowest, 10'000u);
}

TAKT_INSTANTIATE_CONFORMANCE(ConformanceTask);

}  // namespace
}  // namespace takt::conformance
