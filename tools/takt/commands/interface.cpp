// takt interface: shows definitions of messages, services and actions.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <memory>
#include <set>
#include <sstream>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "takt/base/error.hpp"
#include "takt/measuring/output.hpp"
#include "takt/messages/message_types.hpp"
#include "takt/messages/type_description.hpp"

#include "commands.hpp"
#include "embedded.hpp"
#include "graph/definitions.hpp"
#include "graph/observer.hpp"
#include "outputs.hpp"
#include "run/result_json.hpp"

namespace takt::tools::interface_command {
namespace {

using json = nlohmann::ordered_json;

struct Options {
  std::string type, json_path;
  std::vector<std::string> libraries;
};

/// `user`: the interface that refers to it, if any.
[[noreturn]] void unknown(const std::string& type, const std::string& user) {
  const std::string package = type.substr(0, type.find('/'));
  std::set<std::string> packages;
  std::vector<std::string> of_package;
  for (const Definition& definition : kDefinitions) {
    packages.emplace(definition.type.substr(0, definition.type.find('/')));
    if (definition.type.starts_with(package + '/')) of_package.emplace_back(definition.type);
  }
  throw Error(fmt::format("takt does not know the interface {}{}", type,
                          user.empty() ? "" : ", to which " + user + " refers"),
              !of_package.empty()
                  ? suggest(type, of_package)
                  : fmt::format("name a library that registers it with --library, or a folder "
                                "with its definition in AMENT_PREFIX_PATH; without, takt knows "
                                "those of {}",
                                fmt::join(packages, ", ")));
}

std::vector<std::string> lines_of(const std::string& type, const std::string& user) {
  if (const auto lines = definition_lines(type)) return *lines;
  const MessageType* known = message_types().find(type);
  if (known == nullptr || type.find("/msg/") == std::string::npos) unknown(type, user);
  std::vector<std::string> lines;
  std::istringstream stream(message_definition(*known));
  for (std::string line; std::getline(stream, line) && !line.starts_with("====");) {
    lines.push_back(line);
  }
  return lines;
}

void print(const std::string& type, std::size_t depth, const std::string& user = {}) {
  for (const std::string& text : lines_of(type, user)) {
    if (text.empty() && depth > 0) continue;
    rt::print("{:\t>{}}{}\n", "", depth, text);
    if (text.empty() || text == kSeparator) continue;
    if (const std::string nested = DefinitionLine(text, type).nested; !nested.empty()) {
      print(nested, depth + 1, type);
    }
  }
}

json to_json(const std::string& type, const std::string& user = {}) {
  const auto is_of = [&](const char* kind) { return type.find(kind) != std::string::npos; };
  std::vector<std::string> parts;
  if (is_of("/srv/")) parts = {"request", "response"};
  if (is_of("/action/")) parts = {"goal", "result", "feedback"};
  const json no_lines = {{"constants", json::array()}, {"fields", json::array()}};
  json result = {{"type", type}};
  for (const std::string& part : parts) result[part] = no_lines;
  if (parts.empty()) result.update(no_lines);
  auto part = parts.begin();
  for (const std::string& text : lines_of(type, user)) {
    if (text == kSeparator) ++part;
    if (text.empty() || text == kSeparator) continue;
    const DefinitionLine line(text, type);
    json row = {{"name", line.name}, {"type", line.field_type}};
    if (!line.value.empty()) row[line.is_constant ? "value" : "default"] = line.value;
    if (!line.nested.empty()) row["definition"] = to_json(line.nested, type);
    (parts.empty() ? result : result[*part])[line.is_constant ? "constants" : "fields"].push_back(
        std::move(row));
  }
  return result;
}

void show(const Options& options) {
  for (const std::string& library : options.libraries) load_message_types(library);
  check_definition(options.type);
  if (options.json_path != "-") print(options.type, 0);
  if (!options.json_path.empty()) write_json(to_json(options.type), options.json_path);
}

void set_up(CLI::App* command) {
  command->require_subcommand(1);
  const auto options = std::make_shared<Options>();
  CLI::App* show_command = command->add_subcommand(
      "show", "Prints the definition of a message, service or action, and of all types in it");
  show_command->add_option("TYPE", options->type, "The type, for example geometry_msgs/msg/Twist")
      ->required();
  add_output(*show_command, "--json", options->json_path,
             "Also write the definition as JSON; - for stdout");
  add_library_option(*show_command, options->libraries);
  show_command->callback([options] { show(*options); });
  command->footer(
      "Example:\n"
      "  takt interface show geometry_msgs/msg/Twist\n");
}
const Command registered("interface", "Shows definitions of messages, services and actions",
                         set_up);

}  // namespace
}  // namespace takt::tools::interface_command
