// CARET's tracepoints for LTTng: names and fields as caret_trace 0.7.3 has them. LTTng includes
// this file several times.
// SPDX-License-Identifier: Apache-2.0
#undef LTTNG_UST_TRACEPOINT_PROVIDER
#define LTTNG_UST_TRACEPOINT_PROVIDER ros2_caret
#undef LTTNG_UST_TRACEPOINT_INCLUDE
#define LTTNG_UST_TRACEPOINT_INCLUDE "caret_tracepoints.h"
#if !defined(TAKT_TRACING_CARET_TRACEPOINTS_H_) || defined(LTTNG_UST_TRACEPOINT_HEADER_MULTI_READ)
#define TAKT_TRACING_CARET_TRACEPOINTS_H_

#include <lttng/tracepoint.h>

// clang-format off
LTTNG_UST_TRACEPOINT_EVENT(ros2_caret, caret_init, LTTNG_UST_TP_ARGS(int64_t, clock_offset, const char*, distribution),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer(int64_t, clock_offset, clock_offset)
    lttng_ust_field_string(distribution, distribution)))
LTTNG_UST_TRACEPOINT_EVENT(ros2_caret, rmw_implementation, LTTNG_UST_TP_ARGS(const char*, rmw_impl, int64_t, init_timestamp),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_string(rmw_impl, rmw_impl)
    lttng_ust_field_integer(int64_t, init_timestamp, init_timestamp)))
LTTNG_UST_TRACEPOINT_EVENT(ros2_caret, construct_executor, LTTNG_UST_TP_ARGS(const void*, executor_addr, const char*, executor_type_name, int64_t, init_timestamp),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, executor_addr, executor_addr)
    lttng_ust_field_string(executor_type_name, executor_type_name)
    lttng_ust_field_integer(int64_t, init_timestamp, init_timestamp)))
LTTNG_UST_TRACEPOINT_EVENT(ros2_caret, add_callback_group, LTTNG_UST_TP_ARGS(const void*, executor_addr, const void*, callback_group_addr, const char*, group_type_name, int64_t, init_timestamp),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, executor_addr, executor_addr)
    lttng_ust_field_integer_hex(const void*, callback_group_addr, callback_group_addr)
    lttng_ust_field_string(group_type_name, group_type_name)
    lttng_ust_field_integer(int64_t, init_timestamp, init_timestamp)))
LTTNG_UST_TRACEPOINT_EVENT(ros2_caret, callback_group_add_timer, LTTNG_UST_TP_ARGS(const void*, callback_group_addr, const void*, timer_handle, int64_t, init_timestamp),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, callback_group_addr, callback_group_addr)
    lttng_ust_field_integer_hex(const void*, timer_handle, timer_handle)
    lttng_ust_field_integer(int64_t, init_timestamp, init_timestamp)))
LTTNG_UST_TRACEPOINT_EVENT(ros2_caret, callback_group_add_subscription, LTTNG_UST_TP_ARGS(const void*, callback_group_addr, const void*, subscription_handle, int64_t, init_timestamp),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, callback_group_addr, callback_group_addr)
    lttng_ust_field_integer_hex(const void*, subscription_handle, subscription_handle)
    lttng_ust_field_integer(int64_t, init_timestamp, init_timestamp)))
LTTNG_UST_TRACEPOINT_EVENT(ros2_caret, callback_group_add_service, LTTNG_UST_TP_ARGS(const void*, callback_group_addr, const void*, service_handle, int64_t, init_timestamp),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, callback_group_addr, callback_group_addr)
    lttng_ust_field_integer_hex(const void*, service_handle, service_handle)
    lttng_ust_field_integer(int64_t, init_timestamp, init_timestamp)))
LTTNG_UST_TRACEPOINT_EVENT(ros2_caret, callback_group_add_client, LTTNG_UST_TP_ARGS(const void*, callback_group_addr, const void*, client_handle, int64_t, init_timestamp),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, callback_group_addr, callback_group_addr)
    lttng_ust_field_integer_hex(const void*, client_handle, client_handle)
    lttng_ust_field_integer(int64_t, init_timestamp, init_timestamp)))
LTTNG_UST_TRACEPOINT_EVENT(ros2_caret, dds_write, LTTNG_UST_TP_ARGS(const void*, message),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, message, message)))
LTTNG_UST_TRACEPOINT_EVENT(ros2_caret, dds_bind_addr_to_stamp, LTTNG_UST_TP_ARGS(const void*, addr, uint64_t, source_stamp),
  LTTNG_UST_TP_FIELDS(
    lttng_ust_field_integer_hex(const void*, addr, addr)
    lttng_ust_field_integer(uint64_t, source_stamp, source_stamp)))
// clang-format on

#endif  // TAKT_TRACING_CARET_TRACEPOINTS_H_
#include <lttng/tracepoint-event.h>
