// Files of the project that are embedded in the program, so that it works without them.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_EMBEDDED_HPP_
#define TAKT_TOOLS_TAKT_EMBEDDED_HPP_

#include <span>
#include <string_view>

namespace takt::tools {

extern const char* const kReportScript;       // bench/report.py
extern const char* const kReportPage;         // bench/report_page.py
extern const char* const kReportFigure;       // bench/report_figure.py
extern const char* const kPaperFigures;       // bench/paper_figures.json
extern const char* const kNav2Robot;          // examples/08_nav2/nav2.yaml
extern const char* const kReferenceSystem;    // bench/workloads/reference_system.yaml
extern const char* const kThreeChains;        // bench/workloads/three_chains.yaml
extern const char* const kCreate3Robot;       // examples/09_create3/create3.yaml
extern const char* const kConfigurationPage;  // docs/reference/configuration.md.in
extern const char* const kResultsPage;        // docs/reference/results.md.in
extern const char* const kResultsSchema;      // docs/reference/results.schema.json.in

/// A file: its path, and its text, of `takt new` with @NAME@ and @VERSION@.
struct Template {
  std::string_view path, text;
};
extern const std::span<const Template> kNewProject;  // tools/takt/new_project

extern const std::span<const Template> kCatalogue;  // examples/catalogue

/// An interface of ROS 2: "std_msgs/msg/Header", and its .msg, .srv or .action file.
struct Definition {
  std::string_view type, text;
};
extern const std::span<const Definition> kDefinitions;  // messages/packages

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_EMBEDDED_HPP_
