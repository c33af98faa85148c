// What happens, told to a library of tracepoints, if the process has one.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_TRACEPOINTS_HPP_
#define TAKT_BASE_TRACEPOINTS_HPP_

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// ROS 2's tracepoints (ros2_tracing, tracetools 8.4), and CARET's, as far as Takt has what they
/// tell, with their names and arguments. A handle is the address of the publisher, entity or node:
/// one object of ours is several of ROS 2's, so these have the same address. Strings live as long
/// as the call. Thread safety: each function from any thread. Real-time: as the library has it.
/// LTTng's write to buffers of the CPU, without a lock, and drop what does not fit; a thread's
/// first tracepoint allocates, unless it has called `thread_begins`.
struct Tracepoints {
  /// Not one of ROS 2's: makes this thread ready.
  void (*thread_begins)();
  void (*rcl_init)(const void* context, const char* version);
  void (*rcl_node_init)(const void* node, const void* rmw, const char* name,
                        const char* name_space);
  void (*rmw_publisher_init)(const void* rmw, const std::uint8_t* gid);
  void (*rcl_publisher_init)(const void* publisher, const void* node, const void* rmw,
                             const char* topic, std::size_t depth);
  void (*rclcpp_publish)(const void* message);
  void (*rclcpp_intra_publish)(const void* publisher, const void* message);
  void (*rcl_publish)(const void* publisher, const void* message);
  void (*rmw_publish)(const void* rmw, const void* message, std::int64_t timestamp);
  void (*rmw_subscription_init)(const void* rmw, const std::uint8_t* gid);
  void (*rcl_subscription_init)(const void* subscription, const void* node, const void* rmw,
                                const char* topic, std::size_t depth);
  void (*rclcpp_subscription_init)(const void* handle, const void* subscription);
  void (*rclcpp_subscription_callback_added)(const void* subscription, const void* callback);
  void (*rmw_take)(const void* rmw, const void* message, std::int64_t source_timestamp, int taken);
  void (*rcl_take)(const void* message);
  void (*rclcpp_take)(const void* message);
  void (*rcl_service_init)(const void* service, const void* node, const void* rmw,
                           const char* name);
  void (*rclcpp_service_callback_added)(const void* service, const void* callback);
  void (*rcl_client_init)(const void* client, const void* node, const void* rmw, const char* name);
  void (*rcl_timer_init)(const void* timer, std::int64_t period);
  void (*rclcpp_timer_callback_added)(const void* timer, const void* callback);
  void (*rclcpp_timer_link_node)(const void* timer, const void* node);
  void (*rclcpp_callback_register)(const void* callback, const char* symbol);
  void (*callback_start)(const void* callback, int is_intra_process);
  void (*callback_end)(const void* callback);
  void (*rcl_lifecycle_state_machine_init)(const void* node, const void* state_machine);
  void (*rcl_lifecycle_transition)(const void* state_machine, const char* start, const char* goal);
  void (*rclcpp_executor_get_next_ready)();
  void (*rclcpp_executor_wait_for_work)(std::int64_t timeout);
  void (*rclcpp_executor_execute)(const void* handle);

  // Of CARET (caret_trace 0.7.3): which executor has which callbacks, and which message has which
  // time. It takes ROS 2's, too.
  void (*caret_init)(std::int64_t now, const char* distribution);
  void (*rmw_implementation)(const char* name);
  void (*construct_executor)(const void* executor, const char* type);
  void (*add_callback_group)(const void* executor, const void* group, const char* type);
  void (*callback_group_add_timer)(const void* group, const void* timer);
  void (*callback_group_add_subscription)(const void* group, const void* subscription);
  void (*callback_group_add_service)(const void* group, const void* service);
  void (*callback_group_add_client)(const void* group, const void* client);
  void (*dds_write)(const void* message);
  void (*dds_bind_addr_to_stamp)(const void* message, std::uint64_t timestamp);
};

namespace detail {
extern std::atomic<const Tracepoints*> loaded_tracepoints;
}

/// nullptr: nobody traces this process.
inline const Tracepoints* tracepoints() noexcept {
  return detail::loaded_tracepoints.load(std::memory_order_acquire);
}

/// Loads `takt/libtakt_lttng.so` from the folder of libtakt.so, once. Its threads are made by the
/// calling thread, and so have its attributes. Throws Error if it cannot be loaded.
/// Thread safety: from any thread. Real-time: no; it waits up to three seconds for LTTng's daemon.
void load_tracepoints();

}  // namespace takt

#endif  // TAKT_BASE_TRACEPOINTS_HPP_
