// Several threads, or callbacks, that remove, drop and add the same things, in an order that the
// test decides. Run for every executor.
// SPDX-License-Identifier: Apache-2.0
#include <future>

#include "takt/executors/conformance_test.hpp"
#include "takt/executors/wait_set.hpp"

namespace takt::conformance {
namespace {

/// A guard condition that tells, once, what is done to it: the test may hold that up.
class Told final : public GuardCondition {
 public:
  using GuardCondition::GuardCondition;
  std::function<void()> on_detach, on_watch;
  void detach() noexcept override {
    if (const auto tell = std::exchange(on_detach, nullptr)) tell();
    GuardCondition::detach();
  }
  Watch watch() noexcept override {
    if (const auto tell = std::exchange(on_watch, nullptr)) tell();
    return {};
  }
};

class TellingNode final : public Node {
 public:
  using Node::Node;
  std::shared_ptr<Told> make(
      std::string name, std::function<void()> callback = [] {},
      std::shared_ptr<CallbackGroup> group = nullptr) {
    return adopt<Told>(std::make_shared<Told>(std::move(name), group_or_default(std::move(group)),
                                              clock().real(), std::move(callback)));
  }
};

/// Opens once, for all.
class Gate {
 public:
  void open() { promise_.set_value(); }
  void wait() const { future_.wait(); }

 private:
  std::promise<void> promise_;
  const std::shared_future<void> future_{promise_.get_future()};
};

bool is_owned(const Entity& entity) {
  const std::lock_guard lock(ownership_mutex());
  return entity.owner() != nullptr;
}
void wait_until_claimed(const Entity& entity) {
  while (is_owned(entity)) std::this_thread::yield();
}
/// Gives another thread time in which it could show that it does what it must not.
void give_time(const std::function<bool()>& has_done_it) {
  for (int i = 0; i < 1000 && !has_done_it(); ++i) std::this_thread::yield();
}

class Removal : public Conformance {
 protected:
  void SetUp() override {
    if (is_frozen()) GTEST_SKIP() << "a static executor lets nothing go";
  }
  std::shared_ptr<CallbackGroup> make_group(const char* name) {
    return node_->create_callback_group(name, CallbackGroupType::MutuallyExclusive, false);
  }

  const std::unique_ptr<Executor> executor_ = make(Clock::steady());
  const std::shared_ptr<TellingNode> node_ = std::make_shared<TellingNode>("node");
};

// ---- Removed by two threads, and added again by the one that is ready first ----

/// A thread that removes a node with two groups, and is held up when the second has gone as far as
/// its callbacks are concerned, but has not been detached.
class HeldUp : public Removal {
 protected:
  HeldUp() {
    first_->on_detach = [this] {
      is_there_.open();
      may_go_on_.wait();
    };
  }
  void begin() {
    executor_->add_node(node_);
    executor_->spin_some();
    remover_ = std::thread([this] { executor_->remove_node(node_); });
    is_there_.wait();
  }
  void end() {
    may_go_on_.open();
    remover_.join();
  }

  Gate is_there_, may_go_on_;
  int ran_ = 0;
  const std::shared_ptr<Told> first_ = node_->make("first");
  const std::shared_ptr<CallbackGroup> group_ =
      node_->create_callback_group("group", CallbackGroupType::MutuallyExclusive);
  const std::shared_ptr<Told> second_ = node_->make(
      "second", [this] { ++ran_; }, group_);
  std::thread remover_;
};

TEST_P(HeldUp, ARemoverLeavesAloneWhatAnotherExecutorHasMeanwhile) {
  const auto other = make(Clock::steady());
  begin();
  executor_->remove_callback_group(group_, node_);
  other->add_callback_group(group_, node_);
  other->spin_some();
  end();
  second_->trigger();
  other->spin_some();
  EXPECT_EQ(ran_, 1);
}

TEST_P(HeldUp, ARemoverLeavesAloneWhatItsExecutorHasAgain) {
  begin();
  executor_->remove_callback_group(group_, node_);
  executor_->add_callback_group(group_, node_);
  end();
  second_->trigger();
  executor_->spin_some();
  EXPECT_EQ(ran_, 1);
  executor_->remove_callback_group(group_, node_);  // it is its executor's, still
}

TEST_P(HeldUp, ARemoverLeavesAloneWhatAWaitSetHasMeanwhile) {
  begin();
  executor_->remove_callback_group(group_, node_);
  WaitSet set;
  set.add(second_);
  end();
  second_->trigger();
  EXPECT_EQ(set.wait(30s).size(), 1u);
}

// A wait set, and not an executor, is slow to let the entity go.
TEST(WaitSetRemoval, IsOverForNobodyBeforeTheEntityHasBeenDetached) {
  const auto node = std::make_shared<TellingNode>("node");
  Gate is_there, may_go_on;
  const auto guard = node->make("guard");
  guard->on_detach = [&] {
    is_there.open();
    may_go_on.wait();
  };
  WaitSet first, second;
  first.add(guard);
  std::thread slow([&] { first.remove(guard); });
  is_there.wait();
  EXPECT_THROW(second.add(guard), Error);  // it is not over
  std::atomic<bool> is_added{false};
  std::thread fast([&] {
    first.remove(guard);
    second.add(guard);
    is_added = true;
  });
  give_time([&] { return is_added.load(); });
  may_go_on.open();
  slow.join();
  fast.join();
  EXPECT_TRUE(guard->is_attached());
}

INSTANTIATE_TEST_SUITE_P(Every, HeldUp,
                         testing::Combine(testing::ValuesIn(executor_names()),
                                          testing::Values(std::string())),
                         [](const auto& pair) { return std::get<0>(pair.param); });

}  // namespace
}  // namespace takt::conformance
