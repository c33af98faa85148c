// Tests of the reports of processes about their containers.
// SPDX-License-Identifier: Apache-2.0
#include "run/container_json.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace takt::tools {
namespace {

using nlohmann::json;

TEST(ContainerJson, ShowsTopicsWithTheirProcessAndWithoutTheirIds) {
  json topics = json::array();
  add_topics(topics, "robot", json::array({{{"topic", "/scan"}, {"id", 7}, {"messages", 3}}}));
  EXPECT_EQ(topics, json::parse(R"([{"process": "robot", "topic": "/scan", "messages": 3}])"));
}

TEST(ContainerJson, DoesNotShowWhatIsNoTopicOfTheUsers) {
  json topics = json::array();
  add_topics(topics, "robot", json::array({{{"topic", "ros_discovery_info"}, {"id", 7}}}));
  EXPECT_EQ(topics, json::array());
}

TEST(ContainerJson, FindsANameThatTwoProcessesHaveGiven) {
  const json one = {{"nodes", json::array({json::array({"/camera", "Camera", "robot.yaml:3"})})}};
  const json other = {{"nodes", json::array({json::array({"/lidar", "Lidar", "robot.yaml:9"})})}};
  EXPECT_NO_THROW(check_names({one, other}));
  EXPECT_THROW(check_names({one, other, one}), ConfigurationError);
}

}  // namespace
}  // namespace takt::tools
