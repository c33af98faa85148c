// A node's parameters, which its ParameterStore has.
// SPDX-License-Identifier: Apache-2.0
#include "takt/nodes/node.hpp"
#include "takt/nodes/node_state.hpp"

namespace takt {

ParameterValue Node::declare_value(std::string_view name, ParameterValue value,
                                   ParameterDescriptor descriptor,
                                   const detail::IntegerLimits& limits) {
  return state_->parameters.declare(name, std::move(value), std::move(descriptor), limits);
}

ParameterValue Node::parameter_value(std::string_view name) const {
  return state_->parameters.get(name);
}

ParameterValue Node::parameter_if_set(std::string_view name) const {
  return state_->parameters.get_if_set(name);
}

void Node::undeclare_parameter(std::string_view name) {
  state_->parameters.undeclare(name);
}

std::vector<Parameter> Node::get_parameters(const std::vector<std::string>& names) const {
  return state_->parameters.get(names);
}

Parameters Node::get_parameters_by_prefix(std::string_view prefix) const {
  return state_->parameters.get_by_prefix(prefix);
}

bool Node::has_parameter(std::string_view name) const {
  return state_->parameters.has(name);
}

ParameterDescriptor Node::describe_parameter(std::string_view name) const {
  return std::move(state_->parameters.describe({std::string(name)}).front());
}

std::vector<ParameterDescriptor> Node::describe_parameters(
    const std::vector<std::string>& names) const {
  return state_->parameters.describe(names);
}

ListParametersResult Node::list_parameters(const std::vector<std::string>& prefixes,
                                           std::uint64_t depth) const {
  return state_->parameters.list(prefixes, depth);
}

SetParametersResult Node::set_parameters_atomically(const Parameters& values) {
  return state_->parameters.set_atomically(values);
}

std::vector<SetParametersResult> Node::set_parameters(const std::vector<Parameter>& parameters) {
  return state_->parameters.set(parameters);
}

PreSetParametersHandle Node::add_pre_set_parameters_callback(PreSetParametersCallback callback) {
  return state_->parameters.add_pre_set(std::move(callback));
}

OnSetParametersHandle Node::add_on_set_parameters_callback(OnSetParametersCallback callback) {
  return state_->parameters.add_on_set(std::move(callback));
}

PostSetParametersHandle Node::add_post_set_parameters_callback(PostSetParametersCallback callback) {
  return state_->parameters.add_post_set(std::move(callback));
}

void Node::set_parameters_listener(ParametersListener listener) {
  state_->parameters.set_listener(std::move(listener));
}

std::vector<std::string> Node::unused_parameters() const {
  return state_->parameters.unused();
}

}  // namespace takt
