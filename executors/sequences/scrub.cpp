// Overwrites memory that is deleted, so that a use after free fails at once, and always. A
// sanitizer sees such a use by itself.
// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <cstring>
#include <new>

#include <malloc.h>

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

// The other forms call this one.
void operator delete(void* block) noexcept {
  if (block != nullptr) std::memset(block, 0x5a, malloc_usable_size(block));
  // Without this, the compiler would remove the write, as a dead store.
  asm volatile("" : : "r"(block) : "memory");
  std::free(block);
}
void operator delete(void* block, std::size_t) noexcept {
  ::operator delete(block);
}

#endif
