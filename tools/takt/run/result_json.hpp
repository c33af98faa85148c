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

/// Throws the Error of write_json if the file (unless empty) cannot be written. Call it before a
/// run, so that no results are lost.
void check_writable(const std::string& path);

/// Of a time in floating-point microseconds, as the results have it: the inverse of rt::us.
Nanoseconds from_us(const nlohmann::json& us);

/// For a file that was opened, but could not be written: no usage error, so no Error.
std::runtime_error not_written(const std::string& what, const std::string& path);

/// Writes the text to the file. Throws not_written on failure.
void write_text(const std::string& text, const std::string& what, const std::string& path);

/// Writes the document to the file, or to stdout for "-". Throws Error on failure.
void write_json(const nlohmann::json& document, const std::string& path);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_RESULT_JSON_HPP_
