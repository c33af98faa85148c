// Memory for the small objects that the standard library allocates behind a shared_ptr or a future.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_LOCKFREE_CELLS_HPP_
#define TAKT_BASE_LOCKFREE_CELLS_HPP_

#include <algorithm>
#include <cstddef>
#include <new>

#include "takt/base/lockfree/pool.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// A cell, in front of its bytes.
struct alignas(std::max_align_t) Cell : PoolNode<Cell> {
  bool from_heap = false;
};

template <class T>
class CellAllocator;

/// So many cells, each for so many bytes, in memory that is set aside. What is larger, or comes
/// when all are out, gets the heap's. Cells that are out when this goes stay. Thread safety: as
/// Pool. Real-time: a cell is lock-free; the heap is not.
class Cells {
 public:
  Cells(std::size_t count, std::size_t bytes_each)
      : bytes_each_(bytes_each),
        pool_(Pool<Cell>::create(count, [](void* place, std::uint32_t) { new (place) Cell; },
                                 /*at_once=*/0, {sizeof(Cell) + bytes_each, alignof(Cell)})) {}

  /// It must not allocate when this has gone.
  CellAllocator<std::byte> allocator() const noexcept;

 private:
  template <class T>
  friend class CellAllocator;

  void* allocate(std::size_t bytes) const {
    Cell* cell = bytes <= bytes_each_ ? pool_->acquire() : nullptr;
    if (cell == nullptr) {
      cell = new (::operator new(sizeof(Cell) + bytes)) Cell;
      cell->from_heap = true;
    }
    return cell + 1;
  }
  static void deallocate(void* memory) noexcept {
    Cell* const cell = static_cast<Cell*>(memory) - 1;
    if (cell->from_heap) {
      ::operator delete(cell);
    } else {
      Pool<Cell>::recycle(*cell);
    }
  }

  const std::size_t bytes_each_;
  const PoolPtr<Cell> pool_;
};

/// For `std::allocate_shared`, `std::promise` and the like. Thread safety: as a pointer to the
/// cells. Real-time: as Cells.
template <class T>
class CellAllocator {
 public:
  using value_type = T;
  explicit CellAllocator(const Cells& cells) noexcept : cells_(&cells) {}
  template <class U>
  CellAllocator(const CellAllocator<U>& other) noexcept : cells_(other.cells_) {}  // NOLINT

  T* allocate(std::size_t count) {
    static_assert(alignof(T) <= alignof(Cell));
    return static_cast<T*>(cells_->allocate(count * sizeof(T)));
  }
  void deallocate(T* memory, std::size_t) noexcept { Cells::deallocate(memory); }
  friend bool operator==(const CellAllocator&, const CellAllocator&) = default;

 private:
  template <class U>
  friend class CellAllocator;
  const Cells* cells_;
};

inline CellAllocator<std::byte> Cells::allocator() const noexcept {
  return CellAllocator<std::byte>(*this);
}

}  // namespace takt

#endif  // TAKT_BASE_LOCKFREE_CELLS_HPP_
