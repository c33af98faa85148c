// ROS 2's tracepoints for LTTng: names and fields as ros2_tracing (tracetools 8.4) has them. LTTng
// includes this file several times.
// SPDX-License-Identifier: Apache-2.0
#undef LTTNG_UST_TRACEPOINT_PROVIDER
#define LTTNG_UST_TRACEPOINT_PROVIDER ros2
#undef LTTNG_UST_TRACEPOINT_INCLUDE
#define LTTNG_UST_TRACEPOINT_INCLUDE "ros2_tracepoints.h"
#if !defined(TAKT_TRACING_ROS2_TRACEPOINTS_H_) || defined(LTTNG_UST_TRACEPOINT_HEADER_MULTI_READ)
#define TAKT_TRACING_ROS2_TRACEPOINTS_H_

#include <lttng/tracepoint.h>

// clang-format off
LTTNG_UST_TRACEPOINT_EVENT(ros2, rcl_init, LTTNG_UST_TP_ARGS(const void*, context_handle, const char*, version),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, context_handle, context_handle)
    lttng_ust_field_string(version, version)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, rcl_node_init, LTTNG_UST_TP_ARGS(const void*, node_handle, const void*, rmw_handle, const char*, node_name, const char*, node_namespace),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, node_handle, node_handle)
    lttng_ust_field_integer_hex(const void*, rmw_handle, rmw_handle)
    lttng_ust_field_string(node_name, node_name)
    lttng_ust_field_string(namespace, node_namespace)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, rmw_publisher_init, LTTNG_UST_TP_ARGS(const void*, rmw_publisher_handle, const uint8_t*, gid),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, rmw_publisher_handle, rmw_publisher_handle)
    lttng_ust_field_array(uint8_t, gid, gid, 16)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, rcl_publisher_init, LTTNG_UST_TP_ARGS(const void*, publisher_handle, const void*, node_handle, const void*, rmw_publisher_handle, const char*, topic_name, size_t, queue_depth),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, publisher_handle, publisher_handle)
    lttng_ust_field_integer_hex(const void*, node_handle, node_handle)
    lttng_ust_field_integer_hex(const void*, rmw_publisher_handle, rmw_publisher_handle)
    lttng_ust_field_string(topic_name, topic_name)
    lttng_ust_field_integer(size_t, queue_depth, queue_depth)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_publish, LTTNG_UST_TP_ARGS(const void*, message),
  LTTNG_UST_TP_FIELDS(lttng_ust_field_integer_hex(const void*, message, message)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_intra_publish, LTTNG_UST_TP_ARGS(const void*, publisher_handle, const void*, message),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, publisher_handle, publisher_handle)
    lttng_ust_field_integer_hex(const void*, message, message)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, rcl_publish, LTTNG_UST_TP_ARGS(const void*, publisher_handle, const void*, message),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, publisher_handle, publisher_handle)
    lttng_ust_field_integer_hex(const void*, message, message)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, rmw_publish, LTTNG_UST_TP_ARGS(const void*, rmw_publisher_handle, const void*, message, int64_t, timestamp),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, rmw_publisher_handle, rmw_publisher_handle)
    lttng_ust_field_integer_hex(const void*, message, message)
    lttng_ust_field_integer(int64_t, timestamp, timestamp)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, rmw_subscription_init, LTTNG_UST_TP_ARGS(const void*, rmw_subscription_handle, const uint8_t*, gid),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, rmw_subscription_handle, rmw_subscription_handle)
    lttng_ust_field_array(uint8_t, gid, gid, 16)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, rcl_subscription_init, LTTNG_UST_TP_ARGS(const void*, subscription_handle, const void*, node_handle, const void*, rmw_subscription_handle, const char*, topic_name, size_t, queue_depth),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, subscription_handle, subscription_handle)
    lttng_ust_field_integer_hex(const void*, node_handle, node_handle)
    lttng_ust_field_integer_hex(const void*, rmw_subscription_handle, rmw_subscription_handle)
    lttng_ust_field_string(topic_name, topic_name)
    lttng_ust_field_integer(size_t, queue_depth, queue_depth)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_subscription_init, LTTNG_UST_TP_ARGS(const void*, subscription_handle, const void*, subscription),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, subscription_handle, subscription_handle)
    lttng_ust_field_integer_hex(const void*, subscription, subscription)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_subscription_callback_added, LTTNG_UST_TP_ARGS(const void*, subscription, const void*, callback),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, subscription, subscription)
    lttng_ust_field_integer_hex(const void*, callback, callback)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, rmw_take, LTTNG_UST_TP_ARGS(const void*, rmw_subscription_handle, const void*, message, int64_t, source_timestamp, int, taken),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, rmw_subscription_handle, rmw_subscription_handle)
    lttng_ust_field_integer_hex(const void*, message, message)
    lttng_ust_field_integer(int64_t, source_timestamp, source_timestamp)
    lttng_ust_field_integer(int, taken, taken)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, rcl_take, LTTNG_UST_TP_ARGS(const void*, message),
  LTTNG_UST_TP_FIELDS(lttng_ust_field_integer_hex(const void*, message, message)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_take, LTTNG_UST_TP_ARGS(const void*, message),
  LTTNG_UST_TP_FIELDS(lttng_ust_field_integer_hex(const void*, message, message)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, rcl_service_init, LTTNG_UST_TP_ARGS(const void*, service_handle, const void*, node_handle, const void*, rmw_service_handle, const char*, service_name),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, service_handle, service_handle)
    lttng_ust_field_integer_hex(const void*, node_handle, node_handle)
    lttng_ust_field_integer_hex(const void*, rmw_service_handle, rmw_service_handle)
    lttng_ust_field_string(service_name, service_name)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_service_callback_added, LTTNG_UST_TP_ARGS(const void*, service_handle, const void*, callback),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, service_handle, service_handle)
    lttng_ust_field_integer_hex(const void*, callback, callback)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, rcl_client_init, LTTNG_UST_TP_ARGS(const void*, client_handle, const void*, node_handle, const void*, rmw_client_handle, const char*, service_name),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, client_handle, client_handle)
    lttng_ust_field_integer_hex(const void*, node_handle, node_handle)
    lttng_ust_field_integer_hex(const void*, rmw_client_handle, rmw_client_handle)
    lttng_ust_field_string(service_name, service_name)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, rcl_timer_init, LTTNG_UST_TP_ARGS(const void*, timer_handle, int64_t, period),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, timer_handle, timer_handle)
    lttng_ust_field_integer(int64_t, period, period)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_timer_callback_added, LTTNG_UST_TP_ARGS(const void*, timer_handle, const void*, callback),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, timer_handle, timer_handle)
    lttng_ust_field_integer_hex(const void*, callback, callback)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_timer_link_node, LTTNG_UST_TP_ARGS(const void*, timer_handle, const void*, node_handle),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, timer_handle, timer_handle)
    lttng_ust_field_integer_hex(const void*, node_handle, node_handle)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_callback_register, LTTNG_UST_TP_ARGS(const void*, callback, const char*, symbol),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, callback, callback)
    lttng_ust_field_string(symbol, symbol)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, callback_start, LTTNG_UST_TP_ARGS(const void*, callback, int, is_intra_process),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, callback, callback)
    lttng_ust_field_integer(int, is_intra_process, is_intra_process)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, callback_end, LTTNG_UST_TP_ARGS(const void*, callback),
  LTTNG_UST_TP_FIELDS(lttng_ust_field_integer_hex(const void*, callback, callback)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, rcl_lifecycle_state_machine_init, LTTNG_UST_TP_ARGS(const void*, node_handle, const void*, state_machine),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, node_handle, node_handle)
    lttng_ust_field_integer_hex(const void*, state_machine, state_machine)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, rcl_lifecycle_transition, LTTNG_UST_TP_ARGS(const void*, state_machine, const char*, start_label, const char*, goal_label),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, state_machine, state_machine)
    lttng_ust_field_string(start_label, start_label)
    lttng_ust_field_string(goal_label, goal_label)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_executor_get_next_ready, LTTNG_UST_TP_ARGS(),
  LTTNG_UST_TP_FIELDS())
LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_executor_wait_for_work, LTTNG_UST_TP_ARGS(int64_t, timeout),
  LTTNG_UST_TP_FIELDS(lttng_ust_field_integer(int64_t, timeout, timeout)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_executor_execute, LTTNG_UST_TP_ARGS(const void*, handle),
  LTTNG_UST_TP_FIELDS(lttng_ust_field_integer_hex(const void*, handle, handle)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_construct_ring_buffer, LTTNG_UST_TP_ARGS(const void*, buffer, uint64_t, capacity),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, buffer, buffer)
    lttng_ust_field_integer(uint64_t, capacity, capacity)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_buffer_to_ipb, LTTNG_UST_TP_ARGS(const void*, buffer, const void*, ipb),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, buffer, buffer)
    lttng_ust_field_integer_hex(const void*, ipb, ipb)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_ipb_to_subscription, LTTNG_UST_TP_ARGS(const void*, ipb, const void*, subscription),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, ipb, ipb)
    lttng_ust_field_integer_hex(const void*, subscription, subscription)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_ring_buffer_enqueue, LTTNG_UST_TP_ARGS(const void*, buffer, uint64_t, index, uint64_t, size, int, overwritten),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, buffer, buffer)
    lttng_ust_field_integer(uint64_t, index, index)
    lttng_ust_field_integer(uint64_t, size, size)
    lttng_ust_field_integer(int, overwritten, overwritten)))
LTTNG_UST_TRACEPOINT_EVENT(ros2, rclcpp_ring_buffer_dequeue, LTTNG_UST_TP_ARGS(const void*, buffer, uint64_t, index, uint64_t, size),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, buffer, buffer)
    lttng_ust_field_integer(uint64_t, index, index)
    lttng_ust_field_integer(uint64_t, size, size)))
// clang-format on

#endif  // TAKT_TRACING_ROS2_TRACEPOINTS_H_
#include <lttng/tracepoint-event.h>
