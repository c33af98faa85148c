// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/traced.hpp"

#include "takt/entities/subscription.hpp"

namespace takt {

void TracedCallback::begin(const Slot& slot) const noexcept {
  const bool is_near =
      entity_->kind() == EntityKind::subscription && slot.message->origin.writer == 0;
  points_->rclcpp_executor_execute(entity_);
  points_->callback_start(entity_, is_near ? 1 : 0);
}

void trace_made(const Entity& entity, const void* node, const std::string& node_name) {
  const Tracepoints* const points = tracepoints();
  if (points == nullptr) return;
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
      points->rclcpp_subscription_init(&entity, &entity);
      points->rclcpp_subscription_callback_added(&entity, &entity);
      points->callback_group_add_subscription(group, &entity);
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
  points->rclcpp_callback_register(&entity, (node_name + "/" + entity.name()).c_str());
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
