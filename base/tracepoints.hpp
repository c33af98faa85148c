// What happens, told to a library of tracepoints, if the process has one.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_TRACEPOINTS_HPP_
#define TAKT_BASE_TRACEPOINTS_HPP_

#include <atomic>
#include <cstddef>
#include <cstdint>

#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// An event that a tracer may record. While it does not, a call costs two loads.
/// Thread safety: from any thread. Real-time: as Tracepoints.
template <class... Values>
struct Tracepoint {
  void (*record)(Values...) = nullptr;
  const int* is_recorded = nullptr;  // of the tracer, which may change it at any time; 0: no

  // Relaxed: a session that has just begun may miss an event.
  bool is_on() const noexcept { return __atomic_load_n(is_recorded, __ATOMIC_RELAXED) != 0; }
  void operator()(Values... values) const {
    if (is_on()) [[unlikely]]
      record(values...);
  }
};

/// ROS 2's tracepoints (ros2_tracing, tracetools 8.4), and CARET's, as far as Takt has what they
/// tell, with their names; the arguments stand behind each. A handle is the address of the
/// publisher, entity or node: one object of ours is several of ROS 2's, so these have the same
/// address. Strings live as long as the call. Thread safety: each function from any thread.
/// Real-time: as the library has it. LTTng's write to buffers of the CPU, without a lock, and drop
/// what does not fit; a thread's first tracepoint allocates, unless it has called `thread_begins`.
struct Tracepoints {
  /// Not one of ROS 2's: makes this thread ready.
  void (*thread_begins)();
  Tracepoint<const void*, const char*> rcl_init;  // context, version
  Tracepoint<const void*, const void*, const char*, const char*>
      rcl_node_init;                                                // node, rmw, name, name_space
  Tracepoint<const void*, const std::uint8_t*> rmw_publisher_init;  // rmw, gid
  Tracepoint<const void*, const void*, const void*, const char*, std::size_t>
      rcl_publisher_init;                                     // publisher, node, rmw, topic, depth
  Tracepoint<const void*> rclcpp_publish;                     // message
  Tracepoint<const void*, const void*> rclcpp_intra_publish;  // publisher, message
  Tracepoint<const void*, const void*> rcl_publish;           // publisher, message
  Tracepoint<const void*, const void*, std::int64_t> rmw_publish;      // rmw, message, timestamp
  Tracepoint<const void*, const std::uint8_t*> rmw_subscription_init;  // rmw, gid
  Tracepoint<const void*, const void*, const void*, const char*, std::size_t>
      rcl_subscription_init;  // subscription, node, rmw, topic, depth
  Tracepoint<const void*, const void*> rclcpp_subscription_init;  // handle, subscription
  Tracepoint<const void*, const void*>
      rclcpp_subscription_callback_added;  // subscription, callback
  Tracepoint<const void*, const void*, std::int64_t, int>
      rmw_take;                         // rmw, message, source_timestamp, taken
  Tracepoint<const void*> rcl_take;     // message
  Tracepoint<const void*> rclcpp_take;  // message
  Tracepoint<const void*, const void*, const void*, const char*>
      rcl_service_init;                                                // service, node, rmw, name
  Tracepoint<const void*, const void*> rclcpp_service_callback_added;  // service, callback
  Tracepoint<const void*, const void*, const void*, const char*>
      rcl_client_init;                                               // client, node, rmw, name
  Tracepoint<const void*, std::int64_t> rcl_timer_init;              // timer, period
  Tracepoint<const void*, const void*> rclcpp_timer_callback_added;  // timer, callback
  Tracepoint<const void*, const void*> rclcpp_timer_link_node;       // timer, node
  Tracepoint<const void*, const char*> rclcpp_callback_register;     // callback, symbol
  Tracepoint<const void*, int> callback_start;                       // callback, is_intra_process
  Tracepoint<const void*> callback_end;                              // callback
  Tracepoint<const void*, const void*> rcl_lifecycle_state_machine_init;  // node, state_machine
  Tracepoint<const void*, const char*, const char*>
      rcl_lifecycle_transition;  // state_machine, start, goal
  Tracepoint<const void*, std::uint64_t> rclcpp_construct_ring_buffer;  // buffer, capacity
  Tracepoint<const void*, const void*> rclcpp_buffer_to_ipb;            // buffer, ipb
  Tracepoint<const void*, const void*> rclcpp_ipb_to_subscription;      // ipb, subscription
  Tracepoint<const void*, std::uint64_t, std::uint64_t, int>
      rclcpp_ring_buffer_enqueue;  // buffer, index, size, overwritten
  Tracepoint<const void*, std::uint64_t, std::uint64_t>
      rclcpp_ring_buffer_dequeue;  // buffer, index, size
  Tracepoint<> rclcpp_executor_get_next_ready;
  Tracepoint<std::int64_t> rclcpp_executor_wait_for_work;  // timeout
  Tracepoint<const void*> rclcpp_executor_execute;         // handle

  // Of CARET (caret_trace 0.7.3): which executor has which callbacks, and which message has which
  // time. It takes ROS 2's, too.
  Tracepoint<std::int64_t, const char*> caret_init;                      // now, distribution
  Tracepoint<const char*> rmw_implementation;                            // name
  Tracepoint<const void*, const char*> construct_executor;               // executor, type
  Tracepoint<const void*, const void*, const char*> add_callback_group;  // executor, group, type
  Tracepoint<const void*, const void*> callback_group_add_timer;         // group, timer
  Tracepoint<const void*, const void*> callback_group_add_subscription;  // group, subscription
  Tracepoint<const void*, const void*> callback_group_add_service;       // group, service
  Tracepoint<const void*, const void*> callback_group_add_client;        // group, client
  Tracepoint<const void*> dds_write;                                     // message
  Tracepoint<const void*, std::uint64_t> dds_bind_addr_to_stamp;         // message, timestamp

  /// Whether anybody records a part of what a publisher, a subscription that takes a message, or
  /// the begin of a callback tells.
  bool records_messages() const noexcept {
    return rclcpp_intra_publish.is_on() || rclcpp_publish.is_on() || rcl_publish.is_on() ||
           rmw_publish.is_on() || dds_write.is_on() || dds_bind_addr_to_stamp.is_on() ||
           rclcpp_ring_buffer_enqueue.is_on();
  }
  bool records_takes() const noexcept {
    return rclcpp_ring_buffer_dequeue.is_on() || rmw_take.is_on() || rcl_take.is_on() ||
           rclcpp_take.is_on();
  }
  bool records_callbacks() const noexcept {
    return rclcpp_executor_execute.is_on() || callback_start.is_on();
  }
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
