// ROS 2's messages for navigation, as they are on the wire.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MESSAGES_PACKAGES_NAV_MSGS_HPP_
#define TAKT_MESSAGES_PACKAGES_NAV_MSGS_HPP_

#include <cstdint>
#include <string>
#include <vector>

#include "takt/messages/message_type.hpp"
#include "takt/messages/packages/geometry_msgs.hpp"

namespace takt::nav_msgs {

struct Odometry {
  std_msgs::Header header;
  std::string child_frame_id;
  geometry_msgs::PoseWithCovariance pose;
  geometry_msgs::TwistWithCovariance twist;
};
TAKT_MESSAGE(Odometry, "nav_msgs/msg/Odometry", header, child_frame_id, pose, twist);

struct MapMetaData {
  builtin_interfaces::Time map_load_time;
  float resolution = 0;
  std::uint32_t width = 0, height = 0;
  geometry_msgs::Pose origin;
};
TAKT_MESSAGE(MapMetaData, "nav_msgs/msg/MapMetaData", map_load_time, resolution, width, height,
             origin);

struct OccupancyGrid {
  std_msgs::Header header;
  MapMetaData info;
  std::vector<std::int8_t> data;  // percent; -1: unknown
};
TAKT_MESSAGE(OccupancyGrid, "nav_msgs/msg/OccupancyGrid", header, info, data);

struct Path {
  std_msgs::Header header;
  std::vector<geometry_msgs::PoseStamped> poses;
};
TAKT_MESSAGE(Path, "nav_msgs/msg/Path", header, poses);

}  // namespace takt::nav_msgs

#endif  // TAKT_MESSAGES_PACKAGES_NAV_MSGS_HPP_
