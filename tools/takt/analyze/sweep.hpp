// The bounds of a system for several values of one key.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_SWEEP_HPP_
#define TAKT_TOOLS_TAKT_SWEEP_HPP_

#include <string>

#include <nlohmann/json.hpp>

#include "analyze/analyzed_file.hpp"

namespace takt::tools {

/// `range` is KEY=A..B: durations, integers or numbers. Ten values from A to B, both included.
/// Throws Error for another text, or if the file is bad with one of the values.
nlohmann::json sweep(const std::string& file, const AnalyzeOptions& options,
                     const std::string& range, bool prints);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_SWEEP_HPP_
