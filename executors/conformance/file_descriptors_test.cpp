// File descriptors under every executor and scheduler, and under every executor and wait back end.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/conformance/conformance.hpp"
#include "takt/executors/wait_backends/wait_backend.hpp"
#include "takt/testing/pipe.hpp"

namespace takt::conformance {
namespace {

using Events = FileDescriptorEvents;

/// Executor, scheduler ("" for its own) and wait back end.
class ConformanceFileDescriptors
    : public ::testing::TestWithParam<std::tuple<std::string, std::string, std::string>> {
 protected:
  void SetUp() override {
    if (wait() == "auto") return;
    try {
      wait_backends().make(wait(), 1);
    } catch (const Error& error) {
      GTEST_SKIP() << error.what();
    }
  }
  const std::string& wait() const { return std::get<2>(GetParam()); }
  bool takes_turns() const {
    const std::string& scheduler = std::get<1>(GetParam());
    return scheduler.empty() || schedulers().traits(scheduler).takes_turns;
  }
  bool is_frozen() const { return traits_.frozen; }
  bool is_pool() const { return kind_.workers() > 1; }
  bool is_isolated() const { return traits_.isolates; }

  std::unique_ptr<Executor> make(Clock& clock = Clock::steady()) const {
    ExecutorOptions options;
    options.name = "conformance";
    options.scheduler = std::get<1>(GetParam());
    options.wait = wait();
    options.clock = &clock;
    if (is_pool()) options.threads.resize(wait() == "io_uring" ? 1 : kind_.workers());
    return kind_.make(options);
  }

  const ExecutorKind kind_{std::get<0>(GetParam())};
  const ExecutorTraits& traits_ = kind_.traits;

  const std::shared_ptr<Node> node_ = std::make_shared<Node>("node");
  Pipe pipe_;
};

TEST_P(ConformanceFileDescriptors, APipeIsReadCompletelyAndInOrder) {
  constexpr int kLines = 2000;
  const auto executor = make();
  std::string received;
  std::atomic<std::size_t> size{0};
  std::atomic<int> empty_reads{0};
  const auto reader =
      node_->create_file_descriptor("pipe", pipe_.reader(), Events::readable, [&](Events events) {
        EXPECT_EQ(events, Events::readable);
        const std::string text = pipe_.receive(7);
        if (text.empty()) ++empty_reads;
        received += text;
        size = received.size();
      });
  executor->add_node(node_);
  SpinThread spin(*executor);
  std::string sent;
  for (int line = 0; line < kLines; ++line) {
    const std::string text = std::to_string(line) + "\n";
    pipe_.send(text);
    sent += text;
    if (line % 100 == 0) {  // now and then the executor falls asleep
      ASSERT_TRUE(eventually([&] { return size == sent.size(); })) << line;
    }
  }
  EXPECT_TRUE(eventually([&] { return size == sent.size(); }));
  spin.stop();
  EXPECT_EQ(received, sent);
  EXPECT_EQ(empty_reads, 0);
}

TEST_P(ConformanceFileDescriptors, WhatACallbackLeavesItIsCalledForAgain) {
  const auto executor = make();
  std::vector<std::string> received;
  const auto reader =
      node_->create_file_descriptor("pipe", pipe_.reader(), Events::readable,
                                    [&](Events) { received.push_back(pipe_.receive(1)); });
  executor->add_node(node_);
  pipe_.send("abcd");
  executor->spin_all();
  EXPECT_THAT(received, ElementsAre("a", "b", "c", "d"));
}

TEST_P(ConformanceFileDescriptors, AClosedWriterIsReportedOnce) {
  const auto executor = make();
  std::atomic<int> calls{0}, hang_ups{0}, rounds{0};
  const auto reader =
      node_->create_file_descriptor("pipe", pipe_.reader(), Events::readable, [&](Events events) {
        ++calls;
        pipe_.receive(2);
        if (contains(events, Events::hang_up)) {
          ++hang_ups;
        }
      });
  const auto guard = node_->create_guard_condition("guard", [&] { ++rounds; });
  executor->add_node(node_);
  SpinThread spin(*executor);
  pipe_.send("abcd");
  pipe_.close_writer();
  ASSERT_TRUE(eventually([&] { return hang_ups == 1; }));
  for (int round = 1; round <= 20; ++round) {
    guard->trigger();
    ASSERT_TRUE(eventually([&] { return rounds == round; }));
  }
  spin.stop();
  EXPECT_EQ(hang_ups, 1);
  EXPECT_EQ(calls, 3);
}

TEST_P(ConformanceFileDescriptors, TwoInOneExclusiveGroupNeverOverlap) {
  constexpr int kBytes = 300;
  const auto executor = make();
  Pipe other;
  std::atomic<int> inside{0}, most{0}, received{0};
  const auto reads = [&](Pipe& pipe) {
    return [&](Events) {
      most = std::max(most.load(), ++inside);
      received += static_cast<int>(pipe.receive(1).size());
      --inside;
    };
  };
  const auto a = node_->create_file_descriptor("a", pipe_.reader(), Events::readable, reads(pipe_));
  const auto b = node_->create_file_descriptor("b", other.reader(), Events::readable, reads(other));
  executor->add_node(node_);
  SpinThread spin(*executor);
  for (int i = 0; i < kBytes; ++i) {
    pipe_.send("x");
    other.send("x");
  }
  EXPECT_TRUE(eventually([&] { return received == 2 * kBytes; })) << received;
  EXPECT_EQ(most, 1);
}

TEST_P(ConformanceFileDescriptors, InAReentrantGroupNoneOverlapsWithItself) {
  const int bytes = stress_rounds() / 100;
  const auto executor = make();
  const auto group = node_->create_callback_group("parallel", CallbackGroupType::Reentrant);
  std::atomic<int> inside{0}, most{0}, received{0}, empty{0};
  const auto reader = node_->create_file_descriptor(
      "pipe", pipe_.reader(), Events::readable,
      [&](Events) {
        most = std::max(most.load(), ++inside);
        std::this_thread::yield();
        const auto size = static_cast<int>(pipe_.receive(1).size());
        if (size == 0) ++empty;
        received += size;
        --inside;
      },
      group);
  executor->add_node(node_);
  SpinThread spin(*executor);
  for (int i = 0; i < bytes; ++i) pipe_.send("x");
  EXPECT_TRUE(eventually([&] { return received == bytes; })) << received;
  EXPECT_EQ(most, 1);
  EXPECT_EQ(empty, 0);
}

TEST_P(ConformanceFileDescriptors, OneThatGoesIsNotServedAnyMoreWhateverIsPending) {
  const auto executor = make();
  Pipe other;
  std::atomic<bool> is_gone{false};
  std::atomic<int> calls{0}, late_calls{0}, received{0};
  auto leaves_all =
      node_->create_file_descriptor("goes", pipe_.reader(), Events::readable, [&](Events) {
        ++calls;
        if (is_gone) ++late_calls;
      });
  const auto stays = node_->create_file_descriptor(
      "stays", other.reader(), Events::readable,
      [&](Events) { received += static_cast<int>(other.receive(9).size()); });
  executor->add_node(node_);
  SpinThread spin(*executor);
  pipe_.send("abc");
  ASSERT_TRUE(eventually([&] { return calls > 10; }));  // level-triggered: again and again
  leaves_all.reset();
  is_gone = true;
  pipe_.send("abc");
  other.send("abc");
  EXPECT_TRUE(eventually([&] { return received == 3; }));
  EXPECT_EQ(late_calls, 0);
}

TEST_P(ConformanceFileDescriptors, ACallbackMayDropItsEntityAndCloseTheFile) {
  const auto executor = make();
  const int own = dup(pipe_.reader());
  std::atomic<int> calls{0};
  std::shared_ptr<FileDescriptor> reader;
  reader = node_->create_file_descriptor("pipe", own, Events::readable, [&](Events) {
    ++calls;
    reader.reset();
    close(own);
  });
  std::atomic<int> rounds{0};
  const auto guard = node_->create_guard_condition("guard", [&] { ++rounds; });
  executor->add_node(node_);
  SpinThread spin(*executor);
  pipe_.send("abc");
  ASSERT_TRUE(eventually([&] { return calls == 1; }));
  guard->trigger();
  ASSERT_TRUE(eventually([&] { return rounds == 1; }));
  EXPECT_EQ(calls, 1);
}

// Workers that always have something to run never sleep, so nothing notifies them.
TEST_P(ConformanceFileDescriptors, IsNotStarvedByCallbacksThatAreAlwaysReady) {
  const auto executor = make();
  std::atomic<int> received{0}, loops{0};
  const auto publisher = node_->create_publisher<Number>("topic", 2, {.loans = 8});
  const auto subscription = node_->create_subscription<Number>("topic", 2, [&](const Number&) {
    ++loops;
    publisher->publish(publisher->borrow_loaned_message());
  });
  const auto group = node_->create_callback_group("own", CallbackGroupType::MutuallyExclusive);
  const auto reader = node_->create_file_descriptor(
      "pipe", pipe_.reader(), Events::readable,
      [&](Events) { received += static_cast<int>(pipe_.receive(9).size()); }, group);
  executor->add_node(node_);
  publisher->publish(publisher->borrow_loaned_message());
  SpinThread spin(*executor);
  for (int round = 1; round <= 20; ++round) {
    const int before = loops;
    ASSERT_TRUE(eventually([&] { return loops > before; }));
    pipe_.send("x");
    ASSERT_TRUE(eventually([&] { return received == round; })) << round;
  }
}

TEST_P(ConformanceFileDescriptors, EveryWayOfSpinningServesThem) {
  const auto executor = make();
  int calls = 0;
  const auto reader =
      node_->create_file_descriptor("pipe", pipe_.reader(), Events::readable, [&](Events) {
        ++calls;
        pipe_.receive(9);
      });
  executor->add_node(node_);
  executor->spin_some();
  EXPECT_EQ(calls, 0);
  pipe_.send("abc");
  executor->spin_some();
  EXPECT_EQ(calls, 1);
  pipe_.send("abc");
  executor->spin_once(0ns);
  EXPECT_EQ(calls, 2);
  executor->spin_once(1ms);
  EXPECT_EQ(calls, 2);
  pipe_.send("abc");
  executor->spin_all();
  EXPECT_EQ(calls, 3);
  std::thread later([&] { pipe_.send("abc"); });
  executor->spin_once();  // it sleeps or not, and is notified
  later.join();
  EXPECT_EQ(calls, 4);
  std::thread another([&] { executor->spin_once(); });  // on a thread of its own
  pipe_.send("abc");
  another.join();
  EXPECT_EQ(calls, 5);
}

TEST_P(ConformanceFileDescriptors, TheyComeAndGoWhileItSpins) {
  if (is_frozen()) GTEST_SKIP() << "static: nothing is added after the first spin";
  const auto executor = make();
  const auto first =
      node_->create_file_descriptor("first", pipe_.reader(), Events::readable, [](Events) {});
  executor->add_node(node_);
  SpinThread spin(*executor);
  ASSERT_TRUE(eventually([&] { return executor->is_spinning(); }));
  for (int round = 0; round < stress_rounds() / 500; ++round) {
    Pipe pipe;
    std::atomic<int> received{0};
    pipe.send("ab");  // before it is added: it waits
    const auto reader = node_->create_file_descriptor(
        "guest", pipe.reader(), Events::readable,
        [&](Events) { received += static_cast<int>(pipe.receive(9).size()); });
    ASSERT_TRUE(eventually([&] { return received == 2; })) << round;
    pipe.send("c");
    if (round % 2 == 0) {
      ASSERT_TRUE(eventually([&] { return received == 3; })) << round;
    }
  }
}

TEST_P(ConformanceFileDescriptors, TwoCanWatchOneDescriptor) {
  if (!takes_turns()) GTEST_SKIP() << kNoTurns;
  const auto executor = make();
  std::atomic<int> a_calls{0}, b_calls{0};
  std::atomic<bool> is_read{false};
  const auto reads_when_both_were_notified = [&](std::atomic<int>& calls) {
    return [&](Events) {
      ++calls;
      if (a_calls > 0 && b_calls > 0) pipe_.receive(9), is_read = true;
    };
  };
  auto a = node_->create_file_descriptor("a", pipe_.reader(), Events::readable,
                                         reads_when_both_were_notified(a_calls));
  const auto b = node_->create_file_descriptor("b", pipe_.reader(), Events::readable,
                                               reads_when_both_were_notified(b_calls));
  executor->add_node(node_);
  SpinThread spin(*executor);
  pipe_.send("x");
  EXPECT_TRUE(eventually([&] { return is_read.load(); }));
  if (is_frozen()) return;
  a.reset();
  is_read = false;
  pipe_.send("x");
  EXPECT_TRUE(eventually([&] { return is_read.load(); }));
}

TEST_P(ConformanceFileDescriptors, TimersAndWakeUpsComeInTheSameWait) {
  const auto executor = make();
  std::atomic<int> ticks{0}, triggers{0}, received{0};
  const auto reader = node_->create_file_descriptor(
      "pipe", pipe_.reader(), Events::readable,
      [&](Events) { received += static_cast<int>(pipe_.receive(9).size()); });
  const auto timer = node_->create_timer("timer", 1ms, [&] { ++ticks; });
  const auto guard = node_->create_guard_condition("guard", [&] { ++triggers; });
  executor->add_node(node_);
  SpinThread spin(*executor);
  for (int round = 1; round <= 20; ++round) {
    const int before = ticks;
    guard->trigger();
    pipe_.send("x");
    ASSERT_TRUE(eventually([&] {
      return triggers == round && received == round && ticks > before;
    })) << round
        << " " << triggers << " " << received;
  }
}

TEST_P(ConformanceFileDescriptors, ServingThemAllocatesNothing) {
  if (!allocations_are_counted()) GTEST_SKIP() << "a sanitizer has taken malloc over";
  const auto executor = make();
  std::atomic<int> received{0};
  char buffer[8];
  const auto reader = node_->create_file_descriptor(
      "pipe", pipe_.reader(), Events::readable,
      [&](Events) { received += static_cast<int>(read(pipe_.reader(), buffer, sizeof buffer)); });
  executor->add_node(node_);
  SpinThread spin(*executor);
  for (int round = 1; round <= 30; ++round) {
    pipe_.send("x");
    ASSERT_TRUE(eventually([&] { return received == round; }));
  }
  spin.stop();
  for (const ThreadStatistics& thread : executor->thread_statistics()) {
    EXPECT_EQ(thread.counters.allocations, 0u) << thread.asked.name;
  }
}

// Under a manual clock a descriptor wakes nobody: it is asked whenever a worker looks.
TEST_P(ConformanceFileDescriptors, UnderAManualClockTheyAreAskedAtPollingPoints) {
  if (wait() != "auto") GTEST_SKIP() << "a manual clock has its own way to wait";
  ManualClock clock{TimePoint{}, virtual_cpus()};
  NodeOptions options;
  options.clock = &clock;
  const auto node = std::make_shared<Node>("manual", options);
  const auto executor = make(clock);
  std::vector<std::string> trace;
  const auto reader = node->create_file_descriptor(
      "pipe", pipe_.reader(), Events::readable, [&](Events) { trace.push_back(pipe_.receive(1)); });
  const auto timer = node->create_timer("timer", 10ms, [&] { trace.push_back("timer"); });
  executor->add_node(node);
  pipe_.send("ab");
  executor->spin_all();
  EXPECT_THAT(trace, ElementsAre("a", "b"));
  const ManualSpin spin(*executor, clock, is_isolated() ? 2 : kind_.workers());
  clock.advance(5ms);
  pipe_.send("c");
  clock.advance(1ms);  // nobody looks
  EXPECT_THAT(trace, ElementsAre("a", "b"));
  clock.advance(5ms);
  EXPECT_THAT(trace, UnorderedElementsAre("a", "b", "timer", "c"));
}

std::string name_of(
    const ::testing::TestParamInfo<std::tuple<std::string, std::string, std::string>>& info) {
  const auto& [executor, scheduler, wait] = info.param;
  return executor + "__" + (scheduler.empty() ? wait : scheduler);
}

INSTANTIATE_TEST_SUITE_P(Every, ConformanceFileDescriptors,
                         ::testing::Combine(::testing::ValuesIn(executor_names()),
                                            ::testing::ValuesIn(schedulers().names()),
                                            ::testing::Values("auto")),
                         name_of);

std::vector<std::string> wait_backends_that_serve_them() {
  std::vector<std::string> names = wait_backends().names();
  std::erase_if(names, [](const std::string& name) {
    return !wait_backends().traits(name).serves_file_descriptors;
  });
  return names;
}

INSTANTIATE_TEST_SUITE_P(EveryWaitBackend, ConformanceFileDescriptors,
                         ::testing::Combine(::testing::ValuesIn(executor_names()),
                                            ::testing::Values(""),
                                            ::testing::ValuesIn(wait_backends_that_serve_them())),
                         name_of);

}  // namespace
}  // namespace takt::conformance
