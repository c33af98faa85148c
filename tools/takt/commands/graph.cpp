// takt graph: the system of a file, or what runs, as a picture.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/error.hpp"
#include "takt/base/output_file.hpp"
#include "takt/measuring/output.hpp"

#include "commands.hpp"
#include "graph/domain_option.hpp"
#include "graph/service_call.hpp"
#include "outputs.hpp"
#include "picture/dot.hpp"
#include "picture/system_graph.hpp"
#include "run/result_json.hpp"
#include "table.hpp"

namespace takt::tools::graph_command {
namespace {

using nlohmann::json;

struct Options {
  DomainOption domain;
  std::vector<std::string> systems;
  std::string picture, json_path;
};

bool is_file(const std::string& word) {
  const std::filesystem::path path(word);
  std::error_code none;
  const auto status = std::filesystem::status(path, none);
  return (std::filesystem::exists(status) && !std::filesystem::is_directory(status)) ||
         path.extension() == ".yaml" || path.extension() == ".yml" || path.extension() == ".json";
}

RunningGraph graph_of(const Options& options) {
  const std::vector<std::string>& systems = options.systems;
  const auto file = std::find_if(systems.begin(), systems.end(), is_file);
  if (file == systems.end()) return running_graph(systems, options.domain.number());
  if (systems.size() > 1) {
    throw Error(fmt::format("'{}' is a file", *file), "draw it alone, or name containers only");
  }
  return {system_graph(*file), {}};
}

void print(const json& graph) {
  Table topics({"topic", "type", "rate_hz", "from", "to", "mismatch"});
  for (const json& topic : graph.at("topics")) {
    double rate = 0;
    std::string type;
    const auto nodes = [&](const char* side) {
      std::vector<std::string> names;
      for (const json& end : topic.at(side)) {
        names.push_back(end.at("node"));
        type = end.at("type");
        rate += end.value("rate_hz", 0.0);
      }
      return names.empty() ? "-" : fmt::format("{}", fmt::join(names, " "));
    };
    const std::string from = nodes("publishers"), to = nodes("subscriptions");
    std::string mismatch = from == "-" ? "no publisher" : to == "-" ? "no subscription" : "-";
    if (!topic.at("mismatches").empty()) mismatch = topic.at("mismatches")[0].at("why");
    topics.add({topic.at("name"), type, rate == 0 ? "-" : fmt::format("{:.4g}", rate), from, to,
                mismatch});
  }
  topics.print("topics");
}

bool is_kind(const std::string& path, const char* ending) {
  return path.ends_with(ending);
}

void run(const Options& options) {
  const std::string& picture = options.picture;
  if (!picture.empty() && !is_kind(picture, ".svg") && !is_kind(picture, ".html") &&
      !is_kind(picture, ".dot")) {
    throw Error(fmt::format("'{}' is not a kind of picture", picture),
                "end its name with .svg, .html or .dot");
  }
  if (is_kind(picture, ".svg") || is_kind(picture, ".html")) check_graphviz();
  const auto [graph, silent] = graph_of(options);
  if (!picture.empty()) {
    const std::string dot = dot_text(graph);
    write_output(picture, is_kind(picture, ".dot")   ? dot
                          : is_kind(picture, ".svg") ? svg_of(dot)
                                                     : picture_page(graph, svg_of(dot)));
    rt::to_stderr("picture: {}\n", picture);
  }
  if (!options.json_path.empty()) write_json(graph, options.json_path);
  if (picture.empty() && options.json_path != "-") print(graph);
  Caller::name_silent("container", silent, kListLimit);
}

void set_up(CLI::App* command) {
  const auto options = std::make_shared<Options>();
  command->add_option(
      "FILE|CONTAINER", options->systems,
      "A configuration file (its components are constructed, but do not run), or the "
      "names of running containers (default: all that is on the DDS domain)");
  options->domain.add_to(*command);
  add_output(*command, "-o,--output", options->picture,
             "The picture: a name that ends with .svg, .html (both need graphviz) or .dot "
             "(default: a table of the topics)");
  add_output(*command, "--json", options->json_path, "Also write the graph as JSON; - for stdout");
  command->footer(
      "Example:\n  takt graph robot.yaml -o robot.svg\n  takt graph robot -o now.svg\n");
  command->callback([options] { run(*options); });
}
const Command registered(
    "graph", "Draws processes, executors, nodes, topics and chains, of a file or as they run",
    set_up);

}  // namespace
}  // namespace takt::tools::graph_command
