// Subscriptions, over Takt's.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__SUBSCRIPTION_HPP_
#define RCLCPP__SUBSCRIPTION_HPP_

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "takt/entities/subscription.hpp"

#include "rclcpp/detail/qos_parameters.hpp"
#include "rclcpp/detail/refused.hpp"
#include "rclcpp/detail/subscription_callback.hpp"
#include "rclcpp/detail/topic_statistics.hpp"
#include "rclcpp/exceptions/exceptions.hpp"
#include "rclcpp/macros.hpp"
#include "rclcpp/network_flow_endpoint.hpp"
#include "rclcpp/node_interfaces/node_base_interface.hpp"
#include "rclcpp/qos.hpp"
#include "rclcpp/subscription_options.hpp"

namespace rclcpp {

/// Thread safety: every method from any thread. Real-time: as takt::Subscription.
class SubscriptionBase {
 public:
  RCLCPP_SMART_PTR_ALIASES_ONLY(SubscriptionBase)
  virtual ~SubscriptionBase() = default;
  SubscriptionBase(const SubscriptionBase&) = delete;
  SubscriptionBase& operator=(const SubscriptionBase&) = delete;

  const char* get_topic_name() const { return takt_->topic().c_str(); }
  QoS get_actual_qos() const { return QoS::from_takt(takt_->qos()); }
  /// Includes the publishers of this process.
  std::size_t get_publisher_count() const;
  bool is_serialized() const { return is_serialized_; }
  bool is_cft_enabled() const { return false; }
  void set_content_filter(const std::string&, const std::vector<std::string>& = {}) {
    refuse("content filters");
  }
  ContentFilterOptions get_content_filter() const { refuse("content filters"); }
  std::vector<NetworkFlowEndpoint> get_network_flow_endpoints() const {
    refuse("network flow endpoints");
  }
  RCLCPP_REFUSED_(get_subscription_handle, "rcl's handles")
  RCLCPP_REFUSED_(set_on_new_message_callback, "callbacks for what is new")
  RCLCPP_REFUSED_(clear_on_new_message_callback, "callbacks for what is new")
  bool take_serialized(SerializedMessage& message, MessageInfo& info);
  /// Calls the callback with this message, which must be one of the subscription's type.
  virtual void handle_message(std::shared_ptr<void>& message, const MessageInfo& info) = 0;
  virtual std::shared_ptr<void> create_message() = 0;
  void return_message(std::shared_ptr<void>& message) { message.reset(); }

  // For this library.
  const std::shared_ptr<takt::SubscriptionBase>& entity() const { return takt_; }

 protected:
  SubscriptionBase(node_interfaces::NodeBaseInterface& node,
                   std::shared_ptr<takt::SubscriptionBase> subscription,
                   const SubscriptionOptionsBase& options, bool is_serialized,
                   const std::shared_ptr<detail::TopicStatistics>& statistics = nullptr)
      : takt_(std::move(subscription)),
        events_(detail::make_events(*node.takt_node(), *takt_, options.event_callbacks,
                                    options.callback_group)),
        statistics_(detail::TopicStatistics::publish(statistics, node, options)),
        participant_(node.takt_node()->participant()),
        is_serialized_(is_serialized) {}
  [[noreturn]] static void refuse(const char* what) {
    throw exceptions::RCLError(RCL_RET_UNSUPPORTED, std::string("Takt has no ") + what);
  }

  const std::shared_ptr<takt::SubscriptionBase> takt_;

 private:
  const detail::Events events_;
  const std::shared_ptr<takt::Entity> statistics_;  // publishes the statistics
  const std::shared_ptr<takt::Participant> participant_;
  const bool is_serialized_;
};

/// M: a message, or a TypeAdapter.
template <class M, class Allocator = std::allocator<void>>
class Subscription : public SubscriptionBase {
  using Types = detail::Adapted<M>;

 public:
  RCLCPP_SMART_PTR_ALIASES_ONLY(Subscription)
  using SubscribedType = typename Types::Custom;
  using ROSMessageType = typename Types::Ros;

  template <class F>
  Subscription(node_interfaces::NodeBaseInterface& node, const std::string& topic, const QoS& qos,
               F callback, const SubscriptionOptionsWithAllocator<Allocator>& options,
               const detail::QosParameters& overrides)
      : Subscription(node, node.resolve_topic_or_service_name(topic, false), qos,
                     std::make_shared<Shared<F>>(std::move(callback),
                                                 detail::TopicStatistics::make(node, options)),
                     options, overrides) {}

  /// The oldest message, without an executor. False when there is none.
  bool take(ROSMessageType& message, MessageInfo& info) {
    takt::Slot slot;
    if (!takt_->take(slot)) return false;
    const takt::HeldMessage held(slot.message);
    if constexpr (!kIsBytes) message = *static_cast<const ROSMessageType*>(held->payload());
    info = MessageInfo(takt::MessageInfo(slot));
    return true;
  }
  bool take(SubscribedType& message, MessageInfo& info) requires(Types::kIsAdapted) {
    ROSMessageType taken;
    if (!take(taken, info)) return false;
    Types::Adapter::convert_to_custom(taken, message);
    return true;
  }
  void handle_message(std::shared_ptr<void>& message, const MessageInfo& info) override {
    handle_(std::static_pointer_cast<ROSMessageType>(message), info);
  }
  std::shared_ptr<void> create_message() override { return std::make_shared<ROSMessageType>(); }

 private:
  static constexpr bool kIsBytes = std::is_same_v<ROSMessageType, SerializedMessage>;
  using Handle = std::function<void(std::shared_ptr<ROSMessageType>, const MessageInfo&)>;

  /// The user's callback, shared by the executor and handle_message().
  template <class F>
  struct Shared {
    Shared(F function, std::shared_ptr<detail::TopicStatistics> measured)
        : callback(std::move(function)), statistics(std::move(measured)) {}
    F callback;
    const std::shared_ptr<detail::TopicStatistics> statistics;  // nullptr: not enabled
    template <class Argument>
    static constexpr bool kAlone = std::invocable<F&, Argument>;
    void call(std::shared_ptr<ROSMessageType> message, const MessageInfo& info) {
      const auto with = [&](auto&& argument) {
        using Argument = decltype(argument);
        if constexpr (kAlone<Argument>) {
          callback(std::forward<Argument>(argument));
        } else {
          callback(std::forward<Argument>(argument), info);
        }
      };
      if constexpr (detail::kLooks<F, ROSMessageType>) {
        with(std::as_const(*message));
      } else if constexpr (detail::kShares<F, ROSMessageType>) {
        with(std::shared_ptr<const ROSMessageType>(std::move(message)));
      } else if constexpr (detail::kChanges<F, ROSMessageType>) {
        with(std::make_shared<ROSMessageType>(*message));
      } else if constexpr (detail::kOwns<F, ROSMessageType>) {
        with(std::make_unique<ROSMessageType>(*message));
      } else {
        refuse("handle_message for such a callback");
      }
    }
  };

  template <class F>
  Subscription(node_interfaces::NodeBaseInterface& node, const std::string& topic, const QoS& qos,
               const std::shared_ptr<Shared<F>>& shared,
               const SubscriptionOptionsWithAllocator<Allocator>& options,
               const detail::QosParameters& overrides)
      : SubscriptionBase(
            node,
            make(*node.takt_node(), topic,
                 overrides.apply(qos, topic, options.qos_overriding_options, true).to_takt(true),
                 shared, options.callback_group),
            options, detail::kTakesBytes<F> && !detail::kHasForm<F, ROSMessageType>,
            shared->statistics),
        handle_([shared](std::shared_ptr<ROSMessageType> message, const MessageInfo& info) {
          shared->call(std::move(message), info);
        }) {}

  template <class F>
  static std::shared_ptr<takt::SubscriptionBase> make(takt::Node& node, const std::string& topic,
                                                      const takt::QoS& qos,
                                                      const std::shared_ptr<Shared<F>>& shared,
                                                      const std::shared_ptr<CallbackGroup>& group) {
    if constexpr (detail::kTakesBytes<F> && !detail::kHasForm<F, ROSMessageType>) {
      return node.create_generic_subscription(
          topic, takt::message_type<ROSMessageType>().name, qos,
          [shared](std::span<const std::byte> bytes, const takt::MessageInfo& info) {
            auto inner = detail::takt_callback<SerializedMessage>(Reference<F>{shared});
            auto message = std::make_unique<SerializedMessage>(bytes);
            if constexpr (detail::kLooks<F, SerializedMessage>) {
              inner(*message, info);
            } else {
              inner(std::move(message), info);
            }
          },
          group);
    } else {
      return node.create_subscription<ROSMessageType>(
          topic, qos, detail::adapted_callback<Types>(Reference<F>{shared}), group);
    }
  }
  /// Takes the same arguments as the user's callback; a copy of it copies only the pointer.
  template <class F>
  struct Reference {
    std::shared_ptr<Shared<F>> shared;
    void received(const takt::MessageInfo& info) const {
      if (shared->statistics != nullptr) shared->statistics->received(info);
    }
    template <class... Arguments>
    requires std::invocable<F&, Arguments...>
    void operator()(Arguments&&... arguments) {
      shared->callback(std::forward<Arguments>(arguments)...);
    }
  };

  const Handle handle_;
};

}  // namespace rclcpp

#endif  // RCLCPP__SUBSCRIPTION_HPP_
