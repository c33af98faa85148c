// This program again, in a process of its own.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_RUN_AGAIN_HPP_
#define TAKT_TOOLS_TAKT_RUN_AGAIN_HPP_

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace takt::tools {

/// Runs `takt WORDS…`, so that what is measured begins afresh, and reads the JSON that it writes to
/// stdout. Throws Error when it does not end well; what it has said is on stderr then.
nlohmann::json run_again(std::vector<std::string> words);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_RUN_AGAIN_HPP_
