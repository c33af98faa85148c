// Several threads, or callbacks, that remove, drop and add the same things, in an order that the
// test decides. Run for every executor.
// SPDX-License-Identifier: Apache-2.0
#include <future>
#include <set>

#include <sys/eventfd.h>
#include <unistd.h>

#include "takt/executors/conformance/conformance.hpp"
#include "takt/executors/wait_set.hpp"

namespace takt::conformance {
namespace {

/// A guard condition with hooks, which run once: a test may block in them.
class HookedGuard final : public GuardCondition {
 public:
  using GuardCondition::GuardCondition;
  std::function<void()> on_detach, on_watch;
  int fd = -1;
  void detach() noexcept override {
    if (const auto hook = std::exchange(on_detach, nullptr)) hook();
    GuardCondition::detach();
  }
  Watch watch() noexcept override {
    if (const auto hook = std::exchange(on_watch, nullptr)) hook();
    return {.fd = fd, .events = 1, .listener = nullptr};
  }
};

class HookedNode final : public Node {
 public:
  using Node::Node;
  std::shared_ptr<HookedGuard> make(
      std::string name, std::function<void()> callback = [] {},
      std::shared_ptr<CallbackGroup> group = nullptr) {
    return adopt<HookedGuard>(std::make_shared<HookedGuard>(
        std::move(name), group_or_default(std::move(group)), clock().real(), std::move(callback)));
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

/// Its hooks run once. An executor configures it when it has begun to add, and holds its mutex.
class HookedScheduler : public Scheduler {
 public:
  void configure(std::span<const CallbackInfo>) override {
    if (const auto hook = std::exchange(on_configure, nullptr)) hook();
  }
  void push(ReadyCallback& callback) noexcept override {
    callback.next = std::exchange(first_, &callback);
  }
  ReadyCallback* pop() noexcept override {
    return first_ == nullptr ? nullptr : std::exchange(first_, first_->next);
  }
  ~HookedScheduler() override {
    if (const auto hook = std::exchange(on_destroy, nullptr)) hook();
  }
  static inline std::function<void()> on_configure, on_destroy;
  static const std::string& name() {
    static const std::string name = [] {
      schedulers().add("hooked", {"", make_scheduler<HookedScheduler>});
      return "hooked";
    }();
    return name;
  }

 private:
  ReadyCallback* first_ = nullptr;
};

bool is_owned(const Entity& entity) {
  const std::lock_guard lock(ownership_mutex());
  return entity.owner() != nullptr;
}
void wait_until_claimed(const Entity& entity) {
  EXPECT_TRUE(eventually([&] { return !is_owned(entity); }));
}
/// Gives another thread time in which it could show that it does what it must not.
void give_time(const std::function<bool()>& has_done_it) {
  for (int i = 0; i < 100 && !has_done_it(); ++i) std::this_thread::yield();
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
  const std::shared_ptr<HookedNode> node_ = std::make_shared<HookedNode>("node");
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
  const std::shared_ptr<HookedGuard> first_ = node_->make("first");
  const std::shared_ptr<CallbackGroup> group_ =
      node_->create_callback_group("group", CallbackGroupType::MutuallyExclusive);
  const std::shared_ptr<HookedGuard> second_ = node_->make(
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
  const auto node = std::make_shared<HookedNode>("node");
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

// ---- Callbacks that remove ----

/// So many executors that spin, each with a node with two callbacks of one group.
class Circle {
 public:
  explicit Circle(std::vector<Executor*> executors) : executors_(std::move(executors)) {
    all_are_inside_ = std::make_unique<std::latch>(static_cast<std::ptrdiff_t>(size()));
    for (std::size_t i = 0; i < size(); ++i) {
      nodes_.push_back(std::make_shared<HookedNode>("node_" + std::to_string(i)));
      idle_.push_back(nodes_[i]->make("idle", [this] { ++ran; }));
      busy_.push_back(nodes_[i]->make("busy", [this, i] {
        ++ran;
        all_are_inside_->arrive_and_wait();
        act(i);
        ++returned;
      }));
      entities_.push_back(nodes_[i]->find_entity("busy"));  // no handles
      executors_[i]->add_node(nodes_[i]);
    }
  }
  std::size_t size() const { return executors_.size(); }
  std::size_t after(std::size_t i) const { return (i + 1) % size(); }
  void remove_node(std::size_t i) { executors_[i]->remove_node(nodes_[i]); }
  void drop_busy(std::size_t i) { busy_[i].reset(); }
  void drop_idle(std::size_t i) { idle_[i].reset(); }

  /// Every busy callback calls `what` with its number when all of them are inside.
  void run(std::function<void(std::size_t)> what) {
    act = std::move(what);
    std::vector<std::unique_ptr<SpinThread>> spins;
    for (Executor* executor : std::set(executors_.begin(), executors_.end())) {
      spins.push_back(std::make_unique<SpinThread>(*executor));
    }
    for (const auto& entity : entities_) static_cast<HookedGuard&>(*entity).trigger();
    EXPECT_TRUE(eventually([&] { return returned == static_cast<int>(size()); }));
  }

  std::atomic<int> ran{0}, returned{0};
  std::function<void(std::size_t)> act;

 private:
  const std::vector<Executor*> executors_;
  std::unique_ptr<std::latch> all_are_inside_;
  std::vector<std::shared_ptr<HookedNode>> nodes_;
  std::vector<std::shared_ptr<HookedGuard>> idle_, busy_;
  std::vector<std::shared_ptr<Entity>> entities_;
};

// Each waited until the next one had returned.
TEST_P(Removal, CallbacksOfSeveralExecutorsMayRemoveEachOther) {
  for (const std::size_t count : {2u, 3u}) {
    std::vector<std::unique_ptr<Executor>> others;
    std::vector<Executor*> all;
    for (std::size_t i = 0; i < count; ++i) {
      others.push_back(make(Clock::steady()));
      all.push_back(others.back().get());
    }
    Circle circle(all);
    circle.run([&](std::size_t i) { circle.remove_node(circle.after(i)); });
    EXPECT_EQ(circle.ran, static_cast<int>(count));
  }
}

TEST_P(Removal, CallbacksOfOneExecutorMayRemoveEachOther) {
  if (!is_pool() && !is_isolated()) GTEST_SKIP() << "its callbacks do not run at the same time";
  Circle circle({executor_.get(), executor_.get()});
  circle.run([&](std::size_t i) {
    if (i == 0) {
      circle.remove_node(1);
    } else {
      circle.drop_busy(0);
    }
  });
  EXPECT_EQ(circle.ran, 2);
}

// Each waited until the other's only thread would take the removal over.
TEST_P(Removal, CallbacksOfTwoExecutorsMayRemoveWhatDoesNotRunThere) {
  const auto first = make(Clock::steady(), 1);
  const auto second = make(Clock::steady(), 1);
  Circle circle({first.get(), second.get()});
  circle.run([&](std::size_t i) { circle.drop_idle(circle.after(i)); });
  EXPECT_EQ(circle.ran, 2);
}

// The handle's owner waited for the executor that had the entity now, and not for the callback.
TEST_P(Removal, ADropWaitsForTheCallbackThatHasGivenItsNodeAway) {
  const auto other = make(Clock::steady());
  Gate is_inside, may_leave;
  std::atomic<bool> has_left{false}, has_dropped{false}, was_inside{false};
  auto guard = node_->make("guard", [&] {
    executor_->remove_node(node_);
    other->add_node(node_);
    is_inside.open();
    may_leave.wait();
    has_left = true;
  });
  executor_->add_node(node_);
  const SpinThread spin(*executor_);
  guard->trigger();
  is_inside.wait();
  std::thread dropper([&] {
    guard.reset();
    was_inside = !has_left;
    has_dropped = true;
  });
  give_time([&] { return has_dropped.load(); });
  may_leave.open();
  dropper.join();
  EXPECT_FALSE(was_inside);
}

// For `isolated` this is a thread that ends and begins again.
TEST_P(Removal, ACallbackMayRemoveItsOwnNodeAndAddItAgain) {
  std::atomic<int> ran{0};
  const auto guard = node_->make("guard", [&] {
    executor_->remove_node(node_);
    executor_->add_node(node_);
    ++ran;
  });
  executor_->add_node(node_);
  {
    const SpinThread spin(*executor_);
    for (int i = 1; i <= 20; ++i) {
      guard->trigger();
      ASSERT_TRUE(eventually([&] { return ran == i; }));
    }
  }
  guard->trigger();
  executor_->spin_some();  // no cancel of the spin that has ended is left
  EXPECT_EQ(ran, 21);
}

// The callback did not wait for the remover, and came to its worker again.
TEST_P(Removal, ACallbackThatDropsItselfWhileAnotherThreadRemovesItDoesNotRunAgain) {
  const auto executor = make(Clock::steady());
  Gate is_inside, is_removing, may_remove;
  std::atomic<int> ran{0};
  std::shared_ptr<HookedGuard> guard;
  guard = node_->make("guard", [&] {
    if (++ran > 1) return;
    is_inside.open();
    is_removing.wait();
    guard->trigger();
    guard.reset();
  });
  const int never_ready = eventfd(0, EFD_CLOEXEC);
  guard->fd = never_ready;
  executor->add_node(node_);
  SpinThread spin(*executor);
  guard->trigger();
  is_inside.wait();
  guard->on_watch = [&] {  // when the remover unwatches it, and holds the executor's mutex
    is_removing.open();
    may_remove.wait();
  };
  std::thread remover([&] { executor->remove_node(node_); });
  give_time([&] { return ran > 1; });
  may_remove.open();
  remover.join();
  spin.stop();
  close(never_ready);
  EXPECT_EQ(ran, 1);
}

// It lay in the inbox, which nobody looks into before the next spin.
TEST_P(Removal, WhatIsDroppedAtRestIsDestroyedThen) {
  const auto owned = std::make_shared<int>(1);
  auto guard = node_->make("guard", [owned] {});
  executor_->add_node(node_);
  executor_->spin_some();
  guard->trigger();
  guard.reset();
  EXPECT_EQ(owned.use_count(), 1);
}

TEST_P(Removal, KeepsTheSchedulerAndItsHistory) {
  const auto executor = make({.scheduler = HookedScheduler::name()});
  const auto stays = node_->make("stays");
  auto leaves = node_->make("leaves");
  executor->add_node(node_);
  executor->spin_some();
  bool is_new = false;
  HookedScheduler::on_configure = [&] { is_new = true; };
  leaves.reset();
  executor->spin_some();
  EXPECT_FALSE(is_new);
  const auto comes = node_->make("comes");
  executor->spin_some();
  EXPECT_TRUE(is_new);
}

// ---- What could not be added, and was dropped meanwhile: its record was freed in between ----

class Refusal : public Removal {
 protected:
  void SetUp() override {
    Removal::SetUp();
    if (is_isolated()) GTEST_SKIP() << "what it adds to does not spin yet";
  }
  /// Another thread drops the handle; true when it has got so far that it waits for the executor.
  void drop() {
    dropper_ = std::thread([this] { guard_.reset(); });
    wait_until_claimed(*entity_);
  }
  void expect_refusal(Executor& executor) {
    const SpinThread spin(executor);
    ASSERT_TRUE(eventually([&] { return executor.is_spinning(); }));
    EXPECT_THROW(executor.add_callback_group(group_, node_), Error);
    dropper_.join();
    executor.add_callback_group(group_, node_);
  }

  const std::shared_ptr<CallbackGroup> group_ = make_group("group");
  std::shared_ptr<HookedGuard> guard_ = node_->make(
      "guard", [] {}, group_);
  const std::shared_ptr<Entity> entity_ = node_->find_entity("guard");
  std::thread dropper_;
};

TEST_P(Refusal, ByItsSchedulerOfWhatIsDroppedMeanwhile) {
  const auto executor = make({.scheduler = HookedScheduler::name()});
  guard_->on_watch = [this] {
    HookedScheduler::on_configure = [this] {
      drop();
      throw Error("refused");
    };
  };
  expect_refusal(*executor);
}

TEST_P(Refusal, ByItsWaitBackEndOfWhatIsDroppedMeanwhile) {
  const auto executor = make({.wait = "futex"});
  guard_->fd = 0;
  guard_->on_watch = [this] { drop(); };
  expect_refusal(*executor);
}

TEST(WaitSetRefusal, OfWhatIsDroppedMeanwhile) {
  const auto node = std::make_shared<HookedNode>("node");
  auto guard = node->make("guard");
  const auto entity = node->find_entity("guard");
  std::thread dropper;
  guard->fd = 1 << 20;  // is none
  guard->on_watch = [&] {
    dropper = std::thread([&] { guard.reset(); });
    wait_until_claimed(*entity);
  };
  WaitSet set;
  EXPECT_THROW(set.add(entity), Error);
  dropper.join();
  EXPECT_FALSE(entity->is_attached());
  EXPECT_TRUE(set.wait(0ns).empty());
}

// A thread that began to wait for a removal when the executor expected none any more used its freed
// records.
TEST_P(Removal, AHandleIsDroppedWhileTheExecutorEnds) {
  if (is_isolated()) GTEST_SKIP() << "its children go as the others do";
  auto executor = make({.scheduler = HookedScheduler::name()});
  const auto other = make(Clock::steady());
  const auto stays = std::make_shared<HookedNode>("stays");
  const auto idle = stays->make("idle");
  auto guard = node_->make("guard", [&] { executor->remove_node(node_); });
  executor->add_node(stays);
  executor->add_node(node_);
  guard->trigger();
  executor->spin_some();
  other->add_node(node_);
  Gate is_dropping, may_go_on;
  guard->on_detach = [&] {
    is_dropping.open();
    may_go_on.wait();
  };
  std::thread dropper;
  HookedScheduler::on_destroy = [&] {  // with the record of what it has given away
    dropper = std::thread([&] { guard.reset(); });
    is_dropping.wait();
  };
  executor.reset();
  may_go_on.open();
  ASSERT_TRUE(dropper.joinable());
  dropper.join();
}

#define TAKT_EVERY_EXECUTOR(Suite)                                                           \
  INSTANTIATE_TEST_SUITE_P(                                                                  \
      Every, Suite,                                                                          \
      testing::Combine(testing::ValuesIn(executor_names()), testing::Values(std::string())), \
      [](const auto& pair) { return std::get<0>(pair.param); })
TAKT_EVERY_EXECUTOR(HeldUp);
TAKT_EVERY_EXECUTOR(Removal);
TAKT_EVERY_EXECUTOR(Refusal);

}  // namespace
}  // namespace takt::conformance
