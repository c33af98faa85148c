// What tests of the layer share: rclcpp is initialised for each, and messages wait for no one for
// ever.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP_RCLCPP_TEST_HPP_
#define RCLCPP_RCLCPP_TEST_HPP_

#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "rclcpp/rclcpp.hpp"

namespace rclcpp {

using namespace std::chrono_literals;

/// Ends a wait in a test that has failed.
inline constexpr auto kLong = std::chrono::seconds(60);

class RclcppTest : public testing::Test {
 protected:
  RclcppTest() { rclcpp::init(0, nullptr); }
  ~RclcppTest() override { rclcpp::shutdown(); }

  /// Spins until it is true. False: it took too long.
  template <class Condition>
  static bool spin_until(Executor& executor, Condition&& condition) {
    const auto end = std::chrono::steady_clock::now() + kLong;
    while (!condition()) {
      if (std::chrono::steady_clock::now() > end) return false;
      executor.spin_once(10ms);
    }
    return true;
  }
};

}  // namespace rclcpp

#endif  // RCLCPP_RCLCPP_TEST_HPP_
