// Order of arrival, over the whole process.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_LOCKFREE_SEQUENCE_HPP_
#define TAKT_BASE_LOCKFREE_SEQUENCE_HPP_

#include <atomic>
#include <cstdint>

#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// The next number: every message and every timer release draws one, so that a scheduler can tell
/// which came first whatever they are. One counter for all costs a cache line that publishing
/// threads share, and spares one number for each receiver.
inline std::uint64_t next_sequence() noexcept {
  alignas(64) static constinit std::atomic<std::uint64_t> last{0};
  return last.fetch_add(1) + 1;
}

}  // namespace takt

#endif  // TAKT_BASE_LOCKFREE_SEQUENCE_HPP_
