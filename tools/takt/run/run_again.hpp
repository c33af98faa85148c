// This program again, in a process of its own.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_RUN_AGAIN_HPP_
#define TAKT_TOOLS_TAKT_RUN_AGAIN_HPP_

#include <stdexcept>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "run/end_signals.hpp"

namespace takt::tools {

/// A signal has ended a run before it was complete.
class Interrupted : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Runs `takt WORDS…`, so that what is measured begins afresh, and reads the JSON that it writes to
/// stdout. Throws Error when it does not end well; what it has said is on stderr then. Throws
/// Interrupted when one of the signals comes, after the run has ended on our word: a terminal's
/// Ctrl-C is for us alone. A second signal kills it.
nlohmann::json run_again(std::vector<std::string> words, const EndSignals& signals);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_RUN_AGAIN_HPP_
