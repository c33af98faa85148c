// Constructs the components of a file in a child process, to find what only that shows.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_CONSTRUCTION_HPP_
#define TAKT_TOOLS_TAKT_CONSTRUCTION_HPP_

#include <string>
#include <vector>

#include "takt/containers/configuration/system_description.hpp"

namespace takt::tools {

/// The errors of the process's components, none if all could be constructed. No callback runs, and
/// no other process is discovered. A child that crashes, or takes too long, is an error too.
/// `is_whole`: it is the only process of its file.
/// Call it before this process has other threads.
std::vector<std::string> errors_of_construction(SystemDescription process, bool is_whole);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_CONSTRUCTION_HPP_
