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
#include "takt/messages/type_description.hpp"

#include "commands.hpp"
#include "embedded.hpp"
#include "graph/dynamic_message.hpp"
#include "run/result_json.hpp"

namespace takt::tools {
namespace {

using json = nlohmann::ordered_json;

constexpr std::string_view kSeparator = "---";

struct Options {
  std::string type, json_path;
};

[[noreturn]] void unknown(const std::string& type) {
  std::set<std::string> packages;
  std::vector<std::string> of_package;
  const std::string package = type.substr(0, type.find('/') + 1);
  for (const Definition& definition : kDefinitions) {
    const std::string name(definition.type);
    packages.insert(name.substr(0, name.find('/')));
    if (!package.empty() && name.starts_with(package)) of_package.push_back(name);
  }
  throw Error(fmt::format("takt does not know the interface {}", type),
              of_package.empty() ? fmt::format("it knows those of {}", fmt::join(packages, ", "))
                                 : suggest(type, of_package));
}

std::vector<std::string> lines_of(const std::string& type) {
  std::string text;
  const auto definition = std::find_if(kDefinitions.begin(), kDefinitions.end(),
                                       [&](const auto& known) { return known.type == type; });
  if (definition != kDefinitions.end()) {
    text = definition->text;
  } else if (const MessageType* known = known_type(type);
             known != nullptr && type.find("/msg/") != std::string::npos) {
    text = message_definition(*known);
    text.resize(std::min(text.size(), text.find("====")));
  } else {
    unknown(type);
  }
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// "geometry_msgs/Point[4] corners": a line that is no separator, and not empty.
struct Line {
  // `type` is the interface that the line is part of.
  Line(const std::string& text, const std::string& type) {
    const std::size_t space = text.find(' ');
    field_type = text.substr(0, space);
    const std::size_t begin = text.find_first_not_of(' ', space);
    const std::size_t end = text.find_first_of(" =", begin);
    name = text.substr(begin, end - begin);
    const std::size_t next = std::min(text.find_first_not_of(' ', end), text.size());
    is_constant = text.substr(next).starts_with('=');
    const std::size_t value_begin = text.find_first_not_of(" =", next);
    if (value_begin != std::string::npos) value = text.substr(value_begin);

    const std::string element = field_type.substr(0, field_type.find('['));
    if (const std::size_t slash = element.find('/'); slash != std::string::npos) {
      nested = element.substr(0, slash) + "/msg" + element.substr(element.rfind('/'));
    } else if (element[0] >= 'A' && element[0] <= 'Z') {
      nested =
          (element == "Header" ? "std_msgs" : type.substr(0, type.find('/'))) + "/msg/" + element;
    }
  }
  std::string field_type, name, value;
  std::string nested;  // the full name of the field's type, if it is a message
  bool is_constant = false;
};

void print(const std::string& type, std::size_t depth) {
  for (const std::string& text : lines_of(type)) {
    if (text.empty() && depth > 0) continue;
    fmt::print("{:\t>{}}{}\n", "", depth, text);
    if (text.empty() || text == kSeparator) continue;
    if (const std::string nested = Line(text, type).nested; !nested.empty()) {
      print(nested, depth + 1);
    }
  }
}

json to_json(const std::string& type) {
  const auto is_of = [&](const char* kind) { return type.find(kind) != std::string::npos; };
  std::vector<std::string> parts;
  if (is_of("/srv/")) parts = {"request", "response"};
  if (is_of("/action/")) parts = {"goal", "result", "feedback"};
  const json no_lines = {{"constants", json::array()}, {"fields", json::array()}};
  json result = {{"type", type}};
  for (const std::string& part : parts) result[part] = no_lines;
  if (parts.empty()) result.update(no_lines);
  auto part = parts.begin();
  for (const std::string& text : lines_of(type)) {
    if (text == kSeparator) ++part;
    if (text.empty() || text == kSeparator) continue;
    const Line line(text, type);
    json row = {{"name", line.name}, {"type", line.field_type}};
    if (!line.value.empty()) row[line.is_constant ? "value" : "default"] = line.value;
    if (!line.nested.empty()) row["definition"] = to_json(line.nested);
    (parts.empty() ? result : result[*part])[line.is_constant ? "constants" : "fields"].push_back(
        std::move(row));
  }
  return result;
}

void show(const Options& options) {
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
  show_command->add_option("--json", options->json_path,
                           "Also write the definition as JSON; - for stdout");
  show_command->callback([options] { show(*options); });
  command->footer(
      "Example:\n"
      "  takt interface show geometry_msgs/msg/Twist\n");
}
const Command registered("interface", "Shows definitions of messages, services and actions",
                         set_up);

}  // namespace
}  // namespace takt::tools
