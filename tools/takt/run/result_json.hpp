// Results as JSON with the schema docs/reference/results.schema.json.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_RESULT_JSON_HPP_
#define TAKT_TOOLS_TAKT_RESULT_JSON_HPP_

#include <stdexcept>
#include <string>

#include <nlohmann/json.hpp>

#include "takt/containers/result.hpp"

namespace takt::tools {

/// The whole document: version, machine, runs.
nlohmann::json result_document(nlohmann::json runs);

/// One process as an entry of "runs", without the options of the run. Histograms are lists of
/// [bucket, count], see base/histogram.hpp.
nlohmann::json process_json(const ProcessResult& process);
/// How many releases of timers were due in a run, and how many of them its callbacks were run for.
struct Releases {
  std::uint64_t due = 0, served = 0;
};
Releases releases_of(const nlohmann::json& run);
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
