// How much memory a process keeps, for tests that look for leaks.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TESTING_MEMORY_IN_USE_HPP_
#define TAKT_TESTING_MEMORY_IN_USE_HPP_

#include <chrono>
#include <cstdint>
#include <thread>

#include <malloc.h>

namespace takt {

// Sanitizers have allocators of their own.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kKnowsMemoryInUse = false;
#else
inline constexpr bool kKnowsMemoryInUse = true;
#endif

/// Bytes that were allocated and not freed. malloc counts what each thread has freed for its own
/// next use, up to 7 blocks of each size: so this may rise by some 100 kB without a leak, once for
/// each thread. A leak goes on: look at several stretches of the same work, and at the least or the
/// median of them. Waits, for a second at most, until other threads have freed what they free
/// later. Thread safety: complete. Real-time: no.
inline std::int64_t memory_in_use() {
  const auto now = [] {
    const auto info = mallinfo2();
    return static_cast<std::int64_t>(info.uordblks + info.hblkhd);
  };
  std::int64_t memory = now();
  for (int polls = 0, quiet = 0; polls < 200 && quiet < 3; ++polls) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    quiet = now() == memory ? quiet + 1 : 0;
    memory = now();
  }
  return memory;
}

}  // namespace takt

#endif  // TAKT_TESTING_MEMORY_IN_USE_HPP_
