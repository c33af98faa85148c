// A thread of a pool that ends lets go of what its callbacks have kept in thread-local variables.
// SPDX-License-Identifier: Apache-2.0
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "takt/entities/guard_condition.hpp"
#include "takt/executors/executor.hpp"
#include "takt/nodes/node.hpp"
#include "takt/testing/wrapped_wait.hpp"

namespace takt {
namespace {

// Of the worker that has called `spin`; each runs once.
std::function<void()> on_enter, on_leave;

class HookedWait final : public WrappedWait {
 public:
  using WrappedWait::WrappedWait;
  void enter(std::size_t worker, const ThreadAttributes& attributes) noexcept override {
    WrappedWait::enter(worker, attributes);
    if (worker == 0 && on_enter) std::exchange(on_enter, nullptr)();
  }
  void leave(std::size_t worker) noexcept override {
    WrappedWait::leave(worker);
    if (worker == 0 && on_leave) std::exchange(on_leave, nullptr)();
  }
};

/// Taken with the dispatch lock held, as all of reentrant groups are.
class HookedGuard final : public GuardCondition {
 public:
  using GuardCondition::GuardCondition;
  std::function<void()> on_take;
  bool take(Slot& slot) noexcept override {
    if (on_take) on_take();
    return GuardCondition::take(slot);
  }
};

class HookedNode final : public Node {
 public:
  using Node::Node;
  std::shared_ptr<HookedGuard> make(std::function<void()> callback) {
    return adopt<HookedGuard>(std::make_shared<HookedGuard>(
        "hooked", create_callback_group("reentrant", CallbackGroupType::Reentrant), clock().real(),
        std::move(callback)));
  }
};

/// What a thread keeps until it ends, and the other worker has left.
struct Kept {
  std::vector<std::shared_ptr<GuardCondition>> handles;
  std::shared_future<void> other_has_left;
  ~Kept() { other_has_left.wait(); }
};

// It removed these entities by itself, kept the dispatch lock on the way, and ended. Then the lock
// belonged to no thread, and the next two waited for each other.
TEST(EndedWorker, HasLeftTheDispatchLock) {
  constexpr int kHandles = 100;
  const auto executor = executors().make(
      "multi_threaded",
      {.wait = wrapped_wait<HookedWait>("hooked"), .threads = std::vector<ThreadAttributes>(2)});
  const auto node = std::make_shared<HookedNode>("node");
  auto to_keep = std::make_unique<Kept>();
  for (int i = 0; i < kHandles; ++i) {
    to_keep->handles.push_back(node->create_guard_condition("kept_" + std::to_string(i), [] {}));
  }
  std::promise<void> has_left, has_kept;
  to_keep->other_has_left = has_left.get_future().share();
  const std::shared_future<void> is_kept = has_kept.get_future().share();
  const std::thread::id first = std::this_thread::get_id();
  std::vector<std::shared_ptr<GuardCondition>> both;
  for (const char* name : {"one", "other"}) {
    both.push_back(node->create_guard_condition(
        name,
        [&] {
          if (std::this_thread::get_id() == first) return is_kept.wait();
          if (to_keep == nullptr) return;  // the one that was left over
          thread_local std::unique_ptr<Kept> kept;
          kept = std::move(to_keep);
          has_kept.set_value();
          executor->cancel();
        },
        node->create_callback_group(name, CallbackGroupType::MutuallyExclusive)));
  }
  executor->add_node(node);
  for (const auto& guard : both) guard->trigger();
  on_leave = [&] { has_left.set_value(); };
  executor->spin();

  // The second worker is inside when the first one comes.
  std::promise<void> is_inside;
  const auto slow = node->make([&] { executor->cancel(); });
  slow->on_take = [&] {
    is_inside.set_value();
    for (int i = 0; i < 1000; ++i) std::this_thread::yield();
  };
  on_enter = [&] { is_inside.get_future().wait(); };
  slow->trigger();
  executor->spin();
}

}  // namespace
}  // namespace takt
