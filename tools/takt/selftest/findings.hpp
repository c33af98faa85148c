// What takt selftest finds: figures of a run beside what its component has seen.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_FINDINGS_HPP_
#define TAKT_TOOLS_TAKT_FINDINGS_HPP_

#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "takt/measuring/run.hpp"

#include "run/trace.hpp"

namespace takt::tools {

/// One figure, by takt and by other means.
struct Finding {
  std::string figure, executor, transport;
  double shown = 0, independent = 0;
  double limit = 0;  // of the difference, in the unit of the figure
  bool is_right() const { return std::abs(shown - independent) <= limit; }
};
using Findings = std::vector<Finding>;

/// One run of the component takt::Stamps.
struct SelftestRun {
  std::string executor, transport;
  rt::Run run;
  Trace trace;           // of all its executions
  nlohmann::json books;  // what the component has written
};

/// Compares message by message, and the statistics with all of them. Where a thread was preempted
/// between takt's reading of the clock and the component's, the pair says nothing: it is discarded.
/// Returns how many were.
std::size_t compare(const SelftestRun& run, Findings& findings);

/// Throws if a figure is wrong or a run has failed, which ends the command with 1.
void require_right(const Findings& findings, std::size_t failed_runs);

/// The value that so many of the values do not exceed. Sorts them.
double percentile(std::vector<double>& values, double fraction);

/// What a reading of the clock costs.
double clock_reading_us();

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_FINDINGS_HPP_
