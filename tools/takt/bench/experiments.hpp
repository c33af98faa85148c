// The experiments of takt bench: their systems and their metrics.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_EXPERIMENTS_HPP_
#define TAKT_TOOLS_TAKT_EXPERIMENTS_HPP_

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace takt::tools {

struct BenchOptions {
  std::string name, duration = "2s", report, json;
  std::vector<std::string> files;
  int repeat = 10;
};

/// One point of a curve, or one row of a table.
struct Variant {
  std::string series;
  double x = 0;
  std::string system;                // the text or the path of a configuration file
  std::vector<std::string> words;    // additional arguments
  std::int64_t message_bytes = 0;    // for goodput
  std::string missing;               // why it cannot run on this machine; empty: it can
  bool is_reference_system = false;  // its figures come from a trace
  bool is_ddsperf = false;           // runs ddsperf instead of Takt
  bool is_simulated = false;         // by takt simulate; each repeat is another scenario
};

/// The end of the name of a series that is simulated.
inline constexpr const char* kSimulated = ", simulated";

/// What a paper says: a metric of one series is less than that of another, at each x. Without the
/// other: it is 0 in each run.
struct Claim {
  std::string text, metric, less, more;
};

struct Experiment {
  std::string name, title, x_label;  // no label: a table, not curves
  std::vector<std::string> metrics;  // keys of the results, in this order
  std::function<std::vector<Variant>(const BenchOptions&)> variants;
  std::vector<std::string> deviations;  // from how the original was measured, as sentences
  bool is_of_paper = true;
  std::vector<Claim> claims = {};  // of papers on executors
};

const std::vector<Experiment>& experiments();

/// What a metric is called in reports, with its unit.
const std::map<std::string, std::string>& labels();

/// A system of one publisher, which writes the whole payload, and subscribers in separate nodes.
std::string publish_subscribe(std::int64_t bytes, std::int64_t period_us, int subscribers,
                              int work_us);

std::vector<std::string> joined(std::vector<std::string> words,
                                const std::vector<std::string>& more);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_EXPERIMENTS_HPP_
