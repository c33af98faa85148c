// How an executor runs its children: each on its thread, or all on the caller's.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <poll.h>

#include "takt/executors/isolated_executor.hpp"

namespace takt {

/// Lives as long as a spin, of any kind: there is only one at a time.
class IsolatedExecutor::Spin {
 public:
  /// `handler`: for children on threads of their own; nullptr: the children run on the caller.
  explicit Spin(IsolatedExecutor& executor, const ExceptionHandler* handler = nullptr)
      : executor_(executor) {
    const std::lock_guard lock(executor_.mutex_);
    if (executor_.spinning_.exchange(true)) {
      throw Error("executor '" + executor_.options_.name + "' is spinning already",
                  "in a callback, make it a coroutine and co_await what it waits for");
    }
    executor_.handler_ = handler;
  }
  ~Spin() {
    executor_.finish_removals();
    executor_.backend_->leave(0);
    executor_.cancelled_.store(false);
    executor_.spinning_.store(false);
  }
  Spin(const Spin&) = delete;
  Spin& operator=(const Spin&) = delete;

 private:
  IsolatedExecutor& executor_;
};

void IsolatedExecutor::wake() noexcept {
  sleeper_.wake([this] { backend_->post(); });
}

// The thread that spins always counts as asleep, also between two spins, so whatever arrives while
// it looks wakes it. A wake-up after this point is a new one: so a thread that has slept looks at
// everything again.
bool IsolatedExecutor::sleep(TimePoint deadline) noexcept {
  const bool is_woken = backend_->wait(0, deadline);
  sleeper_.end(is_woken);
  sleeper_.begin();
  return is_woken;
}

void IsolatedExecutor::cancel() noexcept {
  cancelled_.store(true);
  wake();
}

void IsolatedExecutor::spin(const ExceptionHandler& handler) {
  const Spin spin(*this, &handler);
  {
    const auto end = [this](void*) { end_children(); };
    const std::unique_ptr<void, decltype(end)> children_end(this, end);
    if (!cancelled_.load()) {
      const std::lock_guard lock(mutex_);
      for (const auto& child : children_) start(*child);  // throws when there is no thread
    }
    while (!cancelled_.load()) {
      sleep(kNever);
      finish_removals();
    }
  }
  const std::lock_guard lock(mutex_);
  if (exception_ != nullptr) std::rethrow_exception(std::exchange(exception_, nullptr));
}

// Cancels all children before it waits for any. Under a manual clock the caller leaves first, so
// that the children's threads can run.
void IsolatedExecutor::end_children() noexcept {
  {
    const std::lock_guard lock(mutex_);
    handler_ = nullptr;
  }
  const auto all = children();  // destroyed after the lock
  for (const auto& child : all) {
    if (child->runs.load()) child->executor.cancel();
  }
  backend_->leave(0);
  Lock lock(mutex_);
  for (const auto& child : all) join(*child, lock);
}

// Begins with the child after the one that has run last, so that none waits for ever.
bool IsolatedExecutor::run_one() {
  const auto all = children_to_spin();
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::size_t turn = (next_turn_ + i) % all.size();
    if (!all[turn]->executor.run_one()) continue;
    next_turn_ = turn + 1;
    return true;
  }
  return false;
}

/// Runs the children in turn on the calling thread until done() or the limit, or one callback;
/// done() is called before every callback, and after each wake-up.
template <class Done>
void IsolatedExecutor::run_on_caller(TimePoint limit, bool once, Done&& done) {
  std::vector<std::shared_ptr<Child>> observed;  // kept as long as the back end watches them
  const auto observe = [&](std::vector<std::shared_ptr<Child>> all) {
    for (const auto& child : all) child->executor.workers().set_observer(this);
    for (const auto& child : observed) {
      if (std::find(all.begin(), all.end(), child) != all.end()) continue;
      child->executor.workers().set_observer(nullptr);
      backend_->unwatch(&child->waker);
    }
    observed = std::move(all);
  };
  const auto stop_observing = [&](void*) {
    observe({});
    wait_for_readers();
  };
  const std::unique_ptr<void, decltype(stop_observing)> guard(this, stop_observing);
  observe(children_to_spin());
  while (!cancelled_.load() && !done()) {
    if (run_one()) {
      if (once || is_over(limit)) return;
      continue;
    }
    TimePoint deadline = limit;
    observe(children_to_spin());
    for (const auto& child : observed) {
      if (const int fd = child->executor.wait_fd(); fd >= 0) {
        backend_->watch({.fd = fd, .events = POLLIN, .listener = &child->waker});
      }
      deadline = std::min(deadline, child->executor.callbacks().next_release());
    }
    if (cancelled_.load() || done() || is_over(limit)) return;
    if (!sleep(deadline) && is_over(limit)) return;
  }
}

void IsolatedExecutor::spin_once(Nanoseconds timeout) {
  const Spin spin(*this);
  const TimePoint limit = end_of(timeout, options_.clock->now());
  run_on_caller(limit, /*once=*/true, [] { return false; });
}

void IsolatedExecutor::spin_some(Nanoseconds max_duration) {
  const Spin spin(*this);
  const TimePoint start = options_.clock->now();
  for (const auto& child : children_to_spin()) {
    if (cancelled_.load()) return;
    const Nanoseconds used = options_.clock->now() - start;
    if (max_duration != Nanoseconds::zero() && used >= max_duration) return;
    child->executor.spin_some(
        max_duration == Nanoseconds::zero() ? max_duration : max_duration - used, &cancelled_);
  }
}

void IsolatedExecutor::spin_all(Nanoseconds max_duration) {
  const Spin spin(*this);
  const TimePoint start = options_.clock->now();
  while (!cancelled_.load() && run_one()) {
    if (max_duration != Nanoseconds::zero() && options_.clock->now() - start >= max_duration)
      return;
  }
}

FutureReturnCode IsolatedExecutor::spin_until_complete(FutureState& future, Nanoseconds timeout) {
  const Spin spin(*this);
  const TimePoint limit = end_of(timeout, options_.clock->now());
  const FutureState::Waiter waiter(future, *this);
  run_on_caller(limit, /*once=*/false, [&] { return future.ready(); });
  if (future.ready()) return FutureReturnCode::SUCCESS;
  return cancelled_.load() ? FutureReturnCode::INTERRUPTED : FutureReturnCode::TIMEOUT;
}

}  // namespace takt
