// SPDX-License-Identifier: Apache-2.0
#include "run/process_state.hpp"

#include <utility>

namespace takt::tools {

ProcessState state_of(const Container& container, bool serves_itself) {
  ProcessState state{.serves_itself = serves_itself, .pending = container.pending()};
  for (const EndpointState& endpoint : container.endpoints()) {
    state.endpoints.push_back({{.topic = endpoint.topic,
                                .type = endpoint.type,
                                .is_writer = endpoint.is_writer,
                                .is_reliable = endpoint.reliability == Reliability::reliable,
                                .matched = endpoint.matched,
                                .messages = endpoint.messages,
                                .transport = endpoint.transport,
                                .uncopied = endpoint.uncopied,
                                .lost = endpoint.lost},
                               endpoint.id});
  }
  for (const LoadedComponent& component : container.components()) {
    state.nodes.push_back({component.name, component.type, component.where});
  }
  return state;
}

void add_topics(rt::Run& run, const std::string& process,
                const std::vector<ProcessState::Endpoint>& endpoints) {
  for (const ProcessState::Endpoint& endpoint : endpoints) {
    if (!endpoint.topic.starts_with('/')) continue;
    run.topics.push_back(endpoint);
    run.topics.back().process = process;
  }
}

void check_names(const std::vector<ProcessState>& processes) {
  std::vector<LoadedComponent> components;
  for (const ProcessState& process : processes) {
    for (const auto& node : process.nodes) {
      components.push_back({.name = node.at(0), .type = node.at(1), .where = node.at(2)});
    }
  }
  const std::vector<std::string> errors = name_conflicts(components);
  if (!errors.empty()) throw ConfigurationError(errors);
}

}  // namespace takt::tools
