// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <utility>

#include "takt/programs/program.hpp"

#include "arguments.hpp"
#include "rclcpp/exceptions/exceptions.hpp"
#include "rclcpp/expand_topic_or_service_name.hpp"
#include "rclcpp/node_interfaces/node_base_interface.hpp"

namespace rclcpp::node_interfaces {
namespace {

using detail::Arguments;
using detail::RemapRule;

// Limit: how long a program for rclcpp waits for a callback when it drops its entity. At it: the
// callback ends by itself, as in rclcpp. Seen: nothing.
constexpr std::chrono::milliseconds kMostDropWait = std::chrono::milliseconds(100);

/// Returns the expanded path if it is valid; else throws an error about `name`, as the user wrote
/// it.
std::string checked_path(std::string path, const std::string& name, bool is_service) {
  if (detail::is_path(path)) return path;
  constexpr const char* kWhy = "its parts must be names of letters, digits and '_'";
  if (is_service) throw exceptions::InvalidServiceNameError(name.c_str(), kWhy);
  throw exceptions::InvalidTopicNameError(name.c_str(), kWhy);
}

std::string remapped(const Arguments& own, const Arguments& all, RemapRule::Kind kind,
                     const std::string& node, const std::string& name) {
  const RemapRule* rule = detail::find_rule(own, all, kind, node);
  return rule != nullptr ? rule->to : name;
}

}  // namespace

std::shared_ptr<takt::Node> NodeBaseInterface::make_node(const std::string& in_code,
                                                         const std::string& space_in_code,
                                                         const MakeNode& make) {
  takt::NodeOptions how = options_.takt().value_or(takt::NodeOptions{});
  if (!detail::is_token(in_code)) {
    throw exceptions::InvalidNodeNameError(
        in_code.c_str(), "it must be of letters, digits and '_', not beginning with a digit");
  }
  if (how.name.empty()) {
    how.name = remapped(*own_, global(), RemapRule::Kind::node_name, in_code, in_code);
  }
  // A namespace rule for one node refers to the node by its remapped name.
  std::string space =
      remapped(*own_, global(), RemapRule::Kind::name_space, how.name, space_in_code);
  if (!how.name_space.empty()) space = how.name_space;
  if (!space.starts_with('/')) space.insert(0, "/");
  if (space != "/" && !detail::is_path(space)) {
    throw exceptions::InvalidNamespaceError(space.c_str(),
                                            "its parts must be names of letters, digits and '_'");
  }
  how.name_space = space == "/" ? "" : space;
  how.parameters = parameter_overrides(how.name_space + "/" + how.name);
  // The other overrides apply when their parameters are declared, see NodeParametersInterface.
  std::erase_if(how.parameters, [](const auto& given) { return given.first != takt::kUseSimTime; });
  how.allow_undeclared_parameters = options_.allow_undeclared_parameters();
  how.exact_parameter_types = true;
  how.drop_wait = kMostDropWait;
  if (how.participant == nullptr) how.participant = options_.context()->participant();
  if (how.time_source == nullptr) how.time_source = options_.context()->time_source();
  time_source_ = how.time_source;
  return make(in_code, how);
}

NodeBaseInterface::NodeBaseInterface(const std::string& name, const std::string& name_space,
                                     const NodeOptions& options, const MakeNode& make)
    : options_(options),
      own_(std::make_unique<const Arguments>(detail::parse_arguments(options.arguments()))) {
  if (!options_.context()->is_valid() && !options_.takt().has_value()) {
    throw exceptions::RCLInvalidArgument(
        RCL_RET_ERROR, "failed to create node '" + name + "': call rclcpp::init before");
  }
  node_ = make_node(name, name_space, make);
  name_space_ = node_->name_space().empty() ? "/" : node_->name_space();
  if (!options_.takt()) takt::programs::Program::instance().made(node_);
}
NodeBaseInterface::~NodeBaseInterface() {
  if (!options_.takt()) takt::programs::Program::instance().gone(*node_);
}

const Arguments& NodeBaseInterface::global() const {
  static const Arguments kNone;
  return options_.use_global_arguments() ? options_.context()->arguments() : kNone;
}

CallbackGroup::SharedPtr NodeBaseInterface::create_callback_group(
    CallbackGroupType type, bool automatically_add_to_executor) {
  return node_->create_callback_group("group_" + std::to_string(++groups_), type,
                                      automatically_add_to_executor);
}
bool NodeBaseInterface::callback_group_in_node(CallbackGroup::SharedPtr group) {
  const auto groups = node_->groups();
  return std::find(groups.begin(), groups.end(), group) != groups.end();
}
void NodeBaseInterface::for_each_callback_group(
    const std::function<void(CallbackGroup::SharedPtr)>& function) {
  for (const auto& group : node_->groups()) function(group);
}

std::string NodeBaseInterface::resolve_topic_or_service_name(const std::string& name,
                                                             bool is_service,
                                                             bool only_expand) const {
  std::string resolved = detail::expand_name(name, node_->name(), node_->name_space());
  if (!only_expand) {
    resolved = detail::remap_name(*own_, global(), resolved, is_service, node_->name(),
                                  node_->name_space());
  }
  return checked_path(std::move(resolved), name, is_service);
}

std::string NodeBaseInterface::next_timer_name(std::chrono::nanoseconds period) {
  const std::lock_guard lock(mutex_);
  const int number = ++timers_[period];
  return "timer_" + takt::to_string(period) + (number > 1 ? "_" + std::to_string(number) : "");
}

takt::Parameters NodeBaseInterface::parameter_overrides(const std::string& node) const {
  takt::Parameters overrides;
  for (const Arguments* arguments : {&global(), own_.get()}) {
    for (const detail::ParameterRule& rule : arguments->parameters) {
      if (detail::means_node(rule.node, node)) {
        overrides.insert_or_assign(rule.name, rule.value);
      }
    }
  }
  if (options_.takt().has_value()) {
    for (const auto& [name, value] : options_.takt()->parameters) {
      overrides.insert_or_assign(name, value);
    }
  }
  for (const Parameter& parameter : options_.parameter_overrides()) {
    overrides.insert_or_assign(parameter.get_name(), parameter.get_parameter_value().to_takt());
  }
  return overrides;
}

}  // namespace rclcpp::node_interfaces

std::string rclcpp::expand_topic_or_service_name(const std::string& name,
                                                 const std::string& node_name,
                                                 const std::string& name_space, bool is_service) {
  return node_interfaces::checked_path(
      detail::expand_name(name, node_name, name_space == "/" ? "" : name_space), name, is_service);
}
