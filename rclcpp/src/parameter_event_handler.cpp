// SPDX-License-Identifier: Apache-2.0
#include "rclcpp/parameter_event_handler.hpp"

#include <stdexcept>

#include "takt/base/same_owner.hpp"

namespace rclcpp {
namespace {

/// Those that are kept, without the lock.
template <class Handle>
std::vector<std::shared_ptr<Handle>> kept(std::mutex& mutex,
                                          std::list<std::weak_ptr<Handle>>& handles) {
  std::vector<std::shared_ptr<Handle>> result;
  const std::lock_guard lock(mutex);
  handles.remove_if([](const auto& handle) { return handle.expired(); });
  for (const auto& handle : handles) {
    if (auto alive = handle.lock()) result.push_back(std::move(alive));
  }
  return result;
}
template <class Handle>
void remove(std::mutex& mutex, std::list<std::weak_ptr<Handle>>& handles,
            const std::shared_ptr<Handle>& handle) {
  const std::lock_guard lock(mutex);
  const std::size_t before = handles.size();
  handles.remove_if([&](const auto& known) { return takt::is_same_owner(known, handle); });
  if (handles.size() == before) throw std::runtime_error("Callback doesn't exist");
}

}  // namespace

void ParameterEventHandler::Callbacks::call(const Event& event) {
  for (const auto& handle : kept(mutex, of_parameters)) {
    Parameter parameter;
    if (get_parameter_from_event(event, parameter, handle->parameter_name, handle->node_name)) {
      handle->callback(parameter);
    }
  }
  for (const auto& handle : kept(mutex, of_events)) handle->callback(event);
}

ParameterCallbackHandle::SharedPtr ParameterEventHandler::add_parameter_callback(
    const std::string& parameter_name, ParameterCallbackType callback,
    const std::string& node_name) {
  auto handle = std::make_shared<ParameterCallbackHandle>();
  handle->parameter_name = parameter_name;
  handle->node_name = node_name.empty()
                          ? base_->get_fully_qualified_name()
                          : base_->resolve_topic_or_service_name(node_name, true, true);
  handle->callback = std::move(callback);
  const std::lock_guard lock(callbacks_->mutex);
  callbacks_->of_parameters.push_front(handle);
  return handle;
}
void ParameterEventHandler::remove_parameter_callback(ParameterCallbackHandle::SharedPtr handle) {
  remove(callbacks_->mutex, callbacks_->of_parameters, handle);
}
ParameterEventCallbackHandle::SharedPtr ParameterEventHandler::add_parameter_event_callback(
    ParameterEventCallbackType callback) {
  auto handle = std::make_shared<ParameterEventCallbackHandle>();
  handle->callback = std::move(callback);
  const std::lock_guard lock(callbacks_->mutex);
  callbacks_->of_events.push_front(handle);
  return handle;
}
void ParameterEventHandler::remove_parameter_event_callback(
    ParameterEventCallbackHandle::SharedPtr handle) {
  remove(callbacks_->mutex, callbacks_->of_events, handle);
}

bool ParameterEventHandler::get_parameter_from_event(const Event& event, Parameter& parameter,
                                                     const std::string& parameter_name,
                                                     const std::string& node_name) {
  if (!node_name.empty() && event.node != node_name) return false;
  for (const auto* list : {&event.new_parameters, &event.changed_parameters}) {
    for (const auto& message : *list) {
      if (message.name != parameter_name) continue;
      parameter = Parameter::from_parameter_msg(message);
      return true;
    }
  }
  return false;
}
Parameter ParameterEventHandler::get_parameter_from_event(const Event& event,
                                                          const std::string& parameter_name,
                                                          const std::string& node_name) {
  Parameter parameter;
  if (!get_parameter_from_event(event, parameter, parameter_name, node_name)) {
    throw std::runtime_error("Parameter '" + parameter_name + "' of node '" + node_name +
                             "' is not part of parameter event");
  }
  return parameter;
}
std::vector<Parameter> ParameterEventHandler::get_parameters_from_event(const Event& event) {
  std::vector<Parameter> parameters;
  for (const auto* list : {&event.new_parameters, &event.changed_parameters}) {
    for (const auto& message : *list) parameters.push_back(Parameter::from_parameter_msg(message));
  }
  return parameters;
}

}  // namespace rclcpp
