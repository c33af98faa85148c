// Results as JSON, in the shape of docs/reference/results.schema.json.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_RESULT_JSON_HPP_
#define TAKT_TOOLS_TAKT_RESULT_JSON_HPP_

#include <nlohmann/json.hpp>
#include <string>

#include "takt/containers/result.hpp"

namespace takt::tools {

/// How a run was asked for.
struct RunDescription {
  std::string file, executor = "file", scheduler = "file", composition = "file", transport = "auto";
  int repeat = 0;
};

/// The whole document: version, machine, runs.
nlohmann::json result_document(nlohmann::json runs);
/// One entry of "runs". Histograms are lists of [bucket, count], see base/histogram.hpp.
nlohmann::json run_json(const RunDescription& description, const ProcessResult& process,
                        bool with_histograms);
/// The histogram that run_json wrote, or an empty one.
Histogram read_histogram(const nlohmann::json& latency);

/// Writes the document to the file, or to stdout for "-". Throws Error when it cannot.
void write_json(const nlohmann::json& document, const std::string& path);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_RESULT_JSON_HPP_
