// What takt doctor finds about the rights of the user who runs it.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_DOCTOR_RIGHTS_HPP_
#define TAKT_TOOLS_TAKT_DOCTOR_RIGHTS_HPP_

#include <string>

namespace takt::tools::doctor_command {

enum class Verdict { good, note, bad };

/// How it is fixed: what root's shell does, and what follows that, as "; log in again", or what
/// only a person can do.
struct Fix {
  std::string commands, rest;
};

/// The result of one check.
struct Finding {
  std::string what, source, found;
  Verdict verdict;
  std::string why;
  Fix fix;  // shown unless the verdict is good
};

// tools/takt/tests/remedies_test.py tries their fixes as a fresh user.
Finding realtime_policy();
Finding reservations();
Finding locked_memory();
Finding nice_limit();
Finding dma_latency();

}  // namespace takt::tools::doctor_command

#endif  // TAKT_TOOLS_TAKT_DOCTOR_RIGHTS_HPP_
