// What tests of the layer share: rclcpp is initialised for each, and messages wait for no one for
// ever.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP_RCLCPP_TEST_HPP_
#define RCLCPP_RCLCPP_TEST_HPP_

#include <future>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "takt/testing/eventually.hpp"

#include "rclcpp/rclcpp.hpp"

namespace rclcpp {

using namespace std::chrono_literals;

/// Ends a wait in a test that has failed.
inline constexpr auto kLong = std::chrono::seconds(60);

/// Spins on a thread of its own for as long as it lives, also when its test fails.
class Spinner {
 public:
  explicit Spinner(Executor& executor)
      : executor_(executor), spin_(std::async(std::launch::async, [this] { executor_.spin(); })) {}
  ~Spinner() {
    executor_.cancel();  // also if it has not begun
    EXPECT_EQ(spin_.wait_for(kLong), std::future_status::ready);
  }
  Spinner(const Spinner&) = delete;
  Spinner& operator=(const Spinner&) = delete;

 private:
  Executor& executor_;
  const std::future<void> spin_;
};

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
