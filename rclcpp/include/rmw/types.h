// The types of rmw that stand in signatures of rclcpp.
// SPDX-License-Identifier: Apache-2.0
#ifndef RMW__TYPES_H_
#define RMW__TYPES_H_

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define RMW_GID_STORAGE_SIZE 16u

typedef int32_t rmw_ret_t;
#define RMW_RET_OK 0
#define RMW_RET_ERROR 1
#define RMW_RET_TIMEOUT 2
#define RMW_RET_UNSUPPORTED 3

typedef struct rmw_time_s {
  uint64_t sec;
  uint64_t nsec;
} rmw_time_t;
#define RMW_DURATION_INFINITE \
  { 9223372036ULL, 854775807ULL }
#define RMW_DURATION_UNSPECIFIED \
  { 0ULL, 0ULL }

typedef enum rmw_qos_reliability_policy_e {
  RMW_QOS_POLICY_RELIABILITY_SYSTEM_DEFAULT,
  RMW_QOS_POLICY_RELIABILITY_RELIABLE,
  RMW_QOS_POLICY_RELIABILITY_BEST_EFFORT,
  RMW_QOS_POLICY_RELIABILITY_UNKNOWN,
  RMW_QOS_POLICY_RELIABILITY_BEST_AVAILABLE,
} rmw_qos_reliability_policy_t;

typedef enum rmw_qos_history_policy_e {
  RMW_QOS_POLICY_HISTORY_SYSTEM_DEFAULT,
  RMW_QOS_POLICY_HISTORY_KEEP_LAST,
  RMW_QOS_POLICY_HISTORY_KEEP_ALL,
  RMW_QOS_POLICY_HISTORY_UNKNOWN,
} rmw_qos_history_policy_t;

typedef enum rmw_qos_durability_policy_e {
  RMW_QOS_POLICY_DURABILITY_SYSTEM_DEFAULT,
  RMW_QOS_POLICY_DURABILITY_TRANSIENT_LOCAL,
  RMW_QOS_POLICY_DURABILITY_VOLATILE,
  RMW_QOS_POLICY_DURABILITY_UNKNOWN,
  RMW_QOS_POLICY_DURABILITY_BEST_AVAILABLE,
} rmw_qos_durability_policy_t;

typedef enum rmw_qos_liveliness_policy_e {
  RMW_QOS_POLICY_LIVELINESS_SYSTEM_DEFAULT = 0,
  RMW_QOS_POLICY_LIVELINESS_AUTOMATIC = 1,
  RMW_QOS_POLICY_LIVELINESS_MANUAL_BY_TOPIC = 3,
  RMW_QOS_POLICY_LIVELINESS_UNKNOWN = 4,
  RMW_QOS_POLICY_LIVELINESS_BEST_AVAILABLE = 5,
} rmw_qos_liveliness_policy_t;

// A bit for each, so that they can be combined.
typedef enum rmw_qos_policy_kind_e {
  RMW_QOS_POLICY_INVALID = 1,
  RMW_QOS_POLICY_DURABILITY = 2,
  RMW_QOS_POLICY_DEADLINE = 4,
  RMW_QOS_POLICY_LIVELINESS = 8,
  RMW_QOS_POLICY_RELIABILITY = 16,
  RMW_QOS_POLICY_HISTORY = 32,
  RMW_QOS_POLICY_LIFESPAN = 64,
  RMW_QOS_POLICY_DEPTH = 128,
  RMW_QOS_POLICY_LIVELINESS_LEASE_DURATION = 256,
  RMW_QOS_POLICY_AVOID_ROS_NAMESPACE_CONVENTIONS = 512,
} rmw_qos_policy_kind_t;

#define RMW_QOS_POLICY_DEPTH_SYSTEM_DEFAULT 0
#define RMW_QOS_DEADLINE_DEFAULT RMW_DURATION_UNSPECIFIED
#define RMW_QOS_LIFESPAN_DEFAULT RMW_DURATION_UNSPECIFIED
#define RMW_QOS_LIVELINESS_LEASE_DURATION_DEFAULT RMW_DURATION_UNSPECIFIED

typedef struct rmw_qos_profile_s {
  enum rmw_qos_history_policy_e history;
  size_t depth;
  enum rmw_qos_reliability_policy_e reliability;
  enum rmw_qos_durability_policy_e durability;
  struct rmw_time_s deadline;
  struct rmw_time_s lifespan;
  enum rmw_qos_liveliness_policy_e liveliness;
  struct rmw_time_s liveliness_lease_duration;
  bool avoid_ros_namespace_conventions;
} rmw_qos_profile_t;

typedef struct rmw_gid_s {
  const char* implementation_identifier;
  uint8_t data[RMW_GID_STORAGE_SIZE];
} rmw_gid_t;

typedef int64_t rmw_time_point_value_t;

typedef struct rmw_request_id_s {
  int8_t writer_guid[RMW_GID_STORAGE_SIZE];
  int64_t sequence_number;
} rmw_request_id_t;

typedef struct rmw_message_info_s {
  rmw_time_point_value_t source_timestamp;
  rmw_time_point_value_t received_timestamp;
  uint64_t publication_sequence_number;
  uint64_t reception_sequence_number;
  rmw_gid_t publisher_gid;
  bool from_intra_process;
} rmw_message_info_t;

typedef enum rmw_unique_network_flow_endpoints_requirement_e {
  RMW_UNIQUE_NETWORK_FLOW_ENDPOINTS_NOT_REQUIRED,
  RMW_UNIQUE_NETWORK_FLOW_ENDPOINTS_STRICTLY_REQUIRED,
  RMW_UNIQUE_NETWORK_FLOW_ENDPOINTS_OPTIONALLY_REQUIRED,
  RMW_UNIQUE_NETWORK_FLOW_ENDPOINTS_SYSTEM_DEFAULT,
} rmw_unique_network_flow_endpoints_requirement_t;

// Statuses of events, as callbacks get them.

typedef struct rmw_requested_deadline_missed_status_s {
  int32_t total_count, total_count_change;
} rmw_requested_deadline_missed_status_t;
typedef rmw_requested_deadline_missed_status_t rmw_offered_deadline_missed_status_t;
typedef struct rmw_liveliness_changed_status_s {
  int32_t alive_count, not_alive_count, alive_count_change, not_alive_count_change;
} rmw_liveliness_changed_status_t;
typedef struct rmw_liveliness_lost_status_s {
  int32_t total_count, total_count_change;
} rmw_liveliness_lost_status_t;
typedef struct rmw_qos_incompatible_event_status_s {
  int32_t total_count, total_count_change;
  enum rmw_qos_policy_kind_e last_policy_kind;
} rmw_requested_qos_incompatible_event_status_t;
typedef rmw_requested_qos_incompatible_event_status_t rmw_offered_qos_incompatible_event_status_t;
typedef struct rmw_message_lost_status_s {
  size_t total_count, total_count_change;
} rmw_message_lost_status_t;
typedef struct rmw_matched_status_s {
  size_t total_count, total_count_change, current_count;
  int32_t current_count_change;
} rmw_matched_status_t;

#endif  // RMW__TYPES_H_
