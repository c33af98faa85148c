// Publishers, over Takt's.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__PUBLISHER_HPP_
#define RCLCPP__PUBLISHER_HPP_

#include <chrono>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "takt/entities/publisher.hpp"

#include "rclcpp/detail/qos_parameters.hpp"
#include "rclcpp/detail/refused.hpp"
#include "rclcpp/exceptions/exceptions.hpp"
#include "rclcpp/loaned_message.hpp"
#include "rclcpp/macros.hpp"
#include "rclcpp/network_flow_endpoint.hpp"
#include "rclcpp/node_interfaces/node_base_interface.hpp"
#include "rclcpp/publisher_options.hpp"
#include "rclcpp/qos.hpp"
#include "rclcpp/serialized_message.hpp"
#include "rclcpp/type_adapter.hpp"

namespace rclcpp {

/// Thread safety: every method from any thread. Real-time: as takt::Publisher.
class PublisherBase {
 public:
  RCLCPP_SMART_PTR_ALIASES_ONLY(PublisherBase)
  virtual ~PublisherBase() = default;
  PublisherBase(const PublisherBase&) = delete;
  PublisherBase& operator=(const PublisherBase&) = delete;

  const char* get_topic_name() const { return takt_->topic().c_str(); }
  std::size_t get_queue_size() const { return takt_->qos().depth; }
  std::size_t get_subscription_count() const { return takt_->subscription_count(); }
  std::size_t get_intra_process_subscription_count() const {
    return takt_->local_subscription_count();
  }
  QoS get_actual_qos() const { return QoS::from_takt(takt_->qos()); }
  bool can_loan_messages() const { return false; }
  bool assert_liveliness() const {
    takt_->assert_liveliness();
    asserted_->store(takt::Clock::steady().now());
    return true;
  }
  RCLCPP_REFUSED_(get_gid, "gids of publishers")
  RCLCPP_REFUSED_(get_publisher_handle, "rcl's handles")
  template <class Rep = std::int64_t, class Period = std::milli>
  bool wait_for_all_acked(
      std::chrono::duration<Rep, Period> timeout = std::chrono::duration<Rep, Period>(-1)) const {
    const auto ns = std::chrono::duration_cast<std::chrono::nanoseconds>(timeout);
    return takt_->wait_for_all_acked(
        ns < std::chrono::nanoseconds::zero() ? std::chrono::nanoseconds::max() : ns);
  }
  std::vector<NetworkFlowEndpoint> get_network_flow_endpoints() const {
    throw exceptions::RCLError(RCL_RET_UNSUPPORTED,
                               "the middleware tells no network flow endpoints");
  }

 protected:
  explicit PublisherBase(std::shared_ptr<takt::PublisherBase> publisher)
      : takt_(std::move(publisher)) {}

  const std::shared_ptr<takt::PublisherBase> takt_;
  const detail::SharedTime asserted_ =
      std::make_shared<std::atomic<takt::TimePoint>>(takt::Clock::steady().now());
};

/// M: a message, or a TypeAdapter.
template <class M, class Allocator = std::allocator<void>>
class Publisher : public PublisherBase {
  using Types = detail::Adapted<M>;

 public:
  RCLCPP_SMART_PTR_ALIASES_ONLY(Publisher)
  using PublishedType = typename Types::Custom;
  using ROSMessageType = typename Types::Ros;
  using MessageUniquePtr = std::unique_ptr<PublishedType>;

  Publisher(node_interfaces::NodeBaseInterface& node, const std::string& topic, const QoS& qos,
            const PublisherOptionsWithAllocator<Allocator>& options,
            const detail::QosParameters& overrides)
      : Publisher(node, node.resolve_topic_or_service_name(topic, false), qos, options, overrides,
                  nullptr) {}

  void publish(std::unique_ptr<PublishedType> message) {
    if constexpr (Types::kIsAdapted) {
      publish_adapted(*message);
    } else {
      typed_->publish(std::move(message));
    }
  }
  void publish(const PublishedType& message) {
    if constexpr (Types::kIsAdapted) {
      publish_adapted(message);
    } else {
      typed_->publish(message);
    }
  }
  /// A message with another deleter is copied.
  template <class D>
  requires(!std::is_same_v<D, std::default_delete<PublishedType>>) void publish(
      std::unique_ptr<PublishedType, D> message) {
    publish(*message);
  }
  // A publisher with a TypeAdapter also accepts the ROS message itself.
  template <class T>
  requires(Types::kIsAdapted&& std::is_same_v<T, ROSMessageType>) void publish(const T& message) {
    typed_->publish(message);
  }
  template <class T>
  requires(Types::kIsAdapted&& std::is_same_v<T, ROSMessageType>) void publish(
      std::unique_ptr<T> message) {
    typed_->publish(std::move(message));
  }
  void publish(const SerializedMessage& message) {
    auto decoded = borrow_loaned_message();
    if (!takt::message_type<ROSMessageType>().decode(message.bytes(), &decoded.get())) {
      exceptions::throw_from_rcl_error(RCL_RET_ERROR, "failed to publish serialized message");
    }
    decoded.publish_with(*typed_);
  }
  void publish(const rcl_serialized_message_t& message) {
    publish(SerializedMessage(std::as_bytes(std::span(message.buffer, message.buffer_length))));
  }
  void publish(LoanedMessage<ROSMessageType, Allocator>&& loan) {
    if (!loan.is_valid()) throw std::runtime_error("loaned message is not valid");
    loan.publish_with(*typed_);
  }
  LoanedMessage<ROSMessageType, Allocator> borrow_loaned_message() {
    return LoanedMessage<ROSMessageType, Allocator>(typed_->place_for_copy());
  }

 private:
  Publisher(node_interfaces::NodeBaseInterface& node, const std::string& topic, const QoS& qos,
            const PublisherOptionsWithAllocator<Allocator>& options,
            const detail::QosParameters& overrides, std::nullptr_t)
      : PublisherBase(node.takt_node()->create_publisher<ROSMessageType>(
            topic,
            overrides.apply(qos, topic, options.qos_overriding_options, false).to_takt(false))),
        typed_(static_cast<takt::Publisher<ROSMessageType>*>(takt_.get())),
        events_(detail::make_events(*node.takt_node(), *takt_, asserted_, options.event_callbacks,
                                    options.callback_group)) {}

  void publish_adapted(const PublishedType& custom) {
    auto message = borrow_loaned_message();
    Types::Adapter::convert_to_ros_message(custom, message.get());
    message.publish_with(*typed_);
  }

  takt::Publisher<ROSMessageType>* const typed_;
  const detail::Events events_;
};

}  // namespace rclcpp

#endif  // RCLCPP__PUBLISHER_HPP_
