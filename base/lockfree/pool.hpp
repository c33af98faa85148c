// A pool of a fixed number of objects, lent and returned by any thread.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_LOCKFREE_POOL_HPP_
#define TAKT_BASE_LOCKFREE_POOL_HPP_

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <new>
#include <utility>

#include "takt/base/prefetch.hpp"
#include "takt/base/set_aside.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// What does not depend on the type of a pool's objects: their memory, and which of them, by their
/// numbers, may be lent.
///
/// The memory of all objects is set aside at once (set_aside.hpp), in one piece. Each is made when
/// it is first needed, in its place there: only when all that were made are out. So a pool for many
/// messages takes the memory of as many as were out at once. Where a constructor may allocate, or
/// pages must not come later, all are made at once.
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
  /// How many were needed at once so far, or were made at once.
  std::size_t made() const noexcept { return made_.load(); }
  /// The owner's goodbye: frees the pool now, or some time after the last object has come home.
  void close() noexcept { sweep(this); }

 protected:
  static constexpr std::uint32_t kNone = UINT32_MAX;

  PoolBase(std::size_t capacity, std::size_t bytes_each, std::size_t alignment)
      : capacity_(capacity),
        stride_((bytes_each + alignment - 1) / alignment * alignment),
        alignment_(alignment),
        objects_(set_aside(capacity * (stride_ + sizeof(Next)), alignment)),
        next_(reinterpret_cast<Next*>(static_cast<std::byte*>(objects_) + capacity * stride_)) {
    sweep(nullptr);
  }
  virtual ~PoolBase() { give_back(objects_, capacity_ * (stride_ + sizeof(Next)), alignment_); }

  void* place_of(std::uint32_t index) const noexcept {
    return static_cast<std::byte*>(objects_) + index * stride_;
  }
  /// Before any is lent. Throws what `make` throws.
  void make_at_once(std::uint32_t count) {
    for (std::uint32_t index = 0; index < count; ++index) {
      new (&next_[index]) Next(kNone);
      make(index);
      made_.store(index + 1);
      push(lists_[0], index);
    }
  }

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
  using Next = std::atomic<std::uint32_t>;

  /// Makes the object in its place.
  virtual void make(std::uint32_t index) = 0;
  /// kNone: all were made.
  std::uint32_t make_next() noexcept {
    std::uint32_t index = made_.load();
    while (index < capacity_ && !made_.compare_exchange_weak(index, index + 1)) {
    }
    if (index == capacity_) return kNone;
    new (&next_[index]) Next(kNone);
    make(index);
    return index;
  }

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
      const bool all_are_made = made_.load() == capacity_;
      std::uint32_t from = lent_from_.load(std::memory_order_relaxed);
      const std::uint64_t head = lists_[from].head.load(std::memory_order_acquire);
      std::uint32_t index = pop(lists_[from]);
      if (index != kNone) return index;
      index = pop(lists_[1 - from]);
      if (index != kNone) {
        lent_from_.compare_exchange_strong(from, 1 - from, std::memory_order_relaxed);
        return index;
      }
      if (!all_are_made) {
        if (index = make_next(); index != kNone) return index;
        continue;
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
    return home_ == made_.load();
  }

  const std::size_t capacity_, stride_, alignment_;
  void* const objects_;
  Next* const next_;                         // behind the objects
  std::atomic<std::uint32_t> made_{0};       // the first ones; their parts of `next_`, too
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

/// Objects of T (derived from PoolNode<T>), never destroyed before all of them are home and the
/// owner has said goodbye (`close`): an object that is still out when the owner goes keeps the pool
/// alive. Thread safety and real-time: as PoolBase.
template <class T>
class Pool final : public PoolBase {
 public:
  /// Makes the object with this number there: of T, or of a class whose first base T is.
  using Make = std::function<void(void* place, std::uint32_t number)>;
  struct Layout {
    std::size_t bytes = sizeof(T), alignment = alignof(T);
  };
  /// The owner must call close().
  static Pool* create(std::size_t capacity, std::size_t at_once = 0) {
    return create(
        capacity, [](void* place, std::uint32_t) { new (place) T; }, at_once);
  }
  /// Of those that are not made at once, `make` must throw nothing and allocate nothing.
  static Pool* create(std::size_t capacity, Make make, std::size_t at_once, Layout layout = {}) {
    auto* const pool = new Pool(capacity, std::move(make), layout);
    try {
      pool->make_at_once(static_cast<std::uint32_t>(std::min(capacity, at_once)));
    } catch (...) {
      pool->close();
      throw;
    }
    return pool;
  }

  /// nullptr when all are out.
  T* acquire() noexcept {
    const std::uint32_t index = acquire_index();
    if (index == kNone) return nullptr;
    // Where another thread returns objects, it has the cache lines of the one to be lent next.
    if (const std::uint32_t next = next_of(index); next != kNone) {
      prefetch_for_writing(place_of(next), sizeof(T));
    }
    return object(index);
  }

  /// Gives an object back to the pool it came from.
  static void recycle(T& object) noexcept {
    PoolNode<T>& node = object;
    node.pool_->recycle_index(node.index_);
  }

 private:
  Pool(std::size_t capacity, Make make, Layout layout)
      : PoolBase(capacity, layout.bytes, layout.alignment), make_(std::move(make)) {}
  ~Pool() override {
    for (std::uint32_t i = 0; i < made(); ++i) object(i)->~T();
  }

  void make(std::uint32_t index) override {
    make_(place_of(index), index);
    PoolNode<T>& node = *object(index);
    node.pool_ = this;
    node.index_ = index;
  }
  T* object(std::uint32_t index) const noexcept {
    return std::launder(static_cast<T*>(place_of(index)));
  }

  const Make make_;
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
