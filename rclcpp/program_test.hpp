// What tests of the environment share. Each test is a program of its own, as it is read once.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP_PROGRAM_TEST_HPP_
#define RCLCPP_PROGRAM_TEST_HPP_

#include <cstdlib>
#include <fstream>
#include <iostream>
#include <optional>

#include "takt/base/temporary.hpp"

#include "rclcpp_test.hpp"

namespace rclcpp {

/// Ends the program with what the function throws, as a program without `try` would, but with a
/// status.
template <class F>
[[noreturn]] void run(F&& program) {
  try {
    rclcpp::init(0, nullptr);
    program();
    rclcpp::shutdown();
    std::exit(0);
  } catch (const std::exception& error) {
    std::cerr << "threw: " << error.what() << '\n';
    std::exit(3);
  }
}

class ProgramDeathTest : public testing::Test {
 protected:
  // A program of a test begins the test anew, with the environment of the one that it belongs to.
  ProgramDeathTest() {
    GTEST_FLAG_SET(death_test_style, "threadsafe");
    if (std::getenv("TAKT_TEST_FILE") != nullptr) return;
    folder_.emplace();
    setenv("TAKT_TEST_FILE", (*folder_ / "robot.yaml").c_str(), 1);
  }
  ~ProgramDeathTest() override { unsetenv("TAKT_TEST_FILE"); }

  static std::string file() { return std::getenv("TAKT_TEST_FILE"); }
  /// For the program that calls it.
  static void configure(const std::string& text) {
    std::ofstream(file()) << text;
    setenv("TAKT_CONFIG", file().c_str(), 1);
  }

 private:
  std::optional<takt::TemporaryFolder> folder_;
};
inline const auto kEndsWell = testing::ExitedWithCode(0);
inline const auto kThrows = testing::ExitedWithCode(3);

}  // namespace rclcpp

#endif  // RCLCPP_PROGRAM_TEST_HPP_
