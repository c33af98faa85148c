// SPDX-License-Identifier: Apache-2.0
#include "takt/programs/description.hpp"

#include <cerrno>

#include <nlohmann/json.hpp>

#include "takt/base/error.hpp"
#include "takt/base/output_file.hpp"
#include "takt/entities/subscription.hpp"
#include "takt/measuring/json_text.hpp"
#include "takt/programs/results.hpp"

namespace takt::programs {
namespace {

using nlohmann::json;

// As tools/takt/analyze/program_nodes.cpp reads it.
json describe(const QoS& qos) {
  const auto& [depth, reliability, durability, liveliness, deadline, lifespan, lease] = qos;
  return {depth,
          reliability == Reliability::reliable,
          durability == Durability::transient_local,
          liveliness == Liveliness::manual_by_topic,
          deadline.count(),
          lifespan.count(),
          lease.count()};
}

json describe(const Entity& entity) {
  json result = {{"kind", std::string(to_string(entity.kind()))},
                 {"name", entity.name()},
                 {"group", entity.group()->name()}};
  if (entity.kind() == EntityKind::timer) result["period_ns"] = entity.period().count();
  if (entity.kind() == EntityKind::client) result["topic"] = entity.topic();
  if (const auto* subscription = dynamic_cast<const SubscriptionBase*>(&entity)) {
    result["topic"] = subscription->topic();
    result["qos"] = describe(subscription->qos());
  }
  return result;
}

json describe(const Node& node) {
  json groups = json::array(), callbacks = json::array(), topics = json::array();
  for (const auto& group : node.groups()) {
    groups.push_back({{"name", group->name()},
                      {"is_reentrant", group->type() == CallbackGroupType::Reentrant},
                      {"is_automatic", group->automatically_add_to_executor()},
                      {"is_served", !group->belongs_to(nullptr)}});
  }
  const std::string& name = node.fully_qualified_name();
  for (const auto& entity : node.entities()) {
    if (is_parameter_service(name, entity->kind(), entity->name())) continue;
    callbacks.push_back(describe(*entity));
  }
  for (const std::string& topic : node.topics()) {
    const auto publishing = node.publishing_callbacks(topic);
    if (!publishing) continue;
    for (const auto& [qos, loans] : publishing->publishers) {
      topics.push_back({{"topic", topic}, {"qos", describe(qos)}, {"loans", loans}});
    }
  }
  return {{"name", name}, {"groups", groups}, {"callbacks", callbacks}, {"publishes", topics}};
}

}  // namespace

void write_description(const std::vector<std::shared_ptr<const Node>>& nodes,
                       const std::vector<std::shared_ptr<const Node>>& others,
                       const std::string& path) {
  json described = {{"nodes", json::array()}, {"others", json::array()}};
  for (const auto& node : nodes) described["nodes"].push_back(describe(*node));
  for (const auto& node : others) described["others"].push_back(describe(*node));
  write_output(path, std::string(kTaktsJson) + rt::json_text(described) + '\n');
}

}  // namespace takt::programs
