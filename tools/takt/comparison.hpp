// The same system under several executors and schedulers: one row for each pair.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_COMPARISON_HPP_
#define TAKT_TOOLS_TAKT_COMPARISON_HPP_

#include <cstdint>
#include <string>
#include <vector>

#include "takt/base/histogram.hpp"

namespace takt::tools {

/// All repeats of one file under one executor and scheduler.
struct Comparison {
  std::string file, executor, scheduler;
  Histogram latency;        // of all subscriptions, over all repeats
  Histogram timer_latency;  // due → start
  std::uint64_t received = 0, expected = 0, lost = 0, dropped = 0, late = 0, too_late = 0,
                deadline_misses = 0;
  // One value a repeat; tables show the median.
  std::vector<double> cpu_percent, wakeups_per_s, pss_mb, p99_us;
};

/// A page without any outside reference: the table, and latency percentiles drawn on a logarithmic
/// scale. Throws Error when the file cannot be written.
void write_report(const std::vector<Comparison>& rows, const std::string& path);

double median(std::vector<double> values);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_COMPARISON_HPP_
