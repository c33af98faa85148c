// One's own loop instead of an executor: wait for two inputs, take both, act once.
// SPDX-License-Identifier: Apache-2.0
#include <optional>
#include <thread>

#include <fmt/format.h>

#include "takt/executors/wait_set.hpp"
#include "takt/nodes/node.hpp"

struct Wheel {
  int ticks = 0;
};
TAKT_MESSAGE(Wheel, "odometry/msg/Wheel", ticks);

int main() {
  const auto node = std::make_shared<takt::Node>("odometry");
  const auto left = node->create_subscription<Wheel>("left", 1, [](const Wheel&) {});
  const auto right = node->create_subscription<Wheel>("right", 1, [](const Wheel&) {});
  takt::WaitSet wait_set;
  wait_set.add(left);
  wait_set.add(right);

  std::jthread wheels([node](const std::stop_token& stop) {
    const auto to_left = node->create_publisher<Wheel>("left", 1);
    const auto to_right = node->create_publisher<Wheel>("right", 1);
    for (int ticks = 1; !stop.stop_requested(); ++ticks) {
      to_left->publish(Wheel{ticks});
      to_right->publish(Wheel{ticks + 1});
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  });

  for (int pairs = 0; pairs < 5; ++pairs) {
    // Both are needed. What is ready is taken at once, so that the next wait sleeps.
    std::optional<Wheel> left_wheel, right_wheel;
    while (!left_wheel || !right_wheel) {
      wait_set.wait();
      if (Wheel wheel; left->take(wheel)) left_wheel = wheel;
      if (Wheel wheel; right->take(wheel)) right_wheel = wheel;
    }
    fmt::print("turned by {}\n", right_wheel->ticks - left_wheel->ticks);
  }
}
