// Runs this program in a child process.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_RUN_AGAIN_HPP_
#define TAKT_TOOLS_TAKT_RUN_AGAIN_HPP_

#include <stdexcept>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "run/end_signals.hpp"

namespace takt::tools {

/// Thrown when a signal ended a run before it was complete.
class Interrupted : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Runs `takt WORDS…` in a child process, so that each measurement starts from the same state, and
/// reads the JSON that it writes to stdout. Throws Error if it fails; its message is on stderr.
/// When a signal arrives, ends the child and throws Interrupted; a second signal kills the child.
/// The child does not receive Ctrl-C from the terminal.
nlohmann::json run_again(std::vector<std::string> words, const EndSignals& signals);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_RUN_AGAIN_HPP_
