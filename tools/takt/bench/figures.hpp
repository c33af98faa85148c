// Computes the metrics of takt bench.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_FIGURES_HPP_
#define TAKT_TOOLS_TAKT_FIGURES_HPP_

#include <cstdint>
#include <map>
#include <string>

#include "takt/base/histogram.hpp"
#include "takt/measuring/run.hpp"

#include "bench/experiments.hpp"

namespace takt::tools {

/// The metrics of one run, and its histogram.
struct Figures {
  std::map<std::string, double> values;
  Histogram latency;
};

Figures figures_of(const rt::Run& run, const Variant& variant);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_FIGURES_HPP_
