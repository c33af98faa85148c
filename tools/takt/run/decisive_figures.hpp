// The figures of a run that people decide by.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_DECISIVE_FIGURES_HPP_
#define TAKT_TOOLS_TAKT_DECISIVE_FIGURES_HPP_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "takt/base/histogram.hpp"
#include "takt/measuring/run.hpp"

namespace takt::tools {

/// Called as in the table of takt compare; of a chain, with its name before: "joint p99".
struct Figure {
  std::string name;
  double value = 0;                      // not above 0: no ratio can be made of it
  std::optional<std::uint64_t> samples;  // that it rests on
  bool is_zero = false;                  // a count of nothing: `value` has half a count for it
  bool is_count = false;                 // to be compared only between runs of the same length
};

/// In the order of the table. What has no sample in this run is not among them.
std::vector<Figure> decisive_figures(const rt::Run& run);

/// In proportion within its bucket, so that two runs differ by what was measured: the limits of two
/// buckets, which are what tables show, are equal or 3 % apart.
double interpolated_us(const Histogram& histogram, double fraction);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_DECISIVE_FIGURES_HPP_
