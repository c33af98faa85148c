// One of two processes that watch each other: bonded ends [after it was formed].
// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <memory>
#include <string>

#include "bondcpp/bond.hpp"
#include "rclcpp/rclcpp.hpp"

int main(int argc, char* argv[]) {
  rclcpp::init(argc, argv);
  const bool breaks = argc > 1 && std::string(argv[1]) == "breaks";
  const auto node = std::make_shared<rclcpp::Node>(breaks ? "one" : "other");
  bond::Bond bond("/bond", "robot", node);
  bond.setFormedCallback([&] {
    std::puts("formed");
    if (breaks) bond.breakBond();
  });
  bond.setBrokenCallback([] {
    std::puts("broken");
    rclcpp::shutdown();
  });
  bond.start();
  rclcpp::spin(node);
}
