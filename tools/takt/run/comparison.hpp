// A row of a comparison: what all its runs have measured.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_COMPARISON_HPP_
#define TAKT_TOOLS_TAKT_COMPARISON_HPP_

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "takt/base/histogram.hpp"
#include "takt/base/time.hpp"
#include "takt/measuring/run.hpp"

#include "run/setup.hpp"

namespace takt::tools {

/// What runs have measured, added up.
struct Totals {
  Histogram latency;        // of all callbacks but timers
  Histogram timer_latency;  // due → start
  CallbackCounts messages;  // of all callbacks but timers
  std::uint64_t lost = 0, overruns = 0;
  double cpu_percent = 0, pss_kb = 0, wakeups = 0;
  /// By name: a chain through several processes is in a run once for each.
  std::map<std::string, ChainStatistics> chains;

  void add(const rt::Run& run);
};

/// All repeats of one file under one executor and scheduler.
struct Comparison {
  std::string file, executor, placement = "file", scheduler, composition = "file";
  Setup setup;  // of the first run
  Totals totals;
  rt::Run::Releases releases;
  double seconds = 0;       // of all repeats
  bool is_long = false;     // one took longer than was asked for
  bool is_refused = false;  // it cannot run the file
  // One value for each repeat; tables show the median.
  std::vector<double> cpu_percent, wakeups_per_s, pss_mb;
};

/// Adds a run of this row, which was to last so long.
void add_run(Comparison& row, const rt::Run& run, Nanoseconds asked);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_COMPARISON_HPP_
