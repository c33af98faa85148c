// Callbacks for changes of parameters of any node.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__PARAMETER_EVENT_HANDLER_HPP_
#define RCLCPP__PARAMETER_EVENT_HANDLER_HPP_

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "takt/entities/callback_list.hpp"
#include "takt/messages/rcl_interfaces/msg/parameter_event.hpp"

#include "rclcpp/create_publisher.hpp"

namespace rclcpp {

/// A handle keeps its callback registered until the handle is dropped.
struct ParameterCallbackHandle {
  RCLCPP_SMART_PTR_DEFINITIONS(ParameterCallbackHandle)
  using ParameterCallbackType = std::function<void(const Parameter&)>;
  std::string parameter_name, node_name;
  takt::detail::CallbackHandle<void(const rcl_interfaces::msg::ParameterEvent&)> handle;
};
struct ParameterEventCallbackHandle {
  RCLCPP_SMART_PTR_DEFINITIONS(ParameterEventCallbackHandle)
  using ParameterEventCallbackType =
      std::function<void(const rcl_interfaces::msg::ParameterEvent&)>;
  takt::detail::CallbackHandle<void(const rcl_interfaces::msg::ParameterEvent&)> handle;
};

/// A callback stays registered as long as its handle is kept; the one added last is called first.
/// Removing or dropping a handle waits for a call on another thread, unless that call waits for the
/// caller. Thread safety: every method from any thread. Real-time: no.
class ParameterEventHandler {
  using Event = rcl_interfaces::msg::ParameterEvent;

 public:
  RCLCPP_SMART_PTR_DEFINITIONS(ParameterEventHandler)
  using ParameterCallbackType = ParameterCallbackHandle::ParameterCallbackType;
  using ParameterEventCallbackType = ParameterEventCallbackHandle::ParameterEventCallbackType;

  template <class N>
  explicit ParameterEventHandler(N node, const QoS& qos = ParameterEventsQoS())
      : base_(node_interfaces::get_node_base_interface(node)),
        callbacks_(std::make_shared<Callbacks>()),
        subscription_(create_subscription<Event>(
            node, "/parameter_events", qos,
            [callbacks = callbacks_](const Event& event) { callbacks->call(event); })) {}

  /// `node_name` empty: this node's parameter.
  [[nodiscard]] ParameterCallbackHandle::SharedPtr add_parameter_callback(
      const std::string& parameter_name, ParameterCallbackType callback,
      const std::string& node_name = "");
  // These throw std::runtime_error for a handle of another handler, or one that was removed before.
  void remove_parameter_callback(ParameterCallbackHandle::SharedPtr handle);
  [[nodiscard]] ParameterEventCallbackHandle::SharedPtr add_parameter_event_callback(
      ParameterEventCallbackType callback);
  void remove_parameter_event_callback(ParameterEventCallbackHandle::SharedPtr handle);

  /// False: the event does not contain this parameter of this node.
  static bool get_parameter_from_event(const Event& event, Parameter& parameter,
                                       const std::string& parameter_name,
                                       const std::string& node_name = "");
  /// Throws std::runtime_error when the event does not contain the parameter.
  static Parameter get_parameter_from_event(const Event& event, const std::string& parameter_name,
                                            const std::string& node_name = "");
  static std::vector<Parameter> get_parameters_from_event(const Event& event);

 private:
  struct Callbacks {
    void call(const Event& event);
    takt::detail::CallbackList<void(const Event&)> of_parameters, of_events;
  };

  const node_interfaces::NodeBaseInterface::SharedPtr base_;
  const std::shared_ptr<Callbacks> callbacks_;
  const Subscription<Event>::SharedPtr subscription_;
};

}  // namespace rclcpp

#endif  // RCLCPP__PARAMETER_EVENT_HANDLER_HPP_
