// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/configuration/parameter_file.hpp"

#include <algorithm>
#include <cctype>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace takt::document {
namespace {

std::vector<std::string_view> words_of(std::string_view path) {
  std::vector<std::string_view> words;
  while (!path.empty()) {
    path.remove_prefix(1);  // the '/'
    const std::size_t end = std::min(path.find('/'), path.size());
    words.push_back(path.substr(0, end));
    path.remove_prefix(end);
  }
  return words;
}

bool is_name(std::string_view word) {
  if (word == "*" || word == "**") return true;
  const auto is_letter = [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; };
  return !word.empty() && std::isdigit(static_cast<unsigned char>(word[0])) == 0 &&
         std::all_of(word.begin(), word.end(), is_letter);
}

void add_parameters(const Map& map, const std::string& prefix, NodeParameters& section) {
  for (const Value& value : map.values) {
    const std::string name = prefix + value.name;
    if (const auto* inner = std::get_if<Map>(&value.content)) {
      add_parameters(*inner, name + ".", section);
      continue;
    }
    Value& parameter = section.parameters.emplace_back(value);
    parameter.name = name;
  }
}

void add_sections(const Map& map, const std::string& name, std::vector<NodeParameters>& sections,
                  Errors& errors) {
  for (const Value& value : map.values) {
    const auto* const inner = std::get_if<Map>(&value.content);
    if (value.name != kRosParameters) {
      if (inner == nullptr) {
        errors.add(value.line, fmt::format("'{}' has no {}", value.name, kRosParameters),
                   fmt::format("write '{}: {{{}: {{name: value}}}}'", value.name, kRosParameters));
        continue;
      }
      const char* slash = value.name.starts_with('/') ? "" : "/";
      add_sections(*inner, name + slash + value.name, sections, errors);
      continue;
    }
    const std::vector<std::string_view> words = words_of(name);
    if (words.empty() || !std::all_of(words.begin(), words.end(), is_name)) {
      errors.add(value.line, fmt::format("no node can have the name '{}'", name),
                 "write letters, digits and '_' between single '/', or '*' for any one name, and "
                 "'**' for any number of them");
      continue;
    }
    NodeParameters& section = sections.emplace_back(NodeParameters{name, value.line, {}});
    if (inner != nullptr) {
      add_parameters(*inner, "", section);
    } else if (!std::holds_alternative<std::monostate>(value.content)) {
      errors.add(value.line, fmt::format("the value of {} is no map", kRosParameters),
                 "write 'name: value' below it");
    }
  }
}

}  // namespace

std::vector<NodeParameters> node_parameters(const Value& file, Errors& errors) {
  std::vector<NodeParameters> sections;
  if (const auto* map = std::get_if<Map>(&file.content)) {
    add_sections(*map, "", sections, errors);
  } else {
    errors.add(file.line, "this is no file of parameters",
               fmt::format("write 'node: {{{}: {{name: value}}}}'", kRosParameters));
  }
  return sections;
}

bool is_for_node(std::string_view pattern, std::string_view node) {
  const std::vector<std::string_view> wanted = words_of(pattern), words = words_of(node);
  // Backtracking: if the words after the last '**' do not match, '**' takes one word more.
  std::size_t at = 0, after = SIZE_MAX, taken = 0;
  for (std::size_t word = 0; word < words.size();) {
    if (at < wanted.size() && wanted[at] == "**") {
      after = ++at;
      taken = word;
    } else if (at < wanted.size() && (wanted[at] == "*" || wanted[at] == words[word])) {
      ++at;
      ++word;
    } else if (after != SIZE_MAX) {
      at = after;
      word = ++taken;
    } else {
      return false;
    }
  }
  return std::all_of(wanted.begin() + static_cast<std::ptrdiff_t>(at), wanted.end(),
                     [](std::string_view one) { return one == "**"; });
}

std::vector<Value> parameters_of(const Value& file, const std::string& node, Errors& errors) {
  std::vector<NodeParameters> sections = node_parameters(file, errors);
  std::stable_partition(sections.begin(), sections.end(),
                        [](const NodeParameters& section) { return section.is_wildcard(); });
  std::vector<Value> parameters;
  std::vector<std::string> others;
  for (NodeParameters& section : sections) {
    if (!is_for_node(section.node, node)) {
      others.push_back(section.node);
      continue;
    }
    for (Value& value : section.parameters) {
      std::erase_if(parameters, [&](const Value& other) { return other.name == value.name; });
      parameters.push_back(std::move(value));
    }
  }
  if (others.size() == sections.size() && errors.size() == 0) {
    errors.add(file.line, fmt::format("no section is for node '{}'", node),
               others.empty()
                   ? fmt::format("write '{}: {{{}: {{name: value}}}}'", node, kRosParameters)
                   : fmt::format("there are sections for {}", fmt::join(others, ", ")));
  }
  return parameters;
}

bool is_parameter_file(const Value& root) {
  const auto* const map = std::get_if<Map>(&root.content);
  return map != nullptr &&
         std::any_of(map->values.begin(), map->values.end(), [](const Value& value) {
           return value.name == kRosParameters || is_parameter_file(value);
         });
}

}  // namespace takt::document
