// SPDX-License-Identifier: Apache-2.0
#include "graph/parameter_file.hpp"

#include <algorithm>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace takt::tools {
namespace {

using document::Value;

// Both are absolute: "/front/*" and "/front/lidar".
bool matches(std::string_view pattern, std::string_view node) {
  if (pattern.empty() || node.empty()) return pattern == node || pattern == "/**";
  const std::string_view first = pattern.substr(0, pattern.find('/', 1));
  const std::string_view rest = pattern.substr(first.size());
  const std::string_view name = node.substr(0, node.find('/', 1));
  const std::string_view others = node.substr(name.size());
  if (first == "/**") return matches(rest, node) || matches(pattern, others);
  return (first == "/*" || first == name) && matches(rest, others);
}

struct Section {
  std::string node;
  const Value* parameters;

  bool is_wildcard() const { return node.find('*') != std::string::npos; }
};

// `name` is that of the nodes, or of their namespace.
void add_sections(const Value& map, const std::string& name, std::vector<Section>& sections) {
  const auto* content = std::get_if<document::Map>(&map.content);
  if (content == nullptr) return;
  for (const Value& value : content->values) {
    if (value.name == kRosParameters) {
      sections.push_back({name, &value});
    } else {
      const char* slash = value.name.starts_with('/') ? "" : "/";
      add_sections(value, name + slash + value.name, sections);
    }
  }
}

void add_parameters(const Value& map, const std::string& prefix, std::vector<Value>& parameters) {
  const auto* content = std::get_if<document::Map>(&map.content);
  if (content == nullptr) return;
  for (Value value : content->values) {
    value.name = prefix + value.name;
    if (std::holds_alternative<document::Map>(value.content)) {
      add_parameters(value, value.name + ".", parameters);
      continue;
    }
    std::erase_if(parameters, [&](const Value& other) { return other.name == value.name; });
    parameters.push_back(std::move(value));
  }
}

}  // namespace

void add_parameter(nlohmann::ordered_json& parameters, const std::string& name,
                   nlohmann::ordered_json value) {
  const std::size_t dot = name.find('.');
  if (dot != std::string::npos) {
    const auto inner = parameters.emplace(name.substr(0, dot), nlohmann::ordered_json::object());
    // "a" may have a value of its own.
    if (inner.first->is_object()) {
      return add_parameter(*inner.first, name.substr(dot + 1), std::move(value));
    }
  }
  parameters[name] = std::move(value);
}

std::vector<Value> parameters_of(const Value& file, const std::string& node,
                                 document::Errors& errors) {
  std::vector<Section> sections;
  add_sections(file, "", sections);
  std::stable_partition(sections.begin(), sections.end(),
                        [](const Section& section) { return section.is_wildcard(); });
  std::vector<Value> parameters;
  std::vector<std::string> others;
  for (const Section& section : sections) {
    if (matches(section.node, node)) {
      add_parameters(*section.parameters, "", parameters);
    } else {
      others.push_back(section.node);
    }
  }
  if (others.size() == sections.size()) {
    errors.add(file.line, fmt::format("no section is for node '{}'", node),
               others.empty()
                   ? fmt::format("write '{}: {{{}: {{name: value}}}}'", node, kRosParameters)
                   : fmt::format("there are sections for {}", fmt::join(others, ", ")));
  }
  return parameters;
}

}  // namespace takt::tools
