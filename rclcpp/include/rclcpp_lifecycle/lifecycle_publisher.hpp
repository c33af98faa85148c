// Publishes while its node is active.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP_LIFECYCLE__LIFECYCLE_PUBLISHER_HPP_
#define RCLCPP_LIFECYCLE__LIFECYCLE_PUBLISHER_HPP_

#include <atomic>
#include <memory>
#include <utility>

#include "rclcpp/logging.hpp"
#include "rclcpp/publisher.hpp"

namespace rclcpp_lifecycle {

/// Entities that a lifecycle node activates and deactivates with itself.
class ManagedEntityInterface {
 public:
  virtual ~ManagedEntityInterface() = default;
  virtual void on_activate() = 0;
  virtual void on_deactivate() = 0;
};
/// Thread safety: every method from any thread. Real-time: yes.
class SimpleManagedEntity : public ManagedEntityInterface {
 public:
  void on_activate() override { is_activated_.store(true); }
  void on_deactivate() override { is_activated_.store(false); }
  bool is_activated() const { return is_activated_.load(); }

 private:
  std::atomic<bool> is_activated_{false};
};

/// While it is not activated, messages are dropped, with one warning until the next activation; but
/// not those that are published by a pointer to rclcpp::Publisher, as controllers do. Thread safety
/// and real-time: as rclcpp::Publisher.
template <class M, class Allocator = std::allocator<void>>
class LifecyclePublisher : public SimpleManagedEntity, public rclcpp::Publisher<M, Allocator> {
  using Base = rclcpp::Publisher<M, Allocator>;

 public:
  RCLCPP_SMART_PTR_ALIASES_ONLY(LifecyclePublisher)
  using Base::Base;
  using Base::publish;
  using typename Base::PublishedType;
  using typename Base::ROSMessageType;

  void publish(std::unique_ptr<PublishedType> message) {
    if (may_publish()) Base::publish(std::move(message));
  }
  void publish(const PublishedType& message) {
    if (may_publish()) Base::publish(message);
  }
  void publish(rclcpp::LoanedMessage<ROSMessageType, Allocator>&& loan) {
    if (may_publish()) Base::publish(std::move(loan));
  }
  void on_activate() override {
    SimpleManagedEntity::on_activate();
    has_warned_.store(false);
  }

 private:
  bool may_publish() {
    if (is_activated()) return true;
    if (!has_warned_.exchange(true)) {
      RCLCPP_WARN(rclcpp::get_logger("LifecyclePublisher"),
                  "Trying to publish message on the topic '%s', but the publisher is not activated",
                  this->get_topic_name());
    }
    return false;
  }

  std::atomic<bool> has_warned_{false};
};

}  // namespace rclcpp_lifecycle

#endif  // RCLCPP_LIFECYCLE__LIFECYCLE_PUBLISHER_HPP_
