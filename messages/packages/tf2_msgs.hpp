// ROS 2's message of transforms, as it is on the wire.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MESSAGES_PACKAGES_TF2_MSGS_HPP_
#define TAKT_MESSAGES_PACKAGES_TF2_MSGS_HPP_

#include <vector>

#include "takt/messages/message_type.hpp"
#include "takt/messages/packages/geometry_msgs.hpp"

namespace takt::tf2_msgs {

struct TFMessage {
  std::vector<geometry_msgs::TransformStamped> transforms;
};
TAKT_MESSAGE(TFMessage, "tf2_msgs/msg/TFMessage", transforms);

}  // namespace takt::tf2_msgs

#endif  // TAKT_MESSAGES_PACKAGES_TF2_MSGS_HPP_
