// SPDX-License-Identifier: Apache-2.0
#include "run/container_json.hpp"

#include <utility>

namespace takt::tools {

using nlohmann::json;

json endpoints_json(const Container& container) {
  json result = json::array();
  for (const EndpointState& endpoint : container.endpoints()) {
    result.push_back({{"topic", endpoint.topic},
                      {"type", endpoint.type},
                      {"is_writer", endpoint.is_writer},
                      {"is_reliable", endpoint.reliability == Reliability::reliable},
                      {"matched", endpoint.matched},
                      {"messages", endpoint.messages},
                      {"transport", endpoint.transport},
                      {"uncopied", endpoint.uncopied},
                      {"lost", endpoint.lost},
                      {"id", endpoint.id}});
  }
  return result;
}

void add_topics(json& topics, const std::string& process, const json& endpoints) {
  for (json endpoint : endpoints) {
    if (!endpoint.at("topic").get_ref<const std::string&>().starts_with('/')) continue;
    endpoint["process"] = process;
    endpoint.erase("id");
    topics.push_back(std::move(endpoint));
  }
}

json nodes_json(const Container& container) {
  json result = json::array();
  for (const LoadedComponent& component : container.components()) {
    result.push_back({component.name, component.type, component.where});
  }
  return result;
}

void check_names(const std::vector<json>& processes) {
  std::vector<LoadedComponent> components;
  for (const json& process : processes) {
    for (const json& node : process.at("nodes")) {
      components.push_back({.name = node[0], .type = node[1], .where = node[2]});
    }
  }
  const std::vector<std::string> errors = name_conflicts(components);
  if (!errors.empty()) throw ConfigurationError(errors);
}

}  // namespace takt::tools
