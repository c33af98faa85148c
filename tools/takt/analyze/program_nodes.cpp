// SPDX-License-Identifier: Apache-2.0
#include "analyze/program_nodes.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "takt/messages/rcl_interfaces/srv/get_parameters.hpp"
#include "takt/messages/std_msgs/msg/string.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;
using Message = std_msgs::msg::String;
using Service = rcl_interfaces::srv::GetParameters;
using Groups = std::map<std::string, std::shared_ptr<CallbackGroup>>;

// As programs/description.cpp writes it.
QoS qos_of(const json& written) {
  QoS qos(written.at(0).get<std::size_t>());
  if (!written.at(1).get<bool>()) qos.best_effort();
  if (written.at(2).get<bool>()) qos.transient_local();
  if (written.at(3).get<bool>()) qos.liveliness(Liveliness::manual_by_topic);
  return qos.deadline(Nanoseconds(written.at(4)))
      .lifespan(Nanoseconds(written.at(5)))
      .liveliness_lease_duration(Nanoseconds(written.at(6)));
}

std::shared_ptr<void> make_callback(Node& node, const json& callback, const Groups& groups) {
  const std::string kind = callback.at("kind"), full = callback.at("name");
  const std::string name = full.substr(0, full.find('#'));  // the node numbers the second again
  const std::shared_ptr<CallbackGroup>& group = groups.at(callback.at("group"));
  if (kind == "timer") {
    return node.create_timer(
        name, Nanoseconds(callback.at("period_ns")), [] {}, group);
  }
  if (kind == "subscription") {
    return node.create_subscription<Message>(
        name, qos_of(callback.at("qos")), [](const Message&) {}, group);
  }
  if (kind == "service") {
    return node.create_service<Service>(
        name, [](const Service::Request&, Service::Response&) {}, group);
  }
  if (kind == "client") {
    // Its timer for late responses is one of the program's callbacks, if it has one.
    ClientOptions options;
    options.without_service = Nanoseconds::max();
    return node.create_client<Service>(name, options, group);
  }
  std::string valid = name.substr(std::min(name.find_first_not_of('/'), name.size()));
  std::replace(valid.begin(), valid.end(), '/', '_');  // it may be that of a topic's event
  return node.create_guard_condition(
      valid, [] {}, group);
}

bool gives_executor(const SystemDescription& file, const std::string& node,
                    const std::string& group) {
  return std::any_of(file.components.begin(), file.components.end(), [&](const auto& described) {
    const auto found = described.callback_groups.find(group);
    return full_name(described) == node && found != described.callback_groups.end() &&
           !found->second.executor.empty();
  });
}

}  // namespace

ProgramNodes::ProgramNodes(const json& description, const SystemDescription& file)
    : own_(executors().make("single_threaded", {})) {
  for (const json& node : description.at("nodes")) add(node, file);
  for (const json& node : description.at("others")) {
    std::set<std::string>& topics = others_[node.at("name")];
    for (const json& publisher : node.at("publishes")) topics.insert(publisher.at("topic"));
    for (const json& callback : node.at("callbacks")) {
      if (callback.at("kind") == "client") topics.insert(callback.at("topic"));
    }
  }
}

void ProgramNodes::add(const json& description, const SystemDescription& file) {
  const std::string name = description.at("name");
  const std::size_t slash = name.rfind('/');
  NodeOptions options;
  options.name_space = name.substr(0, slash);
  const auto node = std::make_shared<Node>(name.substr(slash + 1), options);
  Groups groups{{node->default_callback_group()->name(), node->default_callback_group()}};
  for (const json& group : description.at("groups")) {
    const std::string called = group.at("name");
    if (groups.contains(called)) continue;
    const bool is_reentrant = group.at("is_reentrant"), is_automatic = group.at("is_automatic");
    groups[called] = node->create_callback_group(
        called, is_reentrant ? CallbackGroupType::Reentrant : CallbackGroupType::MutuallyExclusive,
        is_automatic);
    handles_.push_back(groups[called]);
    if (is_automatic || !group.at("is_served") || gives_executor(file, name, called)) continue;
    own_groups_.push_back(name + "/" + called);
    own_->add_callback_group(groups[called], node);
  }
  for (const json& callback : description.at("callbacks")) {
    handles_.push_back(make_callback(*node, callback, groups));
  }
  for (const json& publisher : description.at("publishes")) {
    handles_.push_back(node->create_publisher<Message>(publisher.at("topic").get<std::string>(),
                                                       qos_of(publisher.at("qos")),
                                                       {.loans = publisher.at("loans")}));
  }
  nodes_.push_back(node);
}

std::shared_ptr<Node> ProgramNodes::find(const std::string& name) const {
  const auto found = std::find_if(nodes_.begin(), nodes_.end(), [&](const auto& node) {
    return node->fully_qualified_name() == name;
  });
  return found != nodes_.end() ? *found : nullptr;
}

}  // namespace takt::tools
