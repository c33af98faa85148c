// SPDX-License-Identifier: Apache-2.0
#include "takt/ros2/rosout.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/testing/peer_process.hpp"

namespace takt {
namespace {

TEST(Rosout, LinesOfNodesAndOthersArePublished) {
  Logger::instance().flush();  // what tests before have logged
  Logger::instance().set_writer([](LogLevel, std::string_view) {});
  const auto host = std::make_shared<Node>("container");
  const auto node = std::make_shared<Node>("lidar", NodeOptions{.name_space = "/front"});
  const auto reader =
      host->create_subscription<rcl_interfaces::msg::Log>("/rosout", 10, [](const auto&) {});
  std::uint32_t logged_after = 0;
  {
    const Rosout rosout(*host);
    node->log(LogLevel::warn, "range {} m", 3);
    logged_after = __LINE__;
    log(LogLevel::error, "of nobody");
    Logger::instance().flush();
  }
  log(LogLevel::error, "nobody listens any more");
  Logger::instance().flush();
  Logger::instance().set_writer({});
  std::vector<std::string> received;
  rcl_interfaces::msg::Log line;
  ASSERT_TRUE(eventually([&] {
    while (reader->take(line)) {
      received.push_back(fmt::format("{} {}: {}", line.level, line.name, line.msg));
    }
    return received.size() >= 2;
  }));
  EXPECT_THAT(received,
              testing::ElementsAre("30 front.lidar: range 3 m", "40 container: of nobody"));
  EXPECT_GT(line.stamp.sec, 1'700'000'000);
  // They were empty and 0: rqt_console and others show where a line was logged.
  EXPECT_THAT(line.file, testing::EndsWith("ros2/rosout_test.cpp"));
  EXPECT_EQ(line.function, "TestBody");  // its plain name, as __func__ in ROS 2's macros
  EXPECT_EQ(line.line, logged_after + 1);
}

}  // namespace
}  // namespace takt
