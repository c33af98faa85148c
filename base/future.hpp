// Futures and promises that wake an executor.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_FUTURE_HPP_
#define TAKT_BASE_FUTURE_HPP_

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>

#include "takt/base/error.hpp"
#include "takt/base/pi_mutex.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// A sleeping thread that can be woken.
/// Thread safety: wake from any thread.
/// Real-time: wake must neither block nor allocate.
class Wakeable {
 public:
  virtual void wake() noexcept = 0;

 protected:
  ~Wakeable() = default;
};

/// The part of a future that an executor uses. std::future cannot notify when it becomes ready, so
/// an executor would have to poll it (rclcpp issue 1916).
/// Thread safety: every method may be called from any thread.
/// Real-time: nothing allocates; a lock with priority inheritance, held while all that wait are
/// woken.
class FutureState {
 public:
  /// While it lives, `waiter` is woken when the value arrives; afterwards no thread uses `waiter`.
  /// Any number may wait: each lies on the stack of its spin, which another spin may be nested in.
  class Waiter {
   public:
    Waiter(FutureState& future, Wakeable& waiter) noexcept : future_(future), waiter_(waiter) {
      const std::lock_guard lock(future_.mutex_);
      next_ = std::exchange(future_.waiters_, this);
    }
    ~Waiter() {
      const std::lock_guard lock(future_.mutex_);
      Waiter** link = &future_.waiters_;
      while (*link != this) link = &(*link)->next_;
      *link = next_;
    }
    Waiter(const Waiter&) = delete;
    Waiter& operator=(const Waiter&) = delete;

   private:
    friend class FutureState;
    FutureState& future_;
    Wakeable& waiter_;
    Waiter* next_;
  };

  bool ready() const noexcept { return ready_.load(); }

 protected:
  void complete() noexcept {
    const std::lock_guard lock(mutex_);
    ready_.store(true);
    for (Waiter* waiter = waiters_; waiter != nullptr; waiter = waiter->next_) {
      waiter->waiter_.wake();
    }
  }

 private:
  std::atomic<bool> ready_{false};
  PiMutex mutex_;
  Waiter* waiters_ TAKT_GUARDED_BY(mutex_) = nullptr;
};

template <class T>
class Promise;

/// The receiving side; copies share the value.
/// Thread safety: every method from any thread; an object that is assigned to, by one at a time.
/// Real-time: nothing blocks or allocates; get throws, and so allocates, when it is not ready.
template <class T>
class Future {
 public:
  bool ready() const noexcept { return state_->ready(); }
  /// The value; throws Error if it is not ready.
  const T& get() const {
    if (!ready()) {
      throw Error("the future is not ready",
                  "in a callback, make it a coroutine and co_await the call; elsewhere, wait with "
                  "spin_until_future_complete");
    }
    return *state_->value;
  }
  FutureState& state() const noexcept { return *state_; }

 private:
  friend class Promise<T>;
  struct State : FutureState {
    std::optional<T> value;
    using FutureState::complete;
  };
  explicit Future(std::shared_ptr<State> state) : state_(std::move(state)) {}
  std::shared_ptr<State> state_;
};

/// The sending side.
/// Thread safety: set_value once, from any thread.
/// Real-time: construction allocates; set_value is as FutureState, unless moving T allocates.
template <class T>
class Promise {
 public:
  Future<T> get_future() const { return Future<T>(state_); }
  void set_value(T value) {
    state_->value.emplace(std::move(value));
    state_->complete();
  }

 private:
  std::shared_ptr<typename Future<T>::State> state_ = std::make_shared<typename Future<T>::State>();
};

}  // namespace takt

#endif  // TAKT_BASE_FUTURE_HPP_
