// ROS 2's simple messages, as they are on the wire.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MESSAGES_PACKAGES_STD_MSGS_HPP_
#define TAKT_MESSAGES_PACKAGES_STD_MSGS_HPP_

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "takt/messages/message_type.hpp"
#include "takt/messages/packages/builtin_interfaces.hpp"

namespace takt::std_msgs {

struct Empty {};
TAKT_MESSAGE(Empty, "std_msgs/msg/Empty");

struct Bool {
  bool data = false;
};
TAKT_MESSAGE(Bool, "std_msgs/msg/Bool", data);

struct Byte {
  std::byte data{};
};
TAKT_MESSAGE(Byte, "std_msgs/msg/Byte", data);

struct Char {
  std::uint8_t data = 0;
};
TAKT_MESSAGE(Char, "std_msgs/msg/Char", data);

struct Float32 {
  float data = 0;
};
TAKT_MESSAGE(Float32, "std_msgs/msg/Float32", data);

struct Float64 {
  double data = 0;
};
TAKT_MESSAGE(Float64, "std_msgs/msg/Float64", data);

struct Int8 {
  std::int8_t data = 0;
};
TAKT_MESSAGE(Int8, "std_msgs/msg/Int8", data);

struct Int16 {
  std::int16_t data = 0;
};
TAKT_MESSAGE(Int16, "std_msgs/msg/Int16", data);

struct Int32 {
  std::int32_t data = 0;
};
TAKT_MESSAGE(Int32, "std_msgs/msg/Int32", data);

struct Int64 {
  std::int64_t data = 0;
};
TAKT_MESSAGE(Int64, "std_msgs/msg/Int64", data);

struct UInt8 {
  std::uint8_t data = 0;
};
TAKT_MESSAGE(UInt8, "std_msgs/msg/UInt8", data);

struct UInt16 {
  std::uint16_t data = 0;
};
TAKT_MESSAGE(UInt16, "std_msgs/msg/UInt16", data);

struct UInt32 {
  std::uint32_t data = 0;
};
TAKT_MESSAGE(UInt32, "std_msgs/msg/UInt32", data);

struct UInt64 {
  std::uint64_t data = 0;
};
TAKT_MESSAGE(UInt64, "std_msgs/msg/UInt64", data);

struct String {
  std::string data;
};
TAKT_MESSAGE(String, "std_msgs/msg/String", data);

struct ColorRGBA {
  float r = 0, g = 0, b = 0, a = 0;
};
TAKT_MESSAGE(ColorRGBA, "std_msgs/msg/ColorRGBA", r, g, b, a);

/// When a message's content was, and in which frame of reference.
struct Header {
  builtin_interfaces::Time stamp;
  std::string frame_id;
};
TAKT_MESSAGE(Header, "std_msgs/msg/Header", stamp, frame_id);

struct MultiArrayDimension {
  std::string label;
  std::uint32_t size = 0, stride = 0;
};
TAKT_MESSAGE(MultiArrayDimension, "std_msgs/msg/MultiArrayDimension", label, size, stride);

struct MultiArrayLayout {
  std::vector<MultiArrayDimension> dim;
  std::uint32_t data_offset = 0;
};
TAKT_MESSAGE(MultiArrayLayout, "std_msgs/msg/MultiArrayLayout", dim, data_offset);

struct ByteMultiArray {
  MultiArrayLayout layout;
  std::vector<std::byte> data;
};
TAKT_MESSAGE(ByteMultiArray, "std_msgs/msg/ByteMultiArray", layout, data);

struct Float32MultiArray {
  MultiArrayLayout layout;
  std::vector<float> data;
};
TAKT_MESSAGE(Float32MultiArray, "std_msgs/msg/Float32MultiArray", layout, data);

struct Float64MultiArray {
  MultiArrayLayout layout;
  std::vector<double> data;
};
TAKT_MESSAGE(Float64MultiArray, "std_msgs/msg/Float64MultiArray", layout, data);

struct Int8MultiArray {
  MultiArrayLayout layout;
  std::vector<std::int8_t> data;
};
TAKT_MESSAGE(Int8MultiArray, "std_msgs/msg/Int8MultiArray", layout, data);

struct Int16MultiArray {
  MultiArrayLayout layout;
  std::vector<std::int16_t> data;
};
TAKT_MESSAGE(Int16MultiArray, "std_msgs/msg/Int16MultiArray", layout, data);

struct Int32MultiArray {
  MultiArrayLayout layout;
  std::vector<std::int32_t> data;
};
TAKT_MESSAGE(Int32MultiArray, "std_msgs/msg/Int32MultiArray", layout, data);

struct Int64MultiArray {
  MultiArrayLayout layout;
  std::vector<std::int64_t> data;
};
TAKT_MESSAGE(Int64MultiArray, "std_msgs/msg/Int64MultiArray", layout, data);

struct UInt8MultiArray {
  MultiArrayLayout layout;
  std::vector<std::uint8_t> data;
};
TAKT_MESSAGE(UInt8MultiArray, "std_msgs/msg/UInt8MultiArray", layout, data);

struct UInt16MultiArray {
  MultiArrayLayout layout;
  std::vector<std::uint16_t> data;
};
TAKT_MESSAGE(UInt16MultiArray, "std_msgs/msg/UInt16MultiArray", layout, data);

struct UInt32MultiArray {
  MultiArrayLayout layout;
  std::vector<std::uint32_t> data;
};
TAKT_MESSAGE(UInt32MultiArray, "std_msgs/msg/UInt32MultiArray", layout, data);

struct UInt64MultiArray {
  MultiArrayLayout layout;
  std::vector<std::uint64_t> data;
};
TAKT_MESSAGE(UInt64MultiArray, "std_msgs/msg/UInt64MultiArray", layout, data);

}  // namespace takt::std_msgs

#endif  // TAKT_MESSAGES_PACKAGES_STD_MSGS_HPP_
