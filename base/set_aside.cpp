// SPDX-License-Identifier: Apache-2.0
#include "takt/base/set_aside.hpp"

#include <algorithm>
#include <memory_resource>
#include <mutex>

#include <sys/mman.h>
#ifdef __SANITIZE_ADDRESS__
#include <sanitizer/lsan_interface.h>
#endif

#include "takt/base/never_destroyed.hpp"

namespace takt {
namespace {

// A larger block has a mapping of its own, which goes back to the kernel when it is freed.
constexpr std::size_t kLargest = 64 * 1024;
// The pool's bookkeeping and its first small chunks come from the heap.
constexpr std::size_t kSmallest = 16 * 1024;

// The leak sanitizer looks for pointers in the heap, and in mappings that are registered.
void show_to_sanitizer([[maybe_unused]] void* memory, [[maybe_unused]] std::size_t bytes,
                       [[maybe_unused]] bool is_there) {
#ifdef __SANITIZE_ADDRESS__
  (is_there ? __lsan_register_root_region : __lsan_unregister_root_region)(memory, bytes);
#endif
}

class Mappings final : public std::pmr::memory_resource {
  void* do_allocate(std::size_t bytes, std::size_t alignment) override {
    if (bytes < kSmallest) return ::operator new(bytes, std::align_val_t(alignment));
    void* const memory =
        mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) throw std::bad_alloc();
    madvise(memory, bytes, MADV_NOHUGEPAGE);  // else one page fault takes 2 MB
    show_to_sanitizer(memory, bytes, true);
    return memory;
  }
  void do_deallocate(void* memory, std::size_t bytes, std::size_t alignment) override {
    if (bytes < kSmallest) return ::operator delete(memory, std::align_val_t(alignment));
    show_to_sanitizer(memory, bytes, false);
    munmap(memory, bytes);
  }
  bool do_is_equal(const std::pmr::memory_resource& other) const noexcept override {
    return this == &other;
  }
};

struct Memory {
  Mappings mappings;
  std::mutex mutex;
  // Its notes lie behind the pieces, not in them.
  std::pmr::unsynchronized_pool_resource pieces{
      {.max_blocks_per_chunk = 256, .largest_required_pool_block = kLargest}, &mappings};
};

// The sizes of pieces keep an alignment that divides them.
std::size_t size_of_piece(std::size_t bytes, std::size_t alignment) noexcept {
  return (std::max<std::size_t>(bytes, 1) + alignment - 1) / alignment * alignment;
}

Memory& memory() {
  static detail::NeverDestroyed<Memory> memory;  // pools are closed by static objects, too
  return *memory;
}

}  // namespace

void* set_aside(std::size_t bytes, std::size_t alignment) {
  Memory& all = memory();
  const std::lock_guard lock(all.mutex);
  return all.pieces.allocate(size_of_piece(bytes, alignment), alignment);
}

void give_back(void* place, std::size_t bytes, std::size_t alignment) noexcept {
  Memory& all = memory();
  const std::lock_guard lock(all.mutex);
  all.pieces.deallocate(place, size_of_piece(bytes, alignment), alignment);
}

}  // namespace takt
