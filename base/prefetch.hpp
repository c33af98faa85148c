// Fetches cache lines before they are needed.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_PREFETCH_HPP_
#define TAKT_BASE_PREFETCH_HPP_

#include <cstddef>

#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// Begins to take these bytes' cache lines, the first three at most, from the core that has them:
/// for a thread that will write there, and does something else first. Harmless wherever it points.
/// Thread safety: any thread.
/// Real-time: yes.
inline void prefetch_for_writing(const void* object, std::size_t size) noexcept {
  constexpr std::size_t kLine = 64, kMost = 3 * kLine;
  const auto* bytes = static_cast<const char*>(object);
  for (std::size_t at = 0; at < size && at < kMost; at += kLine) {
#if defined(__x86_64__) || defined(__i386__)
    // The compiler's own would fetch them for reading. An older CPU takes it as no operation.
    asm volatile("prefetchw %0" ::"m"(bytes[at]));
#else
    __builtin_prefetch(bytes + at, 1);
#endif
  }
}

}  // namespace takt

#endif  // TAKT_BASE_PREFETCH_HPP_
