// ROS 2's messages for positions, orientations, velocities and forces, as they are on the wire.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MESSAGES_PACKAGES_GEOMETRY_MSGS_HPP_
#define TAKT_MESSAGES_PACKAGES_GEOMETRY_MSGS_HPP_

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "takt/messages/message_type.hpp"
#include "takt/messages/packages/std_msgs.hpp"

namespace takt::geometry_msgs {

struct Vector3 {
  double x = 0, y = 0, z = 0;
};
TAKT_MESSAGE(Vector3, "geometry_msgs/msg/Vector3", x, y, z);

struct Point {
  double x = 0, y = 0, z = 0;
};
TAKT_MESSAGE(Point, "geometry_msgs/msg/Point", x, y, z);

struct Point32 {
  float x = 0, y = 0, z = 0;
};
TAKT_MESSAGE(Point32, "geometry_msgs/msg/Point32", x, y, z);

struct Quaternion {
  double x = 0, y = 0, z = 0, w = 1;
};
TAKT_MESSAGE(Quaternion, "geometry_msgs/msg/Quaternion", x, y, z, w);

struct Pose {
  Point position;
  Quaternion orientation;
};
TAKT_MESSAGE(Pose, "geometry_msgs/msg/Pose", position, orientation);

struct PoseWithCovariance {
  Pose pose;
  std::array<double, 36> covariance{};
};
TAKT_MESSAGE(PoseWithCovariance, "geometry_msgs/msg/PoseWithCovariance", pose, covariance);

struct Twist {
  Vector3 linear, angular;
};
TAKT_MESSAGE(Twist, "geometry_msgs/msg/Twist", linear, angular);

struct TwistWithCovariance {
  Twist twist;
  std::array<double, 36> covariance{};
};
TAKT_MESSAGE(TwistWithCovariance, "geometry_msgs/msg/TwistWithCovariance", twist, covariance);

struct Accel {
  Vector3 linear, angular;
};
TAKT_MESSAGE(Accel, "geometry_msgs/msg/Accel", linear, angular);

struct Wrench {
  Vector3 force, torque;
};
TAKT_MESSAGE(Wrench, "geometry_msgs/msg/Wrench", force, torque);

struct Inertia {
  double m = 0;
  Vector3 com;
  double ixx = 0, ixy = 0, ixz = 0, iyy = 0, iyz = 0, izz = 0;
};
TAKT_MESSAGE(Inertia, "geometry_msgs/msg/Inertia", m, com, ixx, ixy, ixz, iyy, iyz, izz);

struct Transform {
  Vector3 translation;
  Quaternion rotation;
};
TAKT_MESSAGE(Transform, "geometry_msgs/msg/Transform", translation, rotation);

struct Polygon {
  std::vector<Point32> points;
};
TAKT_MESSAGE(Polygon, "geometry_msgs/msg/Polygon", points);

struct Vector3Stamped {
  std_msgs::Header header;
  Vector3 vector3;
};
TAKT_MESSAGE(Vector3Stamped, "geometry_msgs/msg/Vector3Stamped", header, vector3);

struct PointStamped {
  std_msgs::Header header;
  Point point;
};
TAKT_MESSAGE(PointStamped, "geometry_msgs/msg/PointStamped", header, point);

struct QuaternionStamped {
  std_msgs::Header header;
  Quaternion quaternion;
};
TAKT_MESSAGE(QuaternionStamped, "geometry_msgs/msg/QuaternionStamped", header, quaternion);

struct PoseStamped {
  std_msgs::Header header;
  Pose pose;
};
TAKT_MESSAGE(PoseStamped, "geometry_msgs/msg/PoseStamped", header, pose);

struct TwistStamped {
  std_msgs::Header header;
  Twist twist;
};
TAKT_MESSAGE(TwistStamped, "geometry_msgs/msg/TwistStamped", header, twist);

struct AccelStamped {
  std_msgs::Header header;
  Accel accel;
};
TAKT_MESSAGE(AccelStamped, "geometry_msgs/msg/AccelStamped", header, accel);

struct WrenchStamped {
  std_msgs::Header header;
  Wrench wrench;
};
TAKT_MESSAGE(WrenchStamped, "geometry_msgs/msg/WrenchStamped", header, wrench);

struct PolygonStamped {
  std_msgs::Header header;
  Polygon polygon;
};
TAKT_MESSAGE(PolygonStamped, "geometry_msgs/msg/PolygonStamped", header, polygon);

struct PoseWithCovarianceStamped {
  std_msgs::Header header;
  PoseWithCovariance pose;
};
TAKT_MESSAGE(PoseWithCovarianceStamped, "geometry_msgs/msg/PoseWithCovarianceStamped", header,
             pose);

struct TwistWithCovarianceStamped {
  std_msgs::Header header;
  TwistWithCovariance twist;
};
TAKT_MESSAGE(TwistWithCovarianceStamped, "geometry_msgs/msg/TwistWithCovarianceStamped", header,
             twist);

struct PoseArray {
  std_msgs::Header header;
  std::vector<Pose> poses;
};
TAKT_MESSAGE(PoseArray, "geometry_msgs/msg/PoseArray", header, poses);

struct TransformStamped {
  std_msgs::Header header;
  std::string child_frame_id;
  Transform transform;
};
TAKT_MESSAGE(TransformStamped, "geometry_msgs/msg/TransformStamped", header, child_frame_id,
             transform);

}  // namespace takt::geometry_msgs

#endif  // TAKT_MESSAGES_PACKAGES_GEOMETRY_MSGS_HPP_
