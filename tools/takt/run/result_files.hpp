// Where the results of takt run and takt compare go: --json and --csv.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_RESULT_FILES_HPP_
#define TAKT_TOOLS_TAKT_RESULT_FILES_HPP_

#include <string>

#include <nlohmann/json.hpp>

namespace CLI {
class App;
}

namespace takt::tools {

struct ResultFiles {
  std::string json, csv;  // empty: none; "-": stdout

  /// `what` it writes, for the help.
  void add_options(CLI::App* command, const std::string& what);
  /// Throws Error if one cannot be written. Call it before a run, so that no results are lost.
  void check() const;
  bool any() const { return !json.empty() || !csv.empty(); }
  /// Then no table goes there.
  bool use_stdout() const { return json == "-" || csv == "-"; }
  void write(const nlohmann::json& document) const;
};

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_RESULT_FILES_HPP_
