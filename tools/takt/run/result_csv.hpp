// Results as comma-separated values.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_RESULT_CSV_HPP_
#define TAKT_TOOLS_TAKT_RESULT_CSV_HPP_

#include <span>
#include <string>
#include <vector>

#include "takt/measuring/run.hpp"

#include "run/verdicts.hpp"

namespace takt::tools {

/// One value in each line, with all that says what it is of, as spreadsheets, pandas and R read it:
/// of callbacks, chains, threads and processes, and ratios. docs/reference/command_line.md
/// describes the columns.
std::string result_csv(const std::vector<rt::Run>& runs, bool with_buckets,
                       std::span<const Compared> ratios = {});

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_RESULT_CSV_HPP_
