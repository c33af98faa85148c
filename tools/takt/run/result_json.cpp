// SPDX-License-Identifier: Apache-2.0
#include "run/result_json.hpp"

#include "takt/base/output_file.hpp"
#include "takt/measuring/json_text.hpp"
#include "takt/measuring/output.hpp"

namespace takt::tools {

using nlohmann::json;

void write_json(const json& document, const std::string& path) {
  const std::string text = rt::json_text(document, 2) + "\n";
  if (path == "-") {
    rt::print("{}", text);
    return;
  }
  write_output(path, std::string(kTaktsJson) + text);
}

}  // namespace takt::tools
