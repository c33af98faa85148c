// Futures and promises that wake an executor.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_FUTURE_HPP_
#define TAKT_BASE_FUTURE_HPP_

#include <atomic>
#include <memory>
#include <optional>
#include <utility>

#include "takt/base/error.hpp"
#include "takt/base/lockfree/read_section.hpp"
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
/// Real-time: nothing blocks or allocates, except watch(nullptr), which waits for wakers.
class FutureState {
 public:
  bool ready() const noexcept { return ready_.load(); }

  /// `waiter` is woken when the value arrives. After watch(nullptr) no thread uses the old one.
  void watch(Wakeable* waiter) noexcept {
    waiter_.store(waiter);
    if (waiter == nullptr) wait_for_readers();
  }

 protected:
  void complete() noexcept {
    ready_.store(true);
    const ReadSection section;
    if (Wakeable* waiter = waiter_.load()) waiter->wake();
  }

 private:
  std::atomic<bool> ready_{false};
  std::atomic<Wakeable*> waiter_{nullptr};
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
    if (!ready()) throw Error("the future is not ready", "wait with spin_until_future_complete");
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
/// Real-time: construction allocates; set_value neither blocks nor allocates unless moving T does.
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
