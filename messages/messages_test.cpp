// Compares encoded ROS 2 messages with bytes written by hand: XCDR1, little endian.
// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "takt/messages/packages/action_msgs.hpp"
#include "takt/messages/packages/builtin_interfaces.hpp"
#include "takt/messages/packages/diagnostic_msgs.hpp"
#include "takt/messages/packages/geometry_msgs.hpp"
#include "takt/messages/packages/nav_msgs.hpp"
#include "takt/messages/packages/rcl_interfaces.hpp"
#include "takt/messages/packages/rmw_dds_common.hpp"
#include "takt/messages/packages/rosgraph_msgs.hpp"
#include "takt/messages/packages/sensor_msgs.hpp"
#include "takt/messages/packages/std_msgs.hpp"
#include "takt/messages/packages/tf2_msgs.hpp"

namespace takt {
namespace {

std::string hex(std::span<const std::byte> bytes) {
  std::string text;
  for (const std::byte byte : bytes) {
    text += "0123456789abcdef"[std::to_integer<int>(byte) / 16];
    text += "0123456789abcdef"[std::to_integer<int>(byte) % 16];
  }
  return text;
}
std::string packed(std::string_view written) {
  std::string text;
  for (const char character : written) {
    if (character != ' ') text += character;
  }
  return text;
}

/// Expects that the message encodes to these bytes, and the bytes decode to the message.
template <Message T>
void expect_bytes(const T& message, std::string_view written) {
  const MessageType& type = message_type<T>();
  ByteBuffer bytes;
  type.encode(&message, bytes);
  EXPECT_EQ(hex(bytes.bytes()), packed(written)) << type.name;
  T copy;
  EXPECT_TRUE(type.decode(bytes.bytes(), &copy)) << type.name;
  ByteBuffer again;
  type.encode(&copy, again);
  EXPECT_EQ(hex(again.bytes()), packed(written)) << type.name;
}

const std_msgs::Header kHeader{.stamp = {.sec = 1, .nanosec = 2}, .frame_id = "ab"};
constexpr const char* kHeaderBytes = "00010000 01000000 02000000 03000000 616200";
const std::string kOne = "000000000000f03f", kTwo = "0000000000000040", kZero = "0000000000000000";

std::string repeated(const std::string& bytes, int times) {
  std::string text;
  while (times-- > 0) text += bytes;
  return text;
}

TEST(Ros2Messages, OfOneValue) {
  expect_bytes(std_msgs::Empty{}, "00010000 00");
  expect_bytes(std_msgs::Bool{true}, "00010000 01");
  expect_bytes(std_msgs::Int16{-2}, "00010000 feff");
  expect_bytes(std_msgs::Float64{1}, "00010000" + kOne);
  expect_bytes(std_msgs::String{"hi"}, "00010000 03000000 686900");
  expect_bytes(builtin_interfaces::Duration{-1, 5}, "00010000 ffffffff 05000000");
  expect_bytes(rosgraph_msgs::Clock{{7, 8}}, "00010000 07000000 08000000");
}

TEST(Ros2Messages, OfArrays) {
  expect_bytes(std_msgs::UInt8MultiArray{{{{"x", 2, 2}}, 0}, {5, 6}},
               "00010000 01000000 02000000 7800 0000 02000000 02000000 00000000 02000000 0506");
  expect_bytes(std_msgs::Float64MultiArray{{}, {1}},
               "00010000 00000000 00000000 01000000 00000000" + kOne);
}

TEST(Ros2Messages, OfGeometry) {
  expect_bytes(kHeader, kHeaderBytes);
  expect_bytes(geometry_msgs::PoseStamped{kHeader, {{1, 0, 0}, {}}},
               kHeaderBytes + ("00" + kOne) + repeated(kZero, 5) + kOne);
  expect_bytes(
      tf2_msgs::TFMessage{{{kHeader, "c", {{2, 0, 0}, {}}}}},
      "00010000 01000000 01000000 02000000 03000000 616200 00 02000000 6300 0000 00000000" + kTwo +
          repeated(kZero, 5) + kOne);
}

TEST(Ros2Messages, OfSensors) {
  sensor_msgs::Image image;
  image.header = kHeader;
  image.height = 1;
  image.width = 2;
  image.encoding = "mono8";
  image.step = 2;
  image.data = {9, 8};
  expect_bytes(image,
               std::string(kHeaderBytes) +
                   "00 01000000 02000000 06000000 6d6f6e6f3800 00 00 02000000 02000000 0908");
  sensor_msgs::LaserScan scan;
  scan.header = kHeader;
  scan.angle_min = -1;
  scan.range_max = 2;
  scan.ranges = {1};
  expect_bytes(scan, std::string(kHeaderBytes) + "00 000080bf" + repeated("00000000", 5) +
                         "00000040 01000000 0000803f 00000000");
  sensor_msgs::PointCloud2 cloud;
  cloud.header = kHeader;
  cloud.height = cloud.width = 1;
  cloud.fields = {{"x", 0, static_cast<std::uint8_t>(sensor_msgs::PointFieldType::float32), 1}};
  cloud.point_step = cloud.row_step = 4;
  cloud.data = {1, 2, 3, 4};
  cloud.is_dense = true;
  expect_bytes(cloud, std::string(kHeaderBytes) +
                          "00 01000000 01000000 01000000 02000000 7800 0000 00000000 07 000000 "
                          "01000000 00 000000 04000000 04000000 04000000 01020304 01");
  sensor_msgs::Imu imu;
  imu.header = kHeader;
  imu.orientation_covariance[0] = 1;
  imu.linear_acceleration.z = 2;
  expect_bytes(imu, std::string(kHeaderBytes) + "00" + repeated(kZero, 3) + kOne + kOne +
                        repeated(kZero, 8 + 3 + 9 + 2) + kTwo + repeated(kZero, 9));
  expect_bytes(sensor_msgs::JointState{kHeader, {"j"}, {1}, {}, {}},
               std::string(kHeaderBytes) + "00 01000000 02000000 6a00 0000 01000000" + kOne +
                   "00000000 00000000");
  expect_bytes(sensor_msgs::CompressedImage{kHeader, "png", {7}},
               std::string(kHeaderBytes) + "00 04000000 706e6700 01000000 07");
}

TEST(Ros2Messages, OfNavigation) {
  nav_msgs::OccupancyGrid grid;
  grid.header = kHeader;
  grid.info.width = grid.info.height = 1;
  grid.info.resolution = 1;
  grid.data = {-1};
  expect_bytes(grid, std::string(kHeaderBytes) +
                         "00 00000000 00000000 0000803f 01000000 01000000 00000000" +
                         repeated(kZero, 6) + kOne + "01000000 ff");
  nav_msgs::Odometry odometry;
  odometry.header = kHeader;
  odometry.child_frame_id = "b";
  odometry.twist.covariance[35] = 1;
  expect_bytes(odometry, std::string(kHeaderBytes) + "00 02000000 6200 0000" + repeated(kZero, 6) +
                             kOne + repeated(kZero, 36 + 6 + 35) + kOne);
  expect_bytes(nav_msgs::Path{kHeader, {{kHeader, {}}}},
               std::string(kHeaderBytes) +
                   "00 01000000 01000000 02000000 03000000 616200 00 00000000" +
                   repeated(kZero, 6) + kOne);
}

TEST(Ros2Messages, OfDiagnosticsAndLogs) {
  expect_bytes(
      diagnostic_msgs::DiagnosticArray{kHeader, {{std::byte{2}, "n", "", "", {{"k", "v"}}}}},
      std::string(kHeaderBytes) +
          "00 01000000 02 000000 02000000 6e00 0000 01000000 00 000000 01000000 00 000000 "
          "01000000 02000000 6b00 0000 02000000 7600");
  expect_bytes(rcl_interfaces::Log{{1, 2}, 30, "n", "m", "", "f", 9},
               "00010000 01000000 02000000 1e 000000 02000000 6e00 0000 02000000 6d00 0000 "
               "01000000 00 000000 02000000 6600 0000 09000000");
}

TEST(Ros2Messages, OfActions) {
  action_msgs::GoalInfo goal;
  goal.goal_id.uuid[0] = 0xaa;
  goal.stamp = {3, 4};
  const std::string bytes = "aa" + repeated("00", 15) + "03000000 04000000";
  expect_bytes(action_msgs::GoalStatusArray{{{goal, 4}}}, "00010000 01000000" + bytes + "04");
  expect_bytes(action_msgs::CancelGoal::Request{goal}, "00010000" + bytes);
  expect_bytes(action_msgs::CancelGoal::Response{1, {goal}}, "00010000 01 000000 01000000" + bytes);
}

template <std::size_t kBytes>
rmw_dds_common::BasicParticipantEntitiesInfo<kBytes> one_node() {
  rmw_dds_common::BasicParticipantEntitiesInfo<kBytes> info;
  info.gid.data[0] = 0x01;
  auto& node = info.node_entities_info_seq.emplace_back();
  node.node_namespace = "/";
  node.node_name = "a";
  node.reader_gid_seq.emplace_back().data[0] = 0x02;
  node.writer_gid_seq.emplace_back().data[15] = 0x03;
  return info;
}

TEST(RosMessages, RmwDdsCommon) {
  const std::string names = "01000000 02000000 2f00 0000 02000000 6100 0000";
  const std::string zeros = repeated("00", 15), eight = repeated("00", 8);
  expect_bytes(one_node<16>(),
               "00010000 01" + zeros + names + "01000000 02" + zeros + "01000000" + zeros + "03");
  expect_bytes(one_node<24>(), "00010000 01" + zeros + eight + names + "01000000 02" + zeros +
                                   eight + "01000000" + zeros + "03" + eight);
}

}  // namespace
}  // namespace takt
