// Functions of the user that are called one after another, and can be removed at any time.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_CALLBACK_LIST_HPP_
#define TAKT_ENTITIES_CALLBACK_LIST_HPP_

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <iterator>
#include <memory>
#include <mutex>
#include <type_traits>
#include <utility>
#include <vector>

#include "takt/base/pi_mutex.hpp"
#include "takt/base/user_function.hpp"
#include "takt/base/visibility.hpp"
#include "takt/entities/wait_in_callback.hpp"

namespace TAKT_PUBLIC takt {
namespace detail {

/// Whether a function may be called, and by how many threads it is being called.
///
/// 1. A call counts itself, unless the function is removed.
/// 2. A removal says so, and waits until no call is counted, unless it is made in a call of the
///    function, or would wait for a thread that waits for this one (see WaitInCallback).
/// 3. The removal or the last call, whichever finds the function removed and not called, destroys
///    it; then it is gone.
///
/// Thread safety: every method from any thread. Real-time: only remove blocks.
class RemovableBase {
 public:
  RemovableBase() = default;
  RemovableBase(const RemovableBase&) = delete;
  RemovableBase& operator=(const RemovableBase&) = delete;

  bool is_removed() const noexcept { return (state_.load() & kRemoved) != 0; }
  /// No call begins any more, and none of another thread runs, but those that wait for this one.
  /// False: it was removed before.
  bool remove() noexcept;
  /// It is removed, and was destroyed.
  bool is_gone() const noexcept { return (state_.load() & kGone) != 0; }

 protected:
  /// The calling thread calls the function, for as long as the object lives. False: it is removed.
  class Call {
   public:
    explicit Call(RemovableBase& of) noexcept : of_(of), is_counted_(of.begin_call()), in_(&of) {}
    ~Call() {
      if (is_counted_) of_.end_call();
    }
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;
    explicit operator bool() const noexcept { return is_counted_; }

   private:
    RemovableBase& of_;
    const bool is_counted_;
    const Running in_;  // also when it destroys the function
  };
  ~RemovableBase() = default;
  virtual void destroy_function() noexcept = 0;

 private:
  static constexpr std::uint32_t kRemoved = 1, kGone = 2, kCall = 4;
  bool begin_call() noexcept;
  void end_call() noexcept;
  void finish() noexcept;

  std::atomic<std::uint32_t> state_{0};
};

template <class Signature>
class Removable;

/// A function that can be removed. A shared pointer must keep it while it is called.
/// Thread safety and real-time: as RemovableBase.
template <class Result, class... Arguments>
class Removable<Result(Arguments...)> final : public RemovableBase {
 public:
  using Function = std::function<Result(Arguments...)>;
  explicit Removable(Function function) noexcept : function_(std::move(function)) {}

  /// `use(function)` runs the function, unless it is removed: then returns false.
  template <class Use>
  bool call(Use&& use) {
    const Call counted(*this);
    if (counted) use(std::as_const(function_));
    return static_cast<bool>(counted);
  }

 private:
  void destroy_function() noexcept override { function_ = {}; }
  // What gives a reference names a listener of ours, such as an executor: it may hear of
  // something under a lock, and is no code of the user.
  std::conditional_t<std::is_reference_v<Result>, Function, UserFunction<Result(Arguments...)>>
      function_;
};

/// Owns a function: the last pointer removes it.
template <class Signature>
using CallbackHandle = std::shared_ptr<const Removable<Signature>>;

/// A function that is removed is called no more, also by a thread that runs through the list.
/// Thread safety: every method from any thread. Functions are called without a lock.
/// Real-time: set-up only.
template <class Signature>
class CallbackList {
 public:
  using Function = typename Removable<Signature>::Function;
  using Entry = std::shared_ptr<Removable<Signature>>;

  /// It is called until it is removed.
  Entry add(Function function) {
    auto entry = std::make_shared<Removable<Signature>>(std::move(function));
    std::vector<Entry> gone;
    const std::lock_guard lock(mutex_);
    gone = take_removed();
    entries_.push_back(entry);
    return entry;
  }
  /// It is called for as long as the handle is kept.
  CallbackHandle<Signature> add_owned(Function function) {
    Entry entry = add(std::move(function));
    auto* const address = entry.get();
    return CallbackHandle<Signature>(
        address, [entry = std::move(entry)](const Removable<Signature>*) { entry->remove(); });
  }

  /// False: it is none of this list, or was removed before.
  bool remove(const Removable<Signature>* function) {
    Entry found;
    {
      const std::lock_guard lock(mutex_);
      const auto entry = std::find_if(entries_.begin(), entries_.end(),
                                      [&](const Entry& each) { return each.get() == function; });
      if (entry != entries_.end()) found = *entry;
    }
    return found != nullptr && found->remove();
  }
  /// Whether there is none to be called.
  bool empty() const {
    const std::lock_guard lock(mutex_);
    return std::all_of(entries_.begin(), entries_.end(),
                       [](const Entry& each) { return each->is_removed(); });
  }

  enum class Order { first_added, last_added };
  /// `use(function)` for each that is not removed when its turn comes, until it returns false. One
  /// that is added meanwhile is left out.
  template <class Use>
  void each(Order order, Use&& use) {
    std::vector<Entry> all, gone;
    {
      const std::lock_guard lock(mutex_);
      gone = take_removed();
      all = entries_;
    }
    if (order == Order::last_added) std::reverse(all.begin(), all.end());
    for (const Entry& entry : all) {
      bool goes_on = true;
      entry->call([&](const auto& function) { goes_on = use(function); });
      if (!goes_on) return;
    }
  }

 private:
  // They go after the lock.
  std::vector<Entry> take_removed() {
    const auto first = std::stable_partition(entries_.begin(), entries_.end(),
                                             [](const Entry& each) { return !each->is_removed(); });
    std::vector<Entry> removed(std::make_move_iterator(first),
                               std::make_move_iterator(entries_.end()));
    entries_.erase(first, entries_.end());
    return removed;
  }

  mutable PiMutex mutex_;  // guards what follows
  std::vector<Entry> entries_;
};

}  // namespace detail
}  // namespace takt

#endif  // TAKT_ENTITIES_CALLBACK_LIST_HPP_
