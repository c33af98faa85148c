// SPDX-License-Identifier: Apache-2.0
#include "graph/parameter_file.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace takt::tools {
using document::NodeParameters;
using document::Value;

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
  std::vector<NodeParameters> sections = document::node_parameters(file, errors);
  std::stable_partition(sections.begin(), sections.end(),
                        [](const NodeParameters& section) { return section.is_wildcard(); });
  std::vector<Value> parameters;
  std::vector<std::string> others;
  for (NodeParameters& section : sections) {
    if (!document::is_for_node(section.node, node)) {
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
               others.empty() ? fmt::format("write '{}: {{{}: {{name: value}}}}'", node,
                                            document::kRosParameters)
                              : fmt::format("there are sections for {}", fmt::join(others, ", ")));
  }
  return parameters;
}

}  // namespace takt::tools
