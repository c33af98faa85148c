// A row of a comparison: what all its runs have measured.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_COMPARISON_HPP_
#define TAKT_TOOLS_TAKT_COMPARISON_HPP_

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "takt/base/histogram.hpp"
#include "takt/base/time.hpp"
#include "takt/measuring/process_json.hpp"

#include "run/setup.hpp"

namespace takt::tools {

/// All repeats of one chain, in all processes that it passes through.
struct ChainComparison {
  std::uint64_t instances = 0, misses = 0, aborted = 0;
  Histogram latency;
};

/// All repeats of one file under one executor and scheduler.
struct Comparison {
  std::string file, executor, placement = "file", scheduler, composition = "file";
  Setup setup;              // of the first run
  Histogram latency;        // of all subscriptions, over all repeats
  Histogram timer_latency;  // due → start
  std::uint64_t received = 0, lost = 0, dropped = 0, overruns = 0, deadline_misses = 0;
  rt::Releases releases;                          // of timers
  double seconds = 0;                             // of all repeats
  bool is_long = false;                           // one took longer than was asked for
  std::optional<std::uint64_t> late, too_late;    // of publishers whose periods are known
  std::map<std::string, ChainComparison> chains;  // by name
  // One value for each repeat; tables show the median.
  std::vector<double> cpu_percent, wakeups_per_s, pss_mb;
};

/// Adds a run of this row, which was to last so long.
void add_run(Comparison& row, const nlohmann::json& run, Nanoseconds asked);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_COMPARISON_HPP_
