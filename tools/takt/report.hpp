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

/// Throws the same Error if a report cannot be written. Call it before the measurement, so that no
/// results are lost.
void check_report(const std::string& path);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_REPORT_HPP_
