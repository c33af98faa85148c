// Files of results: reading and writing them.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_RESULT_JSON_HPP_
#define TAKT_TOOLS_TAKT_RESULT_JSON_HPP_

#include <stdexcept>
#include <string>

#include <nlohmann/json.hpp>

#include "takt/base/histogram.hpp"

namespace takt::tools {

/// Reads a histogram of run_json; returns an empty one if there is none.
Histogram read_histogram(const nlohmann::json& latency);

/// Of a time in floating-point microseconds, as the results have it: the inverse of rt::us.
Nanoseconds from_us(const nlohmann::json& us);

/// Writes the document to the file, as OutputFile does, or to stdout for "-".
void write_json(const nlohmann::json& document, const std::string& path);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_RESULT_JSON_HPP_
