// Tests of what sensor_msgs has beside its messages.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sensor_msgs/image_encodings.hpp"
#include "sensor_msgs/point_cloud2_iterator.hpp"

namespace {

using sensor_msgs::PointCloud2ConstIterator;
using sensor_msgs::PointCloud2Iterator;
using sensor_msgs::PointCloud2Modifier;
using sensor_msgs::msg::PointCloud2;
using sensor_msgs::msg::PointField;

TEST(PointCloud, IsWrittenAndReadByField) {
  PointCloud2 cloud;
  PointCloud2Modifier modifier(cloud);
  modifier.setPointCloud2FieldsByString(2, "xyz", "rgb");
  EXPECT_EQ(cloud.point_step, 32u);
  modifier.resize(3);
  EXPECT_EQ(modifier.size(), 3u);
  EXPECT_EQ(cloud.data.size(), 96u);
  PointCloud2Iterator<float> x(cloud, "x");
  PointCloud2Iterator<std::uint8_t> red(cloud, "r"), blue(cloud, "b");
  for (float value = 1; x != x.end(); ++x, ++red, ++blue, ++value) {
    *x = value;
    x[2] = 10 * value;
    *red = static_cast<std::uint8_t>(value);
    *blue = 7;
  }
  const PointCloud2& read = cloud;
  const PointCloud2ConstIterator<float> z(read, "z");
  EXPECT_EQ(*(z + 2), 30);
  EXPECT_EQ(*(PointCloud2ConstIterator<std::uint32_t>(read, "rgb") + 1), 0x020007u);
  EXPECT_THROW(PointCloud2ConstIterator<float>(read, "w"), std::runtime_error);
}

TEST(PointCloud, HasFieldsOneBehindTheOther) {
  PointCloud2 cloud;
  PointCloud2Modifier modifier(cloud);
  modifier.setPointCloud2Fields(2, "stamp", 1, PointField::FLOAT64, "echo", 3, PointField::UINT16);
  EXPECT_EQ(cloud.point_step, 14u);
  EXPECT_EQ(cloud.fields.at(1).offset, 8u);
  modifier.resize(2);
  modifier.clear();
  EXPECT_EQ(modifier.size(), 0u);
  EXPECT_THROW(modifier.setPointCloud2FieldsByString(1, "odd"), std::runtime_error);
}

TEST(ImageEncodings, SayWhatTheyAre) {
  namespace encodings = sensor_msgs::image_encodings;
  EXPECT_EQ(encodings::numChannels(encodings::RGB8), 3);
  EXPECT_EQ(encodings::numChannels(encodings::BGRA16), 4);
  EXPECT_EQ(encodings::bitDepth(encodings::BGRA16), 16);
  EXPECT_EQ(encodings::numChannels(encodings::TYPE_32FC2), 2);
  EXPECT_EQ(encodings::bitDepth(encodings::TYPE_32FC2), 32);
  EXPECT_EQ(encodings::bitDepth(encodings::BAYER_GRBG8), 8);
  EXPECT_TRUE(encodings::isColor(encodings::YUYV));
  EXPECT_FALSE(encodings::isColor(encodings::MONO8));
  EXPECT_THROW(encodings::numChannels("what"), std::runtime_error);
}

}  // namespace
