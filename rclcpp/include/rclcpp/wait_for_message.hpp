// Waits for one message, without an executor.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__WAIT_FOR_MESSAGE_HPP_
#define RCLCPP__WAIT_FOR_MESSAGE_HPP_

#include <chrono>
#include <memory>
#include <string>

#include "rclcpp/node.hpp"
#include "rclcpp/wait_set.hpp"

namespace rclcpp {

/// False: none came in time (negative: for ever), or the context was shut down. Throws
/// std::runtime_error when the subscription belongs to an executor.
template <class M, class Rep = std::int64_t, class Period = std::milli>
bool wait_for_message(
    M& message, const std::shared_ptr<Subscription<M>>& subscription, Context::SharedPtr context,
    std::chrono::duration<Rep, Period> time_to_wait = std::chrono::duration<Rep, Period>(-1)) {
  WaitSet wait_set({{subscription}}, {}, {}, {}, {}, {}, std::move(context));
  if (wait_set.wait(time_to_wait).kind() != WaitResultKind::Ready) return false;
  MessageInfo info;
  return subscription->take(message, info);
}
template <class M, class Rep = std::int64_t, class Period = std::milli>
bool wait_for_message(
    M& message, const std::shared_ptr<Node>& node, const std::string& topic,
    std::chrono::duration<Rep, Period> time_to_wait = std::chrono::duration<Rep, Period>(-1),
    const QoS& qos = SystemDefaultsQoS()) {
  SubscriptionOptions options;  // with a group that no executor takes
  options.callback_group = node->create_callback_group(CallbackGroupType::MutuallyExclusive, false);
  const auto subscription = node->create_subscription<M>(
      topic, qos, [](const M&) {}, options);
  return wait_for_message(message, subscription, node->get_node_base_interface()->get_context(),
                          time_to_wait);
}

}  // namespace rclcpp

#endif  // RCLCPP__WAIT_FOR_MESSAGE_HPP_
