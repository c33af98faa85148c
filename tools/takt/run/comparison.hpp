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

/// All repeats of one file under one executor and scheduler.
struct Comparison {
  std::string file, executor, placement = "file", scheduler, composition = "file";
  Setup setup;              // of the first run
  Histogram latency;        // of all subscriptions, over all repeats
  Histogram timer_latency;  // due → start
  CallbackCounts messages;  // of all but timers
  std::uint64_t lost = 0, overruns = 0;
  rt::Run::Releases releases;
  double seconds = 0;    // of all repeats
  bool is_long = false;  // one took longer than was asked for
  /// All repeats of each chain, by name, in all processes that it passes through.
  std::map<std::string, ChainStatistics> chains;
  // One value for each repeat; tables show the median.
  std::vector<double> cpu_percent, wakeups_per_s, pss_mb;
};

/// Adds a run of this row, which was to last so long.
void add_run(Comparison& row, const rt::Run& run, Nanoseconds asked);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_COMPARISON_HPP_
