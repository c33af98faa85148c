// The runs of takt bench.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_MEASURE_HPP_
#define TAKT_TOOLS_TAKT_MEASURE_HPP_

#include <nlohmann/json.hpp>

#include "bench/experiments.hpp"
#include "bench/figures.hpp"
#include "run/end_signals.hpp"

namespace takt::tools {

/// `repeat` counts from 0; another one is another scenario of a simulation.
Figures measure(const Variant& variant, const BenchOptions& options, int repeat,
                const EndSignals& signals);

/// The results of `takt latency`, for the report: timers of each executor and the bare loop.
nlohmann::json jitter(const BenchOptions& options, const EndSignals& signals);

/// A timeline of the threads of a pool, for the report.
nlohmann::json timeline(const EndSignals& signals);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_MEASURE_HPP_
