// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/traced.hpp"

#include "takt/entities/subscription.hpp"

namespace takt {
namespace {

// rclcpp has a second callback in each subscription, for messages of its process, and tools tell by
// it how a message came. Any other number than addresses of entities will do.
const void* near_callback(const Entity& subscription) noexcept {
  return reinterpret_cast<const char*>(&subscription) + 1;
}

void trace_near(const Tracepoints& points, const SubscriptionBase& subscription,
                const std::string& name) {
  const Entity& entity = subscription;
  const IntraProcessReader* const buffer = &subscription;
  const void* const near = near_callback(entity);
  points.rclcpp_construct_ring_buffer(buffer, subscription.qos().depth);
  points.rclcpp_buffer_to_ipb(buffer, buffer);
  points.rclcpp_ipb_to_subscription(buffer, near);
  points.rclcpp_subscription_init(&entity, near);
  points.rclcpp_subscription_callback_added(near, near);
  points.rclcpp_callback_register(near, name.c_str());
}

}  // namespace

void TracedCallback::begin(const Slot& slot) noexcept {
  const bool is_near =
      entity_->kind() == EntityKind::subscription && slot.message->origin.writer == 0;
  points_->rclcpp_executor_execute(entity_);
  if (is_near) callback_ = near_callback(*entity_);
  points_->callback_start(callback_, is_near ? 1 : 0);
}

void trace_made(const Entity& entity, const void* node, const std::string& node_name) {
  const Tracepoints* const points = tracepoints();
  if (points == nullptr) return;
  const std::string name = node_name + "/" + entity.name();
  const char* const topic = entity.topic().c_str();
  const CallbackGroup* const group = entity.group().get();
  switch (entity.kind()) {
    case EntityKind::timer:
      points->rcl_timer_init(&entity, entity.period().count());
      points->rclcpp_timer_callback_added(&entity, &entity);
      points->rclcpp_timer_link_node(&entity, node);
      points->callback_group_add_timer(group, &entity);
      break;
    case EntityKind::subscription: {
      const auto* const subscription = dynamic_cast<const SubscriptionBase*>(&entity);
      const std::size_t depth = subscription != nullptr ? subscription->qos().depth : 0;
      points->rcl_subscription_init(&entity, node, &entity, topic, depth);
      points->callback_group_add_subscription(group, &entity);
      if (subscription != nullptr) trace_near(*points, *subscription, name);  // as rclcpp: first
      points->rclcpp_subscription_init(&entity, &entity);
      points->rclcpp_subscription_callback_added(&entity, &entity);
      break;
    }
    case EntityKind::service:
      points->rcl_service_init(&entity, node, &entity, topic);
      points->rclcpp_service_callback_added(&entity, &entity);
      points->callback_group_add_service(group, &entity);
      break;
    case EntityKind::client:
      points->rcl_client_init(&entity, node, &entity, topic);
      points->callback_group_add_client(group, &entity);
      break;
    default:
      break;
  }
  points->rclcpp_callback_register(&entity, name.c_str());
}

void trace_executor_made(const void* executor, std::size_t threads) {
  const Tracepoints* const points = tracepoints();
  if (points == nullptr) return;
  points->construct_executor(executor,
                             threads > 1 ? "multi_threaded_executor" : "single_threaded_executor");
}

void trace_group_added(const void* executor, const CallbackGroup& group) {
  const Tracepoints* const points = tracepoints();
  if (points == nullptr) return;
  const bool excludes = group.type() == CallbackGroupType::MutuallyExclusive;
  points->add_callback_group(executor, &group, excludes ? "mutually_exclusive" : "reentrant");
}

}  // namespace takt
