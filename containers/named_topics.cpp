// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/named_topics.hpp"

#include <algorithm>
#include <set>

#include <fmt/format.h>

namespace takt {
namespace {

bool is_of_service(const Entity& entity) {
  return entity.kind() == EntityKind::service || entity.kind() == EntityKind::client;
}

}  // namespace

std::string service_of(std::string_view topic) {
  return std::string(topic.substr(2, topic.rfind('R') - 2));
}

std::string entry_of(const Entity& receiver) {
  return is_of_service(receiver) ? service_of(receiver.topic()) : receiver.topic();
}

std::vector<Error> wrong_topics(const SystemDescription& description,
                                std::span<const std::shared_ptr<Node>> nodes) {
  std::set<std::string> topics, services;
  for (const auto& node : nodes) {
    for (std::string& name : node->topics()) topics.insert(std::move(name));
    for (const auto& entity : node->entities())
      if (is_of_service(*entity)) services.insert(entry_of(*entity));
  }
  std::vector<Error> errors;
  for (const auto& [name, where] : description.topic_lines) {
    if (topics.contains(name)) continue;
    if (!services.contains(name)) {
      std::vector<std::string> names(topics.begin(), topics.end());
      names.insert(names.end(), services.begin(), services.end());
      errors.emplace_back(fmt::format("no component has the topic or service '{}'", name),
                          suggest(name, names), where);
      continue;
    }
    for (const WrittenKey& written : description.keys) {
      if (written.map != "a topic" || written.entry != name || written.key == "delay") continue;
      errors.emplace_back(
          fmt::format("'{}' is a service, which has no '{}' in a file", name, written.key),
          "write only its `delay`", written.where);
    }
  }
  return errors;
}

}  // namespace takt
