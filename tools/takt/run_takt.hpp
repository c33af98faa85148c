// What main() runs.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_RUN_TAKT_HPP_
#define TAKT_TOOLS_TAKT_RUN_TAKT_HPP_

namespace takt::tools {

/// Runs the command that the words name, and returns its exit status; says on stderr what is wrong.
/// Throws what no memory is left to say, and what is not a std::exception.
int run_takt(int argc, char** argv);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_RUN_TAKT_HPP_
