// Constructs the components of a file in a child process, to find what only that shows.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_CONSTRUCTION_HPP_
#define TAKT_TOOLS_TAKT_CONSTRUCTION_HPP_

#include <string>
#include <vector>

#include "takt/containers/configuration/system_description.hpp"

namespace takt::tools {

/// Constructs the components of one process of a file, as `takt run` does, or all of the file in
/// one, and finds what the analysis refuses.
enum class Construct { process, file };

/// The errors of the components, none if all could be constructed. No callback runs, and
/// no other process is discovered. A child that crashes, or takes too long, is an error too.
/// Call it before this process has other threads.
std::vector<std::string> errors_of_construction(SystemDescription system, Construct what);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_CONSTRUCTION_HPP_
