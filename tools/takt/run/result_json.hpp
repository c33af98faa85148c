// Results as JSON, in the shape of docs/reference/results.schema.json.
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

/// One process as an entry of "runs", but for what was asked for. Histograms are lists of
/// [bucket, count], see base/histogram.hpp.
nlohmann::json process_json(const ProcessResult& process);
/// The histogram that run_json wrote, or an empty one.
Histogram read_histogram(const nlohmann::json& latency);

/// Throws the Error of write_json when the file, if one is named, could not be written: before a
/// run, so that none is lost for it.
void check_writable(const std::string& path);

/// For what was opened, and then could not be written: not a bad usage, so no Error.
std::runtime_error not_written(const std::string& what, const std::string& path);

/// Writes the document to the file, or to stdout for "-". Throws Error when it cannot.
void write_json(const nlohmann::json& document, const std::string& path);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_RESULT_JSON_HPP_
