// A pool of a fixed number of objects, lent and returned by any thread.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_LOCKFREE_POOL_HPP_
#define TAKT_BASE_LOCKFREE_POOL_HPP_

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>

#include "takt/base/prefetch.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// What does not depend on the type of a pool's objects: which of them, by their numbers, may be
/// lent.
///
/// Two free lists, because lender and returner are usually different threads: objects come back
/// to one list, and are lent from the other; when that is empty, the two change roles. So the two
/// threads meet once a batch, not once an object, and no free object is ever out of a lender's
/// sight.
///
/// Coming home is one swap, after which the returner never touches the pool again; so a thread that
/// has counted all objects home may free it. That happens to closed pools each time a pool is made
/// or closed.
/// Thread safety: acquire_index and recycle_index from any thread; close once, by the owner.
/// Real-time: acquire_index and recycle_index are lock-free, allocate and free nothing.
class PoolBase {
 public:
  PoolBase(const PoolBase&) = delete;
  PoolBase& operator=(const PoolBase&) = delete;
  std::size_t capacity() const noexcept { return capacity_; }
  /// The owner's goodbye: frees the pool now, or some time after the last object has come home.
  void close() noexcept { sweep(this); }

 protected:
  static constexpr std::uint32_t kNone = UINT32_MAX;

  explicit PoolBase(std::size_t capacity)  // all may be lent
      : capacity_(capacity), next_(new std::atomic<std::uint32_t>[capacity]) {
    sweep(nullptr);
    for (std::uint32_t i = 0; i < capacity; ++i) push(lists_[0], i);
  }
  virtual ~PoolBase() = default;

  /// kNone when all are out at the same time.
  std::uint32_t acquire_index() noexcept {
    const std::uint32_t index = pop(lists_[lent_from_.load(std::memory_order_relaxed)]);
    return index != kNone ? index : acquire_from_either();
  }
  /// The one that was free behind it when it was lent; kNone: none.
  std::uint32_t next_of(std::uint32_t index) const noexcept {
    return next_[index].load(std::memory_order_relaxed);
  }
  void recycle_index(std::uint32_t index) noexcept {
    push(lists_[1 - lent_from_.load(std::memory_order_relaxed)], index);
  }

 private:
  /// Frees this pool and others that are closed, or keeps them for later. From any thread, under a
  /// lock of its own.
  static void sweep(PoolBase* closed) noexcept;

  /// {change count, index of the first}: the count makes a stale swap fail (ABA).
  struct alignas(64) List {
    std::atomic<std::uint64_t> head{kNone};
  };
  static std::uint64_t next_tag(std::uint64_t head) noexcept { return ((head >> 32) + 1) << 32; }

  void push(List& list, std::uint32_t index) noexcept {
    std::uint64_t old = list.head.load(std::memory_order_relaxed);
    do {
      next_[index].store(static_cast<std::uint32_t>(old), std::memory_order_relaxed);
      // Release: pairs with the acquire of the thread that takes it; the object is complete.
    } while (!list.head.compare_exchange_weak(old, next_tag(old) | index, std::memory_order_release,
                                              std::memory_order_relaxed));
  }

  std::uint32_t pop(List& list) noexcept {
    std::uint64_t old = list.head.load(std::memory_order_acquire);
    for (;;) {
      const auto index = static_cast<std::uint32_t>(old);
      if (index == kNone) return kNone;
      const std::uint32_t next = next_[index].load(std::memory_order_relaxed);
      if (list.head.compare_exchange_weak(old, next_tag(old) | next, std::memory_order_acquire)) {
        return index;
      }
    }
  }

  // Not inline: once a batch it may cost a call, and the other times it must not cost registers.
  // Threads that read the roles just before they change use the lists the other way round, which
  // does no harm.
  [[gnu::noinline]] std::uint32_t acquire_from_either() noexcept {
    for (;;) {
      std::uint32_t from = lent_from_.load(std::memory_order_relaxed);
      const std::uint64_t head = lists_[from].head.load(std::memory_order_acquire);
      std::uint32_t index = pop(lists_[from]);
      if (index != kNone) return index;
      index = pop(lists_[1 - from]);
      if (index != kNone) {
        lent_from_.compare_exchange_strong(from, 1 - from, std::memory_order_relaxed);
        return index;
      }
      // If the first has not changed meanwhile, it was empty when the other one was, too.
      if (lists_[from].head.load(std::memory_order_acquire) == head) return kNone;
    }
  }

  // In sweep only. Counts the objects that are home; true when all are.
  bool all_home() noexcept {
    for (List& list : lists_) {
      while (pop(list) != kNone) ++home_;
    }
    return home_ == capacity_;
  }

  const std::size_t capacity_;
  const std::unique_ptr<std::atomic<std::uint32_t>[]> next_;
  std::atomic<std::uint32_t> lent_from_{0};  // objects come back to the other list
  std::size_t home_ = 0;                     // after close(): guarded by sweep
  std::array<List, 2> lists_;
};

template <class T>
class Pool;

/// The part of a pooled object that knows its pool.
/// Thread safety and real-time: none of its own; only Pool uses it.
template <class T>
class PoolNode {
  friend class Pool<T>;
  Pool<T>* pool_ = nullptr;
  std::uint32_t index_ = 0;
};

/// Objects of T (derived from PoolNode<T>), made at once and never destroyed before all of them
/// are home and the owner has said goodbye (`close`): an object that is still out when the owner
/// goes keeps the pool alive.
/// Thread safety and real-time: as PoolBase.
template <class T>
class Pool final : public PoolBase {
 public:
  /// `make(i)` returns the i-th object. The owner must call close().
  template <class Make>
  static Pool* create(std::size_t capacity, Make&& make) {
    auto objects = std::make_unique<std::unique_ptr<T>[]>(capacity);
    for (std::uint32_t i = 0; i < capacity; ++i) objects[i] = make(i);
    return new Pool(capacity, std::move(objects));
  }

  /// nullptr when all are out.
  T* acquire() noexcept {
    const std::uint32_t index = acquire_index();
    if (index == kNone) return nullptr;
    // Where another thread returns objects, it has the cache lines of the one to be lent next.
    if (const std::uint32_t next = next_of(index); next != kNone) {
      prefetch_for_writing(objects_[next].get(), sizeof(T));
    }
    return objects_[index].get();
  }

  /// Gives an object back to the pool it came from.
  static void recycle(T& object) noexcept {
    PoolNode<T>& node = object;
    node.pool_->recycle_index(node.index_);
  }

 private:
  Pool(std::size_t capacity, std::unique_ptr<std::unique_ptr<T>[]> objects)
      : PoolBase(capacity), objects_(std::move(objects)) {
    for (std::uint32_t i = 0; i < capacity; ++i) {
      PoolNode<T>& node = *objects_[i];
      node.pool_ = this;
      node.index_ = i;
    }
  }

  const std::unique_ptr<std::unique_ptr<T>[]> objects_;
};

/// Says goodbye to a pool when its owner goes.
template <class T>
struct ClosePool {
  void operator()(Pool<T>* pool) const noexcept { pool->close(); }
};
template <class T>
using PoolPtr = std::unique_ptr<Pool<T>, ClosePool<T>>;

}  // namespace takt

#endif  // TAKT_BASE_LOCKFREE_POOL_HPP_
