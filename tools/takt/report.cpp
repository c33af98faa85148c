// SPDX-License-Identifier: Apache-2.0
#include "report.hpp"

#include <fstream>
#include <stdexcept>

#include "takt/base/error.hpp"
#include "takt/measuring/json_text.hpp"
#include "takt/measuring/output.hpp"

#include "embedded.hpp"
#include "run/feed.hpp"

namespace takt::tools {
namespace {

constexpr const char* kPython = "/usr/bin/python3";  // Debian's Python finds Debian's matplotlib

}  // namespace

void check_report(const std::string& path) {
  if (feed({kPython, "-c", "import matplotlib"}, "") != 0) {
    throw Error("--report needs Python's matplotlib, which is not installed",
                "run `apt-get install python3-matplotlib`, or omit --report");
  }
  if (!std::ofstream(path, std::ios::app)) {
    throw Error("the report cannot be written", "choose a writable file", path);
  }
}

void write_report(const nlohmann::json& document, const std::string& path) {
  if (feed({kPython, "-c", kReportScript, path}, rt::json_text(document)) != 0) {
    throw std::runtime_error(path + ": the report was not drawn; see the message above");
  }
  rt::to_stderr("report: {}\n", path);
}

}  // namespace takt::tools
