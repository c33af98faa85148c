// Writes results as an HTML page.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_REPORT_HPP_
#define TAKT_TOOLS_TAKT_REPORT_HPP_

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace takt::tools {

/// Writes a self-contained HTML page with figures of the document: "runs" of `takt compare`,
/// "experiments" of `takt bench`, "analyses" of `takt analyze`, "jitter" of `takt latency`. The
/// embedded script bench/report.py draws them with Python's matplotlib. `files`: configuration
/// files whose graphs are part of it, if graphviz is installed. Throws Error if matplotlib is
/// missing, or if the file cannot be written.
void write_report(nlohmann::json document, const std::string& path,
                  const std::vector<std::string>& files = {});

/// Draws the latencies of "runs" as a PDF, one column of a paper wide, and writes what is drawn
/// beside it. The same script and the same Errors.
void write_figure(const nlohmann::json& document, const std::string& path);
/// "f.csv" of "f.pdf".
std::string data_of_figure(const std::string& path);

/// Throw the same Errors if it cannot be drawn. Call it before the measurement, so that no results
/// are lost.
void check_report(const std::string& path);
void check_figure(const std::string& path);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_REPORT_HPP_
