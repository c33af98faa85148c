// Callbacks that wait in a heap, each with the key that it is compared by.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_SCHED_KEYED_HEAP_HPP_
#define TAKT_SCHED_KEYED_HEAP_HPP_

#include <algorithm>
#include <cstddef>
#include <span>
#include <type_traits>
#include <vector>

#include "takt/sched/scheduler.hpp"

namespace takt {

/// The keys stand beside the pointers: with several workers, another one has often had the
/// callbacks' cache lines last.
/// Thread safety: none.
/// Real-time: resize allocates; push and pop are O(log n), and neither block nor allocate.
template <class Key>
class KeyedHeap {
 public:
  /// To this many callbacks at most. Only while it is empty.
  void resize(std::size_t most) { items_.resize(most); }
  bool empty() const noexcept { return size_ == 0; }
  void push(const Key& key, ReadyCallback& callback) noexcept {
    items_[size_++] = {key, &callback};
    if (size_ > 1) std::push_heap(items_.begin(), end(), after);
  }
  /// The smallest key. Only while it is not empty.
  const Key& first() const noexcept { return items_.front().key; }
  /// The callback with that key; nullptr when there is none.
  ReadyCallback* pop() noexcept {
    if (size_ == 0) return nullptr;
    if (size_ > 1) std::pop_heap(items_.begin(), end(), after);
    return items_[--size_].callback;
  }
  /// The callback that pop would return.
  ReadyCallback* peek() const noexcept { return size_ != 0 ? items_.front().callback : nullptr; }

 private:
  struct Item {
    Key key;
    ReadyCallback* callback;
  };
  static constexpr auto after = [](const Item& a, const Item& b) noexcept { return b.key < a.key; };
  auto end() noexcept { return items_.begin() + static_cast<std::ptrdiff_t>(size_); }

  std::vector<Item> items_;  // as large as it will ever be
  std::size_t size_ = 0;
};

/// As HeapScheduler, for an order that compares one or two numbers from different places. Where it
/// compares more, or all stand in one place, HeapScheduler is faster for one worker. `KeyOf` is a
/// function object: `auto operator()(const ReadyCallback& callback) const`; the smallest key runs
/// next.
/// Thread safety and real-time: as HeapScheduler.
template <class KeyOf>
class KeyedScheduler final : public Scheduler {
 public:
  void configure(std::span<const CallbackInfo> callbacks) override {
    heap_.resize(callbacks.size());
  }
  void push(ReadyCallback& callback) noexcept override { heap_.push(KeyOf()(callback), callback); }
  ReadyCallback* pop() noexcept override { return heap_.pop(); }
  ReadyCallback* peek() noexcept override { return heap_.peek(); }

 private:
  KeyedHeap<std::invoke_result_t<KeyOf, const ReadyCallback&>> heap_;
};

}  // namespace takt

#endif  // TAKT_SCHED_KEYED_HEAP_HPP_
