// A thread that is preempted while it wakes an executor delays nothing but what it has announced.
// SPDX-License-Identifier: Apache-2.0
#include <atomic>
#include <future>
#include <memory>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "takt/entities/guard_condition.hpp"
#include "takt/executors/executor.hpp"
#include "takt/nodes/node.hpp"
#include "takt/testing/eventually.hpp"
#include "takt/testing/wrapped_wait.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;

// A post of a thread that is to be preempted ends when the test lets it go.
thread_local bool is_preempted = false;
std::atomic<bool> is_asleep, is_posting, may_go_on;

class HeldWait final : public WrappedWait {
 public:
  using WrappedWait::WrappedWait;
  bool wait(std::size_t worker, TimePoint deadline) noexcept override {
    is_asleep.store(true);
    const bool is_woken = WrappedWait::wait(worker, deadline);
    is_asleep.store(false);
    return is_woken;
  }
  void post() noexcept override {
    if (is_preempted) {
      is_posting.store(true);
      may_go_on.wait(false);
    }
    WrappedWait::post();
  }
};

class PreemptedPost : public testing::TestWithParam<const char*> {
 protected:
  PreemptedPost() {
    for (std::atomic<bool>* const each : {&is_asleep, &is_posting, &may_go_on}) each->store(false);
    executor_->add_node(node_);
  }
  ~PreemptedPost() override {
    may_go_on.store(true);
    may_go_on.notify_all();
    preempted_.join();
    executor_->cancel();
    spinning_.join();
  }
  // Announces until that needs a post, which does not come to an end.
  void preempt() {
    spinning_ = std::thread([this] { executor_->spin(); });
    preempted_ = std::thread([this] {
      is_preempted = true;
      while (!is_posting.load()) {
        if (is_asleep.load()) first_->trigger();
      }
    });
    ASSERT_TRUE(eventually([] { return is_posting.load(); }));
  }

  const std::shared_ptr<Executor> executor_ =
      executors().make(GetParam(), {.wait = wrapped_wait<HeldWait>("held")});
  const std::shared_ptr<Node> node_ = std::make_shared<Node>("node");
  const std::shared_ptr<GuardCondition> first_ = node_->create_guard_condition("first", [] {});
  std::atomic<int> ran_{0};
  std::shared_ptr<GuardCondition> second_;  // a removal waits for the thread that is preempted
  std::shared_ptr<Timer> timer_;
  std::thread spinning_, preempted_;
};

TEST_P(PreemptedPost, DelaysNoAnnouncementOfAnother) {
  second_ = node_->create_guard_condition("second", [this] { ++ran_; });
  preempt();
  second_->trigger();
  EXPECT_TRUE(eventually([&] { return ran_.load() != 0; }));
}

TEST_P(PreemptedPost, DelaysNoTimer) {
  timer_ = node_->create_timer("timer", 1ms, [this] { ++ran_; });
  preempt();
  const int before = ran_.load();
  EXPECT_TRUE(eventually([&] { return ran_.load() > before; }));
}

TEST_P(PreemptedPost, DelaysNoEndOfSpin) {
  preempt();
  executor_->cancel();
  spinning_.join();
  spinning_ = std::thread([] {});
}

INSTANTIATE_TEST_SUITE_P(Every, PreemptedPost,
                         testing::Values("events", "single_threaded", "static_single_threaded",
                                         "chain_aware"));

}  // namespace
}  // namespace takt
