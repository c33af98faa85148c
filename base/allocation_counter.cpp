// Counts allocations: replaces malloc, counts, and calls the C library's malloc. It replaces free
// as well, as the program may have another heap. Linked into programs that count (tests, benches,
// takt) and into the library libtakt_allocations, which `takt run --allocations` preloads.
// SPDX-License-Identifier: Apache-2.0
#include <cerrno>
#include <cstddef>

#include "takt/base/realtime_scope.hpp"

// The sanitizers have a malloc of their own: with them, allocations_are_counted() is false.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

namespace takt {
// Weak, as a child process of the program inherits the preload but may not link libtakt.
[[gnu::weak]] void count_allocation() noexcept;
}  // namespace takt

namespace {
void count_one() noexcept {
  if (takt::count_allocation != nullptr) takt::count_allocation();
}
}  // namespace

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);

void* malloc(std::size_t size) {
  count_one();
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  count_one();
  return __libc_calloc(count, size);
}
void* realloc(void* block, std::size_t size) {
  count_one();
  return __libc_realloc(block, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
  count_one();
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  count_one();
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** block, std::size_t alignment, std::size_t size) {
  const bool is_power = alignment != 0 && (alignment & (alignment - 1)) == 0;
  if (!is_power || alignment % sizeof(void*) != 0) return EINVAL;
  count_one();
  *block = __libc_memalign(alignment, size);
  return *block == nullptr ? ENOMEM : 0;
}
void free(void* block) {
  __libc_free(block);
}
}

#endif
