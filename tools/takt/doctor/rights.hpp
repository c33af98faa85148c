// What takt doctor finds about the rights of the user who runs it.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_DOCTOR_RIGHTS_HPP_
#define TAKT_TOOLS_TAKT_DOCTOR_RIGHTS_HPP_

#include <string>

namespace takt::tools::doctor_command {

enum class Verdict { good, note, bad };

/// The result of one check.
struct Finding {
  std::string what, source, found;
  Verdict verdict;
  std::string why;
  std::string fix;  // commands for root; shown unless the verdict is good
};

// tools/takt/tests/remedies_test.py tries their fixes as a fresh user.
Finding realtime_policy();
Finding reservations();
Finding locked_memory();
Finding nice_limit();
Finding dma_latency();

}  // namespace takt::tools::doctor_command

#endif  // TAKT_TOOLS_TAKT_DOCTOR_RIGHTS_HPP_
