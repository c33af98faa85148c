// Keys and options of earlier versions: one line each, for the whole of 0.x.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_CONFIGURATION_REMOVED_HPP_
#define TAKT_CONTAINERS_CONFIGURATION_REMOVED_HPP_

#include <array>
#include <string_view>

namespace takt {

/// A key or an option that is refused, with its replacement.
struct Removed {
  std::string_view from;     // a section of the configuration file, or a command: "takt run"
  std::string_view name;     // "loopback_only", "--model"
  std::string_view instead;  // what to write
};

inline constexpr std::array kRemoved{
    Removed{"dds", "loopback_only", "write `discovery: localhost` for true, `subnet` for false"},
    Removed{"takt check", "--deadlines", "use the exit status of `takt analyze FILE`"},
    Removed{"takt run", "--model", "use `--trace TRACE`, then `takt model TRACE -o FILE`"},
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_CONFIGURATION_REMOVED_HPP_
