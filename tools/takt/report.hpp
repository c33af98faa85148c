// Results as a page to look at.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_REPORT_HPP_
#define TAKT_TOOLS_TAKT_REPORT_HPP_

#include <string>

#include <nlohmann/json.hpp>

namespace takt::tools {

/// One HTML page, without any outside reference, of the figures that the document has data for:
/// "runs" of `takt compare`, "experiments" of `takt bench`. Drawn by bench/report.py, which is part
/// of this program, with Python's matplotlib. Throws Error when that is missing, or the file cannot
/// be written.
void write_report(const nlohmann::json& document, const std::string& path);

/// Throws the same Error when a report could not be drawn, before anything is measured for it.
void check_report(const std::string& path);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_REPORT_HPP_
