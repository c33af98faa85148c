// A fixed number of objects that are lent and come back, from any thread.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_POOL_HPP_
#define TAKT_BASE_POOL_HPP_

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

#include "takt/base/read_section.hpp"

namespace takt {

template <class T>
class Pool;

/// The part of a pooled object that knows the way home.
template <class T>
class PoolNode {
  friend class Pool<T>;
  Pool<T>* pool_ = nullptr;
  std::uint32_t index_ = 0;
};

/// Objects of T (derived from PoolNode<T>), made at once and never destroyed before all of them
/// are home and the owner has said goodbye (`close`): an object that is still out when the owner
/// goes keeps the pool alive.
///
/// Two free lists, because lender and returner are usually different threads: objects come back
/// to one list, and are lent from the other, which takes over the whole first list when it is
/// empty. So the two threads meet once a batch, not once an object.
///
/// Thread safety: acquire and recycle from any thread; close once, by the owner.
/// Real-time: acquire and recycle are lock-free and allocate nothing; recycle frees the pool when
/// it brings the last object home after close. Taking over a list is linear in its length.
template <class T>
class Pool {
 public:
  /// `make(i)` returns the i-th object. The owner must call close().
  template <class Make>
  static Pool* create(std::size_t capacity, Make&& make) {
    std::unique_ptr<Pool> pool(new Pool(capacity));
    for (std::uint32_t i = 0; i < capacity; ++i) {
      pool->objects_[i] = make(i);
      pool->objects_[i]->pool_ = pool.get();
      pool->objects_[i]->index_ = i;
      pool->push(pool->lendable_, i, i);
    }
    return pool.release();
  }

  std::size_t capacity() const noexcept { return capacity_; }

  /// nullptr when all are out.
  T* acquire() noexcept {
    std::uint32_t index = pop(lendable_);
    if (index == kNone) {
      // Acquire: pairs with push in recycle; the chain and its objects are ours now.
      std::uint64_t old = returned_.load(std::memory_order_relaxed);
      while (!returned_.compare_exchange_weak(old, next_tag(old) | kNone, std::memory_order_acquire)) {
      }
      index = static_cast<std::uint32_t>(old);
      if (index == kNone) return nullptr;
      const std::uint32_t first = next_[index].load(std::memory_order_relaxed);
      if (first != kNone) {
        std::uint32_t last = first;
        for (std::uint32_t next; (next = next_[last].load(std::memory_order_relaxed)) != kNone;) {
          last = next;
        }
        push(lendable_, first, last);
      }
    }
    return objects_[index].get();
  }

  /// Gives an object back to the pool it came from.
  static void recycle(T& object) noexcept {
    Pool* pool = static_cast<PoolNode<T>&>(object).pool_;
    const std::uint32_t index = static_cast<PoolNode<T>&>(object).index_;
    {
      // close() waits for this section, so that the pool outlives our push.
      const ReadSection section;
      if (!pool->closed_.load()) {
        pool->push(pool->returned_, index, index);
        return;
      }
    }
    pool->came_home(1);
  }

  /// The owner's goodbye: frees the pool now, or when the last object has come home.
  void close() noexcept {
    closed_.store(true);
    wait_for_readers();
    std::size_t count = 0;
    while (pop(lendable_) != kNone) ++count;
    while (pop(returned_) != kNone) ++count;
    came_home(count);
  }

 private:
  static constexpr std::uint32_t kNone = UINT32_MAX;

  explicit Pool(std::size_t capacity)
      : capacity_(capacity),
        objects_(new std::unique_ptr<T>[capacity]),
        next_(new std::atomic<std::uint32_t>[capacity]) {}

  // A list head is {change count, index of the first}: the count makes a stale swap fail (ABA).
  static std::uint64_t next_tag(std::uint64_t head) noexcept {
    return ((head >> 32) + 1) << 32;
  }

  void push(std::atomic<std::uint64_t>& list, std::uint32_t first, std::uint32_t last) noexcept {
    std::uint64_t old = list.load(std::memory_order_relaxed);
    do {
      next_[last].store(static_cast<std::uint32_t>(old), std::memory_order_relaxed);
      // Release: pairs with the acquire of whoever takes it; the object is complete.
    } while (!list.compare_exchange_weak(old, next_tag(old) | first, std::memory_order_release,
                                         std::memory_order_relaxed));
  }

  std::uint32_t pop(std::atomic<std::uint64_t>& list) noexcept {
    std::uint64_t old = list.load(std::memory_order_acquire);
    for (;;) {
      const auto index = static_cast<std::uint32_t>(old);
      if (index == kNone) return kNone;
      const std::uint32_t next = next_[index].load(std::memory_order_relaxed);
      if (list.compare_exchange_weak(old, next_tag(old) | next, std::memory_order_acquire)) {
        return index;
      }
    }
  }

  void came_home(std::size_t count) noexcept {
    if (home_.fetch_add(count) + count == capacity_) delete this;
  }

  const std::size_t capacity_;
  const std::unique_ptr<std::unique_ptr<T>[]> objects_;
  const std::unique_ptr<std::atomic<std::uint32_t>[]> next_;
  std::atomic<bool> closed_{false};
  std::atomic<std::size_t> home_{0};  // counted only after close()
  alignas(64) std::atomic<std::uint64_t> lendable_{kNone};  // the lender's
  alignas(64) std::atomic<std::uint64_t> returned_{kNone};  // the returners'
};

/// Says goodbye to a pool when its owner goes.
template <class T>
struct ClosePool {
  void operator()(Pool<T>* pool) const noexcept { pool->close(); }
};
template <class T>
using PoolPtr = std::unique_ptr<Pool<T>, ClosePool<T>>;

}  // namespace takt

#endif  // TAKT_BASE_POOL_HPP_
