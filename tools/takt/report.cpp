// SPDX-License-Identifier: Apache-2.0
#include "report.hpp"

#include <filesystem>
#include <fstream>
#include <stdexcept>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/logger.hpp"
#include "takt/base/output_file.hpp"
#include "takt/base/regular_file.hpp"
#include "takt/base/temporary.hpp"
#include "takt/measuring/json_text.hpp"
#include "takt/measuring/output.hpp"

#include "embedded.hpp"
#include "picture/dot.hpp"
#include "picture/system_graph.hpp"
#include "run/feed.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;

constexpr const char* kPython = "/usr/bin/python3";  // Debian's Python finds Debian's matplotlib

// Limit: bytes of a report. At it: the page is not written. Seen: the error.
constexpr std::size_t kMostReport = std::size_t{1} << 30;

// The script imports its parts as from files.
constexpr const char* kImportParts = R"(
import sys, types
for name, text in zip(("report_page", "report_figure"), sys.argv[2:]):
    part = sys.modules[name] = types.ModuleType(name)
    exec(text, part.__dict__)
)";

/// Python with these arguments, as the user of this process has it and nobody else: -I keeps the
/// folder it is started in, $PYTHONPATH and `pip --user` out of what is imported, and matplotlib
/// reads a `matplotlibrc` of the folder it is started in.
int python(const std::vector<std::string>& arguments, const std::string& input) {
  const TemporaryFolder folder;
  std::vector<std::string> command{"/usr/bin/env", "-u", "MATPLOTLIBRC", "-C", folder / ""};
  command.insert(command.end(), {"MPLCONFIGDIR=" + folder / "", kPython, "-I"});
  command.insert(command.end(), arguments.begin(), arguments.end());
  return feed(std::move(command), input);
}

std::vector<std::string> command_line() {
  std::ifstream file("/proc/self/cmdline", std::ios::binary);
  std::vector<std::string> words;
  for (std::string word; std::getline(file, word, '\0');) words.push_back(word);
  return words;
}

/// `path`: what the user calls it.
void draw(const json& document, const std::string& to, const std::string& path) {
  const std::string script = std::string(kImportParts) + kReportScript;
  if (python({"-c", script, to, kReportPage, kReportFigure}, rt::json_text(document)) != 0)
    throw std::runtime_error(path + ": it was not drawn; see the message above");
}

void check_drawing(const char* option, const std::string& path, const char* what,
                   const char* ending) {
  if (!path.ends_with(ending)) {
    throw Error(fmt::format("'{}' is no name of a {}", path, what),
                fmt::format("end it with {}", ending));
  }
  if (python({"-c", "import matplotlib"}, "") != 0) {
    throw Error(
        fmt::format("{} needs Python's matplotlib, which is not installed for all users", option),
        fmt::format("run `apt-get install python3-matplotlib` (one of `pip install --user` is not "
                    "looked for), or omit {}",
                    option));
  }
}

json graph_of(const std::string& file) {
  Logger::instance().flush();
  const LogLevel before = Logger::instance().level();
  Logger::instance().set_level(LogLevel::error);  // an analysis has nodes of these names, too
  json result{{"file", file}};
  try {
    check_graphviz();  // before components are constructed
    result["svg"] = svg_of(dot_text(system_graph(file)));
  } catch (const std::exception& error) {  // the measurements are worth a page without it
    result["missing"] = error.what();
  }
  Logger::instance().set_level(before);
  return result;
}

}  // namespace

void check_report(const std::string& path) {
  check_drawing("--report", path, "report, which is an HTML page", ".html");
}

void check_figure(const std::string& path) {
  check_drawing("--figure", path, "figure, which is a PDF", ".pdf");
}

std::string data_of_figure(const std::string& path) {
  return path.substr(0, path.rfind('.')) + ".csv";
}

void write_report(json document, const std::string& path, const std::vector<std::string>& files) {
  document["command"] = command_line();
  for (const std::string& file : files) document["graphs"].push_back(graph_of(file));
  const TemporaryFolder folder;
  draw(document, folder / "report.html", path);
  write_output(path, read_text(folder / "report.html", kMostReport));
  rt::to_stderr("report: {}\n", path);
}

void write_figure(const json& document, const std::string& path) {
  const TemporaryFolder folder;
  draw(document, folder / "figure.pdf", path);
  for (const std::string& name : {path, data_of_figure(path)}) {
    OutputFile file(name, OutputFile::Whose::unmarked);
    file.write(read_text(folder / (name == path ? "figure.pdf" : "figure.csv"), kMostReport));
    file.complete();
  }
  rt::to_stderr("figure: {}\n", path);
}

}  // namespace takt::tools
