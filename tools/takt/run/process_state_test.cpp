// Tests of the reports of processes about their containers.
// SPDX-License-Identifier: Apache-2.0
#include "run/process_state.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/measuring/row_json.hpp"

namespace takt::tools {
namespace {

TEST(ProcessState, ShowsTopicsOfUsersWithTheirProcess) {
  rt::Run run;
  add_topics(run, "robot",
             {{{.topic = "/scan", .messages = 3}, 7}, {{.topic = "ros_discovery_info"}, 8}});
  ASSERT_EQ(run.topics.size(), 1u);
  EXPECT_EQ(run.topics[0], (rt::Run::Topic{.process = "robot", .topic = "/scan", .messages = 3}));
}

TEST(ProcessState, ArrivesAsItWasSent) {
  ProcessState state{.endpoints = {{{.topic = "/scan", .is_writer = true, .messages = 3}, 7}},
                     .nodes = {{"/camera", "Camera", "robot.yaml:3"}},
                     .serves_itself = true,
                     .pending = 2};
  ProcessState arrived;
  rt::read_value(rt::row_json(state), arrived, {nullptr, "state"});
  EXPECT_EQ(arrived, state);
}

TEST(ProcessState, FindsANameThatTwoProcessesHaveGiven) {
  const ProcessState one{.nodes = {{"/camera", "Camera", "robot.yaml:3"}}};
  const ProcessState other{.nodes = {{"/lidar", "Lidar", "robot.yaml:9"}}};
  EXPECT_NO_THROW(check_names({one, other}));
  EXPECT_THROW(check_names({one, other, one}), ConfigurationError);
}

}  // namespace
}  // namespace takt::tools
