// An action, shaped like nav2_msgs/action/NavigateToPose.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXAMPLES_NAVIGATE_HPP_
#define TAKT_EXAMPLES_NAVIGATE_HPP_

#include "takt/messages/geometry_msgs/msg/pose_stamped.hpp"

struct Navigate {
  struct Goal {
    ::geometry_msgs::msg::PoseStamped pose;
  };
  struct Result {
    float driven = 0;
  };
  struct Feedback {
    float distance_remaining = 0;
  };
};
TAKT_MESSAGE(Navigate::Goal, "demo_interfaces/action/Navigate_Goal", pose);
TAKT_MESSAGE(Navigate::Result, "demo_interfaces/action/Navigate_Result", driven);
TAKT_MESSAGE(Navigate::Feedback, "demo_interfaces/action/Navigate_Feedback", distance_remaining);

#endif  // TAKT_EXAMPLES_NAVIGATE_HPP_
