// Where the results of takt run and takt compare go: --json and --csv.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_RESULT_FILES_HPP_
#define TAKT_TOOLS_TAKT_RESULT_FILES_HPP_

#include <span>
#include <string>
#include <vector>

#include "takt/measuring/run.hpp"

#include "run/verdicts.hpp"

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
  /// The runs are in the document, too.
  void write(const nlohmann::json& document, const std::vector<rt::Run>& runs, bool with_buckets,
             std::span<const Compared> ratios = {}) const;
};

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_RESULT_FILES_HPP_
