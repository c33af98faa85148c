// SPDX-License-Identifier: Apache-2.0
#include "takt/base/time.hpp"

#include <array>
#include <utility>

namespace takt {

std::string to_string(Nanoseconds duration) {
  static constexpr std::array<std::pair<std::int64_t, const char*>, 3> kUnits{
      {{1'000'000'000, "s"}, {1'000'000, "ms"}, {1'000, "us"}}};
  for (const auto& [nanoseconds, name] : kUnits) {
    if (duration.count() % nanoseconds == 0) {
      return std::to_string(duration.count() / nanoseconds) + name;
    }
  }
  return std::to_string(duration.count()) + "ns";
}

}  // namespace takt
