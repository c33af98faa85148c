// A number with its noun, for texts.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_COUNTED_HPP_
#define TAKT_BASE_COUNTED_HPP_

#include <cstdint>
#include <string>
#include <string_view>

#include <fmt/format.h>

namespace takt {

/// "1 thread", "2 threads".
inline std::string counted(std::uint64_t count, std::string_view noun) {
  return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

}  // namespace takt

#endif  // TAKT_BASE_COUNTED_HPP_
