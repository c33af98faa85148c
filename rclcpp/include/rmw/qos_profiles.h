// The QoS profiles of rmw.
// SPDX-License-Identifier: Apache-2.0
#ifndef RMW__QOS_PROFILES_H_
#define RMW__QOS_PROFILES_H_

#include "rmw/types.h"

// history, depth, reliability, durability, deadline, lifespan, liveliness, lease, no conventions
#define RMW_PROFILE_OF_(history_, depth_, reliability_, durability_, ... /* lifespan */)  \
  {                                                                                       \
    RMW_QOS_POLICY_HISTORY_##history_, depth_, RMW_QOS_POLICY_RELIABILITY_##reliability_, \
        RMW_QOS_POLICY_DURABILITY_##durability_, RMW_DURATION_UNSPECIFIED, __VA_ARGS__,   \
        RMW_QOS_POLICY_LIVELINESS_SYSTEM_DEFAULT, RMW_DURATION_UNSPECIFIED, false         \
  }
#define RMW_PROFILE_(history_, depth_, reliability_, durability_) \
  RMW_PROFILE_OF_(history_, depth_, reliability_, durability_, RMW_DURATION_UNSPECIFIED)

static const rmw_qos_profile_t rmw_qos_profile_sensor_data =
    RMW_PROFILE_(KEEP_LAST, 5, BEST_EFFORT, VOLATILE);
static const rmw_qos_profile_t rmw_qos_profile_parameters =
    RMW_PROFILE_(KEEP_LAST, 1000, RELIABLE, VOLATILE);
static const rmw_qos_profile_t rmw_qos_profile_default =
    RMW_PROFILE_(KEEP_LAST, 10, RELIABLE, VOLATILE);
static const rmw_qos_profile_t rmw_qos_profile_services_default =
    RMW_PROFILE_(KEEP_LAST, 10, RELIABLE, VOLATILE);
static const rmw_qos_profile_t rmw_qos_profile_parameter_events =
    RMW_PROFILE_(KEEP_LAST, 1000, RELIABLE, VOLATILE);
static const rmw_qos_profile_t rmw_qos_profile_rosout_default =
    RMW_PROFILE_OF_(KEEP_LAST, 1000, RELIABLE, TRANSIENT_LOCAL, {10, 0});
static const rmw_qos_profile_t rmw_qos_profile_system_default = RMW_PROFILE_(
    SYSTEM_DEFAULT, RMW_QOS_POLICY_DEPTH_SYSTEM_DEFAULT, SYSTEM_DEFAULT, SYSTEM_DEFAULT);
static const rmw_qos_profile_t rmw_qos_profile_best_available =
    RMW_PROFILE_(KEEP_LAST, 10, BEST_AVAILABLE, BEST_AVAILABLE);
static const rmw_qos_profile_t rmw_qos_profile_unknown =
    RMW_PROFILE_(UNKNOWN, RMW_QOS_POLICY_DEPTH_SYSTEM_DEFAULT, UNKNOWN, UNKNOWN);

#endif  // RMW__QOS_PROFILES_H_
