// Compares type hashes with those of ROS 2 Jazzy.
// SPDX-License-Identifier: Apache-2.0
#include "takt/messages/type_description.hpp"

#include <gtest/gtest.h>

#include "takt/messages/geometry_msgs/msg/twist.hpp"
#include "takt/messages/rmw_dds_common/msg/participant_entities_info.hpp"
#include "takt/messages/rosgraph_msgs/msg/clock.hpp"
#include "takt/messages/std_msgs/msg/empty.hpp"
#include "takt/messages/std_msgs/msg/string.hpp"

namespace takt {
namespace {

struct AddTwoIntsRequest {
  std::int64_t a = 0, b = 0;
};
struct AddTwoIntsResponse {
  std::int64_t sum = 0;
};
TAKT_MESSAGE(AddTwoIntsRequest, "example_interfaces/srv/AddTwoInts_Request", a, b);
TAKT_MESSAGE(AddTwoIntsResponse, "example_interfaces/srv/AddTwoInts_Response", sum);

struct OfIdl {
  int value = 0;
};
TAKT_MESSAGE(OfIdl, "robot::Value", value);

TEST(TypeDescription, HashesAreThoseOfRos2) {
  EXPECT_EQ(type_hash(message_type<std_msgs::msg::String>()),
            "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18");
  EXPECT_EQ(type_hash(message_type<std_msgs::msg::Empty>()),
            "RIHS01_20b625256f32d5dbc0d04fee44f43c41e51c70d3502f84b4a08e7a9c26a96312");
  EXPECT_EQ(type_hash(message_type<geometry_msgs::msg::Twist>()),
            "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a");
  EXPECT_EQ(type_hash(message_type<rosgraph_msgs::msg::Clock>()),
            "RIHS01_692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564");
  EXPECT_EQ(type_hash(message_type<rmw_dds_common::msg::ParticipantEntitiesInfo>()),
            "RIHS01_91a0593bacdcc50ea9bdcf849a938b128412cc1ea821245c663bcd26f83c295e");
  EXPECT_EQ(
      service_type_hash(message_type<AddTwoIntsRequest>(), message_type<AddTwoIntsResponse>()),
      "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a");
}

TEST(TypeDescription, WhatRos2CannotHaveHasNone) {
  EXPECT_EQ(type_hash(message_type<OfIdl>()), "");
  EXPECT_EQ(type_hash(serialized_type("std_msgs/msg/String")), "");
}

TEST(TypeDescription, NamesComeBackFromTheWire) {
  EXPECT_EQ(ros_type_name("std_msgs::msg::dds_::String_"), "std_msgs/msg/String");
  EXPECT_EQ(ros_type_name("robot::Value"), "robot::Value");
}

}  // namespace
}  // namespace takt
