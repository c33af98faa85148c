// The message types of ROS 2's packages, which the command knows by name.
// SPDX-License-Identifier: Apache-2.0
#include "ros_types.hpp"

#include "takt/messages/message_types.hpp"

TAKT_REGISTER_MESSAGES(TAKT_ROS_TYPES)
