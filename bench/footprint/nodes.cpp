// A program for rclcpp, of which footprint.py measures the memory: so many nodes that do nothing,
// or that pass a text on, each to the next one, ten times a second.
//   usage: footprint_nodes empty|ring NODES
// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "rclcpp/rclcpp.hpp"
#include "std_msgs/msg/string.hpp"

namespace {

class Passing : public rclcpp::Node {
 public:
  Passing(int number, int of)
      : Node("node_" + std::to_string(number)),
        publisher_(create_publisher<std_msgs::msg::String>(
            "ring_" + std::to_string((number + 1) % of), 10)),
        subscription_(create_subscription<std_msgs::msg::String>(
            "ring_" + std::to_string(number), 10,
            [this](std_msgs::msg::String::ConstSharedPtr text) { last_ = text; })),
        timer_(create_wall_timer(std::chrono::milliseconds(100), [this] {
          std_msgs::msg::String text;
          text.data = "a text that is too long for a string's own memory";
          publisher_->publish(text);
        })) {}

 private:
  std_msgs::msg::String::ConstSharedPtr last_;
  rclcpp::Publisher<std_msgs::msg::String>::SharedPtr publisher_;
  rclcpp::Subscription<std_msgs::msg::String>::SharedPtr subscription_;
  rclcpp::TimerBase::SharedPtr timer_;
};

}  // namespace

int main(int count, char** words) {
  rclcpp::init(count, words);
  const bool is_ring = std::string(words[1]) == "ring";
  const int nodes = std::atoi(words[2]);
  rclcpp::executors::SingleThreadedExecutor executor;
  std::vector<rclcpp::Node::SharedPtr> all;
  for (int i = 0; i < nodes; ++i) {
    all.push_back(is_ring ? std::make_shared<Passing>(i, nodes)
                          : std::make_shared<rclcpp::Node>("node_" + std::to_string(i)));
    executor.add_node(all.back());
  }
  std::cout << "ready" << std::endl;
  executor.spin();
  rclcpp::shutdown();
}
