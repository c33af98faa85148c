// Receives encoded messages of a type that is named at run time.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__GENERIC_SUBSCRIPTION_HPP_
#define RCLCPP__GENERIC_SUBSCRIPTION_HPP_

#include <memory>
#include <string>
#include <utility>

#include "rclcpp/subscription.hpp"

namespace rclcpp {

/// Thread safety: every method from any thread. Real-time: each message is copied.
class GenericSubscription : public SubscriptionBase {
 public:
  RCLCPP_SMART_PTR_ALIASES_ONLY(GenericSubscription)
  template <class F>
  GenericSubscription(node_interfaces::NodeBaseInterface& node, const std::string& topic,
                      const std::string& type, const QoS& qos, F&& callback,
                      const SubscriptionOptions& options)
      : SubscriptionBase(
            node,
            node.takt_node()->create_generic_subscription(
                node.resolve_topic_or_service_name(topic, false), type, qos.to_takt(true),
                [callback = std::decay_t<F>(std::forward<F>(callback))](
                    std::span<const std::byte> bytes, const takt::MessageInfo& info) mutable {
                  static_assert(detail::kTakesBytes<std::decay_t<F>>,
                                "a generic subscription cannot call this: see "
                                "docs/reference/rclcpp.md");
                  auto message = std::make_shared<SerializedMessage>(bytes);
                  if constexpr (detail::kLooks<std::decay_t<F>, SerializedMessage>) {
                    detail::call<std::decay_t<F>, const SerializedMessage&>(callback, *message,
                                                                            info);
                  } else {
                    detail::call(callback, std::move(message), info);
                  }
                },
                options.callback_group),
            options, true) {}

  void handle_message(std::shared_ptr<void>&, const MessageInfo&) override {
    refuse("handle_message of generic subscriptions");
  }
  std::shared_ptr<void> create_message() override { return std::make_shared<SerializedMessage>(); }
};

}  // namespace rclcpp

#endif  // RCLCPP__GENERIC_SUBSCRIPTION_HPP_
