// A lock-free list: many threads push, one takes all items in order of arrival.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_LOCKFREE_INBOX_HPP_
#define TAKT_BASE_LOCKFREE_INBOX_HPP_

#include <atomic>

#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// An intrusive list of T (linked by `T::inbox_next`). A push is a single compare-and-swap, so a
/// thread that is preempted anywhere never hides what others pushed (unlike the exchange-based
/// list of Vyukov, whose half-made link does); taking all at once leaves no ABA problem.
///
/// Thread safety: push from any thread; take_all from one thread at a time. An item must not be
/// pushed again before it was taken.
/// Real-time: push is lock-free; take_all is wait-free, its reversal linear in what it takes.
template <class T>
class Inbox {
 public:
  void push(T& item) noexcept {
    T* first = first_.load(std::memory_order_relaxed);
    do {
      item.inbox_next = first;
    } while (!first_.compare_exchange_weak(first, &item));
  }

  /// The oldest item, linked by `inbox_next` to the younger ones; nullptr when there is none.
  T* take_all() noexcept {
    if (first_.load(std::memory_order_relaxed) == nullptr) return nullptr;
    // Acquire: pairs with the swap in push; the pushed items are ours to read.
    T* newest_first = first_.exchange(nullptr, std::memory_order_acquire);
    T* oldest_first = nullptr;
    while (newest_first != nullptr) {
      T* next = newest_first->inbox_next;
      newest_first->inbox_next = oldest_first;
      oldest_first = newest_first;
      newest_first = next;
    }
    return oldest_first;
  }

  /// Sequentially consistent with push: the next push wakes a thread that reads true after it has
  /// announced that it goes to sleep.
  bool empty() const noexcept { return first_.load() == nullptr; }

 private:
  std::atomic<T*> first_{nullptr};
};

}  // namespace takt

#endif  // TAKT_BASE_LOCKFREE_INBOX_HPP_
