// ROS 2's messages of sensors, as they are on the wire.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MESSAGES_PACKAGES_SENSOR_MSGS_HPP_
#define TAKT_MESSAGES_PACKAGES_SENSOR_MSGS_HPP_

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "takt/messages/message_type.hpp"
#include "takt/messages/packages/geometry_msgs.hpp"

namespace takt::sensor_msgs {

struct RegionOfInterest {
  std::uint32_t x_offset = 0, y_offset = 0, height = 0, width = 0;
  bool do_rectify = false;
};
TAKT_MESSAGE(RegionOfInterest, "sensor_msgs/msg/RegionOfInterest", x_offset, y_offset, height,
             width, do_rectify);

struct CameraInfo {
  std_msgs::Header header;
  std::uint32_t height = 0, width = 0;
  std::string distortion_model;
  std::vector<double> d;
  std::array<double, 9> k{}, r{};
  std::array<double, 12> p{};
  std::uint32_t binning_x = 0, binning_y = 0;
  RegionOfInterest roi;
};
TAKT_MESSAGE(CameraInfo, "sensor_msgs/msg/CameraInfo", header, height, width, distortion_model, d,
             k, r, p, binning_x, binning_y, roi);

struct Image {
  std_msgs::Header header;
  std::uint32_t height = 0, width = 0;
  std::string encoding;
  std::uint8_t is_bigendian = 0;
  std::uint32_t step = 0;  // bytes of a row
  std::vector<std::uint8_t> data;
};
TAKT_MESSAGE(Image, "sensor_msgs/msg/Image", header, height, width, encoding, is_bigendian, step,
             data);

struct CompressedImage {
  std_msgs::Header header;
  std::string format;
  std::vector<std::uint8_t> data;
};
TAKT_MESSAGE(CompressedImage, "sensor_msgs/msg/CompressedImage", header, format, data);

enum class PointFieldType : std::uint8_t {
  int8 = 1,
  uint8 = 2,
  int16 = 3,
  uint16 = 4,
  int32 = 5,
  uint32 = 6,
  float32 = 7,
  float64 = 8,
};

struct PointField {
  std::string name;
  std::uint32_t offset = 0;
  std::uint8_t datatype = 0;  // a PointFieldType
  std::uint32_t count = 0;
};
TAKT_MESSAGE(PointField, "sensor_msgs/msg/PointField", name, offset, datatype, count);

struct PointCloud2 {
  std_msgs::Header header;
  std::uint32_t height = 0, width = 0;
  std::vector<PointField> fields;
  bool is_bigendian = false;
  std::uint32_t point_step = 0, row_step = 0;
  std::vector<std::uint8_t> data;
  bool is_dense = false;
};
TAKT_MESSAGE(PointCloud2, "sensor_msgs/msg/PointCloud2", header, height, width, fields,
             is_bigendian, point_step, row_step, data, is_dense);

struct LaserScan {
  std_msgs::Header header;
  float angle_min = 0, angle_max = 0, angle_increment = 0;
  float time_increment = 0, scan_time = 0;
  float range_min = 0, range_max = 0;
  std::vector<float> ranges, intensities;
};
TAKT_MESSAGE(LaserScan, "sensor_msgs/msg/LaserScan", header, angle_min, angle_max, angle_increment,
             time_increment, scan_time, range_min, range_max, ranges, intensities);

struct Imu {
  std_msgs::Header header;
  geometry_msgs::Quaternion orientation;
  std::array<double, 9> orientation_covariance{};
  geometry_msgs::Vector3 angular_velocity;
  std::array<double, 9> angular_velocity_covariance{};
  geometry_msgs::Vector3 linear_acceleration;
  std::array<double, 9> linear_acceleration_covariance{};
};
TAKT_MESSAGE(Imu, "sensor_msgs/msg/Imu", header, orientation, orientation_covariance,
             angular_velocity, angular_velocity_covariance, linear_acceleration,
             linear_acceleration_covariance);

struct JointState {
  std_msgs::Header header;
  std::vector<std::string> name;
  std::vector<double> position, velocity, effort;
};
TAKT_MESSAGE(JointState, "sensor_msgs/msg/JointState", header, name, position, velocity, effort);

}  // namespace takt::sensor_msgs

#endif  // TAKT_MESSAGES_PACKAGES_SENSOR_MSGS_HPP_
