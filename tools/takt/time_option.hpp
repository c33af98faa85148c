// Options that are a time.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_TIME_OPTION_HPP_
#define TAKT_TOOLS_TAKT_TIME_OPTION_HPP_

#include <string>

#include <CLI/CLI.hpp>

#include "takt/base/time.hpp"

namespace takt::tools {

/// "4s", "500ms", or "4": seconds. The command ends with an Error if it is anything else.
inline CLI::Option* add_time_option(CLI::App& command, const std::string& names, Nanoseconds& time,
                                    const std::string& what) {
  return command
      .add_option_function<std::string>(
          names, [&time](const std::string& text) { time = parse_run_time(text); }, what)
      ->type_name("TIME");
}

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_TIME_OPTION_HPP_
