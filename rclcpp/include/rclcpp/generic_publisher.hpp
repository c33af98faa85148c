// Publishes encoded messages of a type that is named at run time.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__GENERIC_PUBLISHER_HPP_
#define RCLCPP__GENERIC_PUBLISHER_HPP_

#include <memory>
#include <string>

#include "rclcpp/macros.hpp"
#include "rclcpp/node_interfaces/node_base_interface.hpp"
#include "rclcpp/publisher_options.hpp"
#include "rclcpp/serialized_message.hpp"

namespace rclcpp {

/// Thread safety: every method from any thread. Real-time: as takt::GenericPublisher.
class GenericPublisher {
 public:
  RCLCPP_SMART_PTR_ALIASES_ONLY(GenericPublisher)
  GenericPublisher(node_interfaces::NodeBaseInterface& node, const std::string& topic,
                   const std::string& type, const QoS& qos, const PublisherOptions&)
      : takt_(node.takt_node()->create_generic_publisher(
            node.resolve_topic_or_service_name(topic, false), type, qos.to_takt(false))) {}
  virtual ~GenericPublisher() = default;

  void publish(const SerializedMessage& message) { takt_->publish(message.bytes()); }
  const char* get_topic_name() const { return takt_->topic().c_str(); }
  std::size_t get_subscription_count() const { return takt_->subscription_count(); }
  /// Always 0, as in rclcpp: subscriptions of this process get the serialized message, too.
  std::size_t get_intra_process_subscription_count() const { return 0; }

 private:
  const std::shared_ptr<takt::GenericPublisher> takt_;
};

}  // namespace rclcpp

#endif  // RCLCPP__GENERIC_PUBLISHER_HPP_
