// How much less a test does under sanitizers.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TESTING_SANITIZED_HPP_
#define TAKT_TESTING_SANITIZED_HPP_

#include <cstdint>

namespace takt {

/// Sanitizers are slow, and look for other mistakes: with them a test divides by this how many
/// systems it looks at, or how often it repeats.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr std::uint64_t kFewerSanitized = 10;
#else
inline constexpr std::uint64_t kFewerSanitized = 1;
#endif

}  // namespace takt

#endif  // TAKT_TESTING_SANITIZED_HPP_
