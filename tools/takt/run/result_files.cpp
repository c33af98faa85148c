// SPDX-License-Identifier: Apache-2.0
#include "run/result_files.hpp"

#include "takt/base/error.hpp"
#include "takt/measuring/output.hpp"

#include "run/result_csv.hpp"
#include "run/result_json.hpp"

namespace takt::tools {

void ResultFiles::add_options(CLI::App* command, const std::string& what) {
  command->add_option("--json", json, "Also write " + what + " as JSON; - for stdout");
  command->add_option("--csv", csv,
                      "Also write " + what + " as comma-separated values; - for stdout");
}

void ResultFiles::check() const {
  if (json == "-" && csv == "-") {
    throw Error("--json and --csv cannot both be written to stdout", "give one of them a file");
  }
  check_writable(json);
  check_writable(csv);
}

void ResultFiles::write(const nlohmann::json& document) const {
  if (!json.empty()) write_json(document, json);
  if (csv == "-") {
    rt::print("{}", result_csv(document));
  } else if (!csv.empty()) {
    write_text(result_csv(document), "results", csv);
  }
}

}  // namespace takt::tools
