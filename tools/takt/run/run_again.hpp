// Runs this program in a child process.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_RUN_AGAIN_HPP_
#define TAKT_TOOLS_TAKT_RUN_AGAIN_HPP_

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "takt/measuring/run.hpp"

#include "exit_status.hpp"
#include "run/end_signals.hpp"

namespace takt::tools {

/// Becomes this program with another command line, `takt WORDS…`. For a child, after fork.
[[noreturn]] void become_takt(std::vector<std::string> words);

/// Unless ROS_DOMAIN_ID is set, all runs of this process use a domain that others do not: processes
/// on the default domain would distort what it measures.
void use_own_domain();

/// What run_again was to run cannot run at all (kBadUsage); it has said why.
class Refused : public Error {
 public:
  using Error::Error;
};

/// Runs `takt WORDS…`, of which the second may be its file, in a child process, without the
/// variables TAKT_EXECUTOR, TAKT_PLACEMENT and TAKT_SCHEDULER, so that each measurement starts from
/// the same state, and reads the JSON that it writes to stdout. Throws Error if it fails, Refused
/// if its words or its file are wrong; its message is on stderr. When a signal arrives, ends the
/// child and throws Interrupted; a second signal kills the child. The child does not receive Ctrl-C
/// from the terminal. `is_quiet`: what it writes to stderr is shown only if it fails.
nlohmann::json run_again(std::vector<std::string> words, const EndSignals& signals,
                         bool is_quiet = false);

/// The same of `takt run`, whose words are to make it write its results to stdout.
rt::Run run_once(std::vector<std::string> words, const EndSignals& signals, bool is_quiet = false);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_RUN_AGAIN_HPP_
