// The library libtakt_lttng: what Takt does, as ROS 2's and CARET's tracepoints for LTTng. A
// process loads it only if somebody asks, see base/tracepoints.hpp.
// SPDX-License-Identifier: Apache-2.0
#define LTTNG_UST_TRACEPOINT_CREATE_PROBES
#define LTTNG_UST_TRACEPOINT_DEFINE
#include <cstdint>
#include <ctime>

#include <lttng/ust-thread.h>

#include "takt/base/tracepoints.hpp"

#include "caret_tracepoints.h"
#include "ros2_tracepoints.h"

#define TAKT_EVENT(event)                                                         \
  .event = {[](auto... values) { lttng_ust_tracepoint(ros2, event, values...); }, \
            &lttng_ust_tracepoint_ros2___##event.state}

#define TAKT_CARET_EVENT(event)                                                         \
  .event = {[](auto... values) { lttng_ust_tracepoint(ros2_caret, event, values...); }, \
            &lttng_ust_tracepoint_ros2_caret___##event.state}

/// Of what happens once, at the begin: CARET records some of it again later, with the first time.
#define TAKT_CARET_INIT_EVENT(event)                                                           \
  .event = {[](auto... values) { lttng_ust_tracepoint(ros2_caret, event, values..., now()); }, \
            &lttng_ust_tracepoint_ros2_caret___##event.state}

static std::int64_t now() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

/// What libtakt looks for.
extern "C" __attribute__((visibility("default"))) const takt::Tracepoints* takt_tracepoints() {
  static constexpr takt::Tracepoints kTable{
      .thread_begins = &lttng_ust_init_thread,
      TAKT_EVENT(rcl_init),
      TAKT_EVENT(rcl_node_init),
      TAKT_EVENT(rmw_publisher_init),
      TAKT_EVENT(rcl_publisher_init),
      TAKT_EVENT(rclcpp_publish),
      TAKT_EVENT(rclcpp_intra_publish),
      TAKT_EVENT(rcl_publish),
      TAKT_EVENT(rmw_publish),
      TAKT_EVENT(rmw_subscription_init),
      TAKT_EVENT(rcl_subscription_init),
      TAKT_EVENT(rclcpp_subscription_init),
      TAKT_EVENT(rclcpp_subscription_callback_added),
      TAKT_EVENT(rmw_take),
      TAKT_EVENT(rcl_take),
      TAKT_EVENT(rclcpp_take),
      TAKT_EVENT(rcl_service_init),
      TAKT_EVENT(rclcpp_service_callback_added),
      TAKT_EVENT(rcl_client_init),
      TAKT_EVENT(rcl_timer_init),
      TAKT_EVENT(rclcpp_timer_callback_added),
      TAKT_EVENT(rclcpp_timer_link_node),
      TAKT_EVENT(rclcpp_callback_register),
      TAKT_EVENT(callback_start),
      TAKT_EVENT(callback_end),
      TAKT_EVENT(rcl_lifecycle_state_machine_init),
      TAKT_EVENT(rcl_lifecycle_transition),
      TAKT_EVENT(rclcpp_construct_ring_buffer),
      TAKT_EVENT(rclcpp_buffer_to_ipb),
      TAKT_EVENT(rclcpp_ipb_to_subscription),
      TAKT_EVENT(rclcpp_ring_buffer_enqueue),
      TAKT_EVENT(rclcpp_ring_buffer_dequeue),
      TAKT_EVENT(rclcpp_executor_get_next_ready),
      TAKT_EVENT(rclcpp_executor_wait_for_work),
      TAKT_EVENT(rclcpp_executor_execute),
      TAKT_CARET_EVENT(caret_init),
      TAKT_CARET_INIT_EVENT(rmw_implementation),
      TAKT_CARET_INIT_EVENT(construct_executor),
      TAKT_CARET_INIT_EVENT(add_callback_group),
      TAKT_CARET_INIT_EVENT(callback_group_add_timer),
      TAKT_CARET_INIT_EVENT(callback_group_add_subscription),
      TAKT_CARET_INIT_EVENT(callback_group_add_service),
      TAKT_CARET_INIT_EVENT(callback_group_add_client),
      TAKT_CARET_EVENT(dds_write),
      TAKT_CARET_EVENT(dds_bind_addr_to_stamp),
  };
  return &kTable;
}
