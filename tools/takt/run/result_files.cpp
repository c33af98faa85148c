// SPDX-License-Identifier: Apache-2.0
#include "run/result_files.hpp"

#include "takt/base/error.hpp"
#include "takt/base/output_file.hpp"
#include "takt/measuring/output.hpp"

#include "outputs.hpp"
#include "run/result_csv.hpp"
#include "run/result_json.hpp"

namespace takt::tools {

void ResultFiles::add_options(CLI::App* command, const std::string& what) {
  add_output(*command, "--json", json, "Also write " + what + " as JSON; - for stdout");
  add_output(*command, "--csv", csv,
             "Also write " + what + " as comma-separated values; - for stdout");
}

void ResultFiles::check() const {
  if (json == "-" && csv == "-") {
    throw Error("--json and --csv cannot both be written to stdout", "give one of them a file");
  }
}

void ResultFiles::write(const nlohmann::json& document, const std::vector<rt::Run>& runs,
                        bool with_buckets, std::span<const Compared> ratios) const {
  if (!json.empty()) write_json(document, json);
  if (csv.empty()) return;
  const std::string text = result_csv(runs, with_buckets, ratios);
  if (csv == "-") return rt::print("{}", text);
  write_output(csv, text);
}

}  // namespace takt::tools
