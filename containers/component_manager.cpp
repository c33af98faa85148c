// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/component_manager.hpp"

#include <algorithm>
#include <map>
#include <string_view>

#include <fmt/format.h>

#include "takt/containers/configuration/system_reader.hpp"
#include "takt/containers/container.hpp"
#include "takt/containers/set_callback_parameters.hpp"
#include "takt/containers/set_mode.hpp"
#include "takt/containers/structure.hpp"
#include "takt/messages/composition_interfaces/srv/list_nodes.hpp"
#include "takt/messages/composition_interfaces/srv/unload_node.hpp"
#include "takt/messages/entries.hpp"
#include "takt/ros2/lifecycle_services.hpp"
#include "takt/ros2/parameter_services.hpp"
#include "takt/ros2/type_description_service.hpp"

namespace takt {
namespace {

namespace ci = composition_interfaces::srv;
using document::List;
using document::Map;
using document::Value;

// Stands for the file name in errors of a request.
constexpr const char* kRequest = "request";
constexpr std::string_view kPlace = "request:1: ";

Value value_of(const std::string& name, const rcl_interfaces::msg::ParameterValue& message,
               document::Errors& errors) {
  Value value{name, 1, std::monostate()};
  const auto put = [&]<class T>(const T& content) {
    if constexpr (std::is_constructible_v<decltype(value.content), const T&>) {
      value.content = content;
    } else {
      List list;
      for (const typename T::value_type& item : content) list.push_back({name, 1, item});
      value.content = std::move(list);
    }
  };
  try {
    std::visit(put, from_message(message));
  } catch (const Error& error) {
    errors.add(1, fmt::format("'{}': {}", name, error.what()), "");
  }
  return value;
}

void put(Map& map, Value value) {
  map.values.push_back(std::move(value));
}

// "10" is rcl_interfaces/msg/Log's DEBUG.
std::string log_level(std::uint8_t level) {
  return level <= 10 ? "debug" : level <= 20 ? "info" : level <= 30 ? "warn" : "error";
}

// A value that the request itself gives takes precedence, as in ROS 2.
void put_first(Map& map, Value value) {
  const auto is_it = [&](const Value& other) { return other.name == value.name; };
  if (std::none_of(map.values.begin(), map.values.end(), is_it)) put(map, std::move(value));
}

void put_rule(const std::string& rule, Map& component, Map& remaps, document::Errors& errors) {
  const std::size_t middle = rule.find(":=");
  if (middle == std::string::npos || middle == 0) {
    errors.add(1, fmt::format("'{}' is not a remap rule", rule), "write from:=to");
    return;
  }
  const std::string from = rule.substr(0, middle), to = rule.substr(middle + 2);
  if (from == "__node" || from == "__name") {
    put_first(component, {"name", 1, to});
  } else if (from == "__ns") {
    put_first(component, {"namespace", 1, to});
  } else if (from.find(':') != from.npos) {
    errors.add(1,
               fmt::format("'{}': a rule for one node, or for topics or services alone, is not "
                           "known here",
                           rule),
               "write from:=to, as only this node gets the rule");
  } else {
    put_first(remaps, {from, 1, to});
  }
}

// Converts the request to the form of the configuration file, so that one reader checks both.
Value component_of(const ci::LoadNode::Request& request, document::Errors& errors) {
  Map component;
  put(component, {"component", 1, request.plugin_name});
  if (!request.node_name.empty()) put(component, {"name", 1, request.node_name});
  if (!request.node_namespace.empty()) put(component, {"namespace", 1, request.node_namespace});
  if (request.log_level != 0) put(component, {"log_level", 1, log_level(request.log_level)});
  Map remaps, parameters, groups;
  for (const std::string& rule : request.remap_rules) put_rule(rule, component, remaps, errors);
  for (const auto& [name, value] : request.parameters)
    put(parameters, value_of(name, value, errors));
  std::map<std::string, Map> by_group;
  for (const auto& [name, value] : request.extra_arguments) {
    const std::size_t key = name.rfind('.');
    if (name.starts_with("callback_group.") && key > name.find('.')) {
      const std::size_t begin = name.find('.') + 1;
      put(by_group[name.substr(begin, key - begin)], value_of(name.substr(key + 1), value, errors));
    } else if (name == "use_intra_process_comms" || name == "forward_global_arguments") {
      // Launch files send them. Messages of one process always go by pointer, and there are no
      // global arguments.
    } else if (name == "executor" || name == "library" || name == "on_exception") {
      put(component, value_of(name, value, errors));
    } else {
      errors.add(1, fmt::format("'{}' is not an extra argument", name),
                 "valid: executor, library, on_exception, callback_group.NAME.KEY; "
                 "use_intra_process_comms and forward_global_arguments have no effect");
    }
  }
  for (auto& [name, group] : by_group) put(groups, {name, 1, std::move(group)});
  if (!remaps.values.empty()) put(component, {"remap", 1, std::move(remaps)});
  if (!parameters.values.empty()) put(component, {"parameters", 1, std::move(parameters)});
  if (!groups.values.empty()) put(component, {"callback_groups", 1, std::move(groups)});
  return {"", 1, std::move(component)};
}

constexpr const char* kNoStdException = "a component threw an object that is not a std::exception";

// Removes the place from each error: a request has no lines.
std::string text_of(const std::exception& error) {
  const std::string_view whole = error.what();
  std::string text;
  for (std::size_t begin = 0; begin <= whole.size();) {
    const std::size_t end = std::min(whole.find(kPlace, begin), whole.size());
    text += whole.substr(begin, end - begin);
    begin = end + kPlace.size();
  }
  return text;
}

// Listing runs no code of a user, so the thread `container` serves it.
std::shared_ptr<Entity> list_service(Node& node, const Container& container) {
  return node.create_service<ci::ListNodes>(
      "~/_container/list_nodes",
      [&container](const auto&, auto& response) {
        for (const LoadedComponent& component : container.components()) {
          response.full_node_names.push_back(component.name);
          response.unique_ids.push_back(component.id);
        }
      },
      nullptr, rare_service());
}

// Structure and statistics are served by the executor `requests`: their callbacks may drop the last
// pointer to a node, whose destructor is code of a user.
std::shared_ptr<Entity> structure_service(Node& node, const Container& container,
                                          const std::shared_ptr<CallbackGroup>& group) {
  return node.create_service<GetStructure>(
      "~/_container/get_structure",
      [&container](const auto&, auto& response) { response.structure = structure_of(container); },
      group, rare_service());
}

std::shared_ptr<Entity> statistics_service(Node& node, const Container& container,
                                           const std::shared_ptr<CallbackGroup>& group) {
  return node.create_service<GetStatistics>(
      "~/get_statistics",
      [&container](const auto&, auto& response) { response = container.statistics(); }, group,
      rare_service());
}

std::shared_ptr<Entity> mode_service(Node& node, Container& container,
                                     const std::shared_ptr<CallbackGroup>& group) {
  return node.create_service<SetMode>(
      "~/set_mode",
      [&container](const auto& request, auto& response) {
        try {
          container.set_mode(request.mode);
          response.success = true;
        } catch (const std::exception& error) {
          response.reason = error.what();
        }
      },
      group, rare_service());
}

}  // namespace

ComponentDescription describe(const ci::LoadNode::Request& request,
                              const std::vector<std::string>& executors, const LoadPolicy& policy) {
  policy.check();
  if (const std::string why = why_too_long(request); !why.empty()) throw Error(why);
  document::Errors errors(kRequest);
  const Value component = component_of(request, errors);
  ComponentDescription description = read_component(component, executors, policy, errors);
  description.guest = Guest{policy.recordings};
  errors.throw_if_any();
  return description;
}

ComponentManager::ComponentManager(Container& container, const std::shared_ptr<Node>& node,
                                   Executor& requests, LoadPolicy policy, bool serves_parameters)
    : node_(node), requests_(requests), serves_parameters_(serves_parameters) {
  const std::shared_ptr<CallbackGroup> loading = make_group("loading");
  services_.push_back(node->create_service<ci::LoadNode>(
      "~/_container/load_node",
      [&container, policy = std::move(policy)](const auto& request, auto& response) {
        try {
          const LoadedComponent loaded =
              container.load(describe(request, container.executor_names(), policy));
          response.success = true;
          response.full_node_name = loaded.name;
          response.unique_id = loaded.id;
        } catch (const std::exception& error) {
          response.error_message = text_of(error);
        } catch (...) {
          response.error_message = kNoStdException;
        }
      },
      loading, ServiceOptions{.loans = 0}));
  services_.push_back(node->create_service<ci::UnloadNode>(
      "~/_container/unload_node",
      [&container](const auto& request, auto& response) {
        try {
          container.unload(request.unique_id);
          response.success = true;
        } catch (const std::exception& error) {
          response.error_message = text_of(error);
        } catch (...) {
          response.error_message = kNoStdException;
        }
      },
      loading, rare_service()));
  services_.push_back(list_service(*node, container));
  services_.push_back(structure_service(*node, container, make_group("get_structure")));
  if (!container.description().modes.empty())
    services_.push_back(mode_service(*node, container, make_group("set_mode")));
  observe(container);
  own_ = serve(node);
}

ComponentManager::ComponentManager(Container& container, const std::shared_ptr<Node>& node,
                                   Executor& requests)
    : node_(node), requests_(requests), serves_parameters_(false) {
  observe(container);
}

void ComponentManager::observe(Container& container) {
  services_.push_back(statistics_service(*node_, container, make_group("get_statistics")));
  services_.push_back(node_->create_service<TraceContainer>(
      "~/trace",
      [&container](const auto& request, auto& response) { response = container.trace(request); },
      make_group("trace"), rare_service()));
  services_.push_back(node_->create_service<SetCallbackParameters>(
      "~/set_callback_parameters",
      [&container](const auto& request, auto& response) {
        try {
          container.change_parameters(request.changes);
          response.success = true;
        } catch (const std::exception& error) {
          response.reason = error.what();
        } catch (...) {
          response.reason = kNoStdException;
        }
      },
      make_group("set_callback_parameters"), rare_service()));
}

std::shared_ptr<CallbackGroup> ComponentManager::make_group(std::string name) {
  auto group = node_->create_callback_group(std::move(name), CallbackGroupType::MutuallyExclusive,
                                            /*automatically_add_to_executor=*/false);
  requests_.add_callback_group(group, node_);
  return group;
}

std::shared_ptr<void> ComponentManager::serve(const std::shared_ptr<Node>& component) {
  struct Services {
    std::shared_ptr<Node> node;  // must outlive the services below
    std::unique_ptr<ParameterServices> parameters;
    std::unique_ptr<TypeDescriptionService> types;
    std::unique_ptr<LifecycleServices> lifecycle;
  };
  const auto lifecycle = std::dynamic_pointer_cast<LifecycleNode>(component);
  if (!serves_parameters_ && lifecycle == nullptr) return nullptr;
  const std::shared_ptr<CallbackGroup> group = make_group(fmt::format("node_{}", ++served_));
  auto services = std::make_shared<Services>();
  services->node = component;
  if (serves_parameters_) {
    services->parameters = std::make_unique<ParameterServices>(*component, *node_, group);
    services->types = std::make_unique<TypeDescriptionService>(*component, *node_);
  }
  if (lifecycle != nullptr) {
    services->lifecycle = std::make_unique<LifecycleServices>(*lifecycle, *node_, group);
  }
  return services;
}

}  // namespace takt
