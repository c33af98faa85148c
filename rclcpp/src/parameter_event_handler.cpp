// SPDX-License-Identifier: Apache-2.0
#include "rclcpp/parameter_event_handler.hpp"

#include <stdexcept>
#include <utility>

#include "takt/base/logger.hpp"
#include "takt/messages/entries.hpp"

namespace rclcpp {
namespace {

template <class List, class Handle>
void remove(List& list, const std::shared_ptr<Handle>& handle) {
  if (handle == nullptr || !list.remove(handle->handle.get())) {
    throw std::runtime_error("Callback doesn't exist");
  }
}

}  // namespace

void ParameterEventHandler::Callbacks::call(const Event& event) {
  if (const std::string why = takt::why_too_long(event); !why.empty()) {
    static constinit takt::LogThrottle throttle(1);
    if (throttle.may_log()) takt::log(takt::LogLevel::warn, "/parameter_events: {}", why);
    return;
  }
  for (auto* list : {&of_parameters, &of_events}) {
    list->each(std::decay_t<decltype(*list)>::Order::last_added, [&](const auto& callback) {
      callback(event);
      return true;
    });
  }
}

ParameterCallbackHandle::SharedPtr ParameterEventHandler::add_parameter_callback(
    const std::string& parameter_name, ParameterCallbackType callback,
    const std::string& node_name) {
  auto handle = std::make_shared<ParameterCallbackHandle>();
  handle->parameter_name = parameter_name;
  handle->node_name = node_name.empty()
                          ? base_->get_fully_qualified_name()
                          : base_->resolve_topic_or_service_name(node_name, true, true);
  handle->handle =
      callbacks_->of_parameters.add_owned([name = parameter_name, node = handle->node_name,
                                           callback = std::move(callback)](const Event& event) {
        Parameter parameter;
        if (get_parameter_from_event(event, parameter, name, node)) callback(parameter);
      });
  return handle;
}
void ParameterEventHandler::remove_parameter_callback(ParameterCallbackHandle::SharedPtr handle) {
  remove(callbacks_->of_parameters, handle);
}
ParameterEventCallbackHandle::SharedPtr ParameterEventHandler::add_parameter_event_callback(
    ParameterEventCallbackType callback) {
  auto handle = std::make_shared<ParameterEventCallbackHandle>();
  handle->handle = callbacks_->of_events.add_owned(std::move(callback));
  return handle;
}
void ParameterEventHandler::remove_parameter_event_callback(
    ParameterEventCallbackHandle::SharedPtr handle) {
  remove(callbacks_->of_events, handle);
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
