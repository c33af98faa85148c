// A program written for rclcpp, which run_test.py runs. Its words say how it ends: nothing, at a
// signal; "calls N STATUS": after so many calls, with this status; "hangs": never, once it spins.
// "own": what listens has an executor of its own. "looks": once, at the nodes, when it has found a
// publisher. "threads", "sleeps", "clocks": so does its timer. "naps", "steps", "leaves": so it
// does before it spins, instead of that, and without.
// SPDX-License-Identifier: Apache-2.0
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <string>
#include <thread>

#include "rclcpp/rclcpp.hpp"
#include "std_msgs/msg/string.hpp"

using namespace std::chrono_literals;

class Talker : public rclcpp::Node {
 public:
  Talker(int most, const std::string& deed)
      : Node("talker"),
        publisher_(create_publisher<std_msgs::msg::String>("chatter", 10)),
        timer_(create_wall_timer(1ms, [this, most, deed] {
          if (deed == "threads") std::thread([] {}).join();
          if (deed == "sleeps") std::this_thread::sleep_for(1ms);
          if (deed == "clocks") last_ = std::chrono::steady_clock::now();
          if (calls_ == 0) std::cout << "it talks" << std::endl;
          publisher_->publish(std_msgs::msg::String());
          if (++calls_ == most) rclcpp::shutdown();
        })) {}

 private:
  int calls_ = 0;
  std::chrono::steady_clock::time_point last_;
  rclcpp::Publisher<std_msgs::msg::String>::SharedPtr publisher_;
  rclcpp::TimerBase::SharedPtr timer_;
};

class Listener : public rclcpp::Node {
 public:
  explicit Listener(bool has_own_group)
      : Node("listener"),
        group_(create_callback_group(rclcpp::CallbackGroupType::MutuallyExclusive,
                                     /*automatically_add_to_executor=*/!has_own_group)),
        subscription_(create_subscription<std_msgs::msg::String>(
            "chatter", 10, [](const std_msgs::msg::String&) {}, options())) {}
  rclcpp::CallbackGroup::SharedPtr group() const { return group_; }

 private:
  rclcpp::SubscriptionOptions options() const {
    rclcpp::SubscriptionOptions options;
    options.callback_group = group_;
    return options;
  }

  rclcpp::CallbackGroup::SharedPtr group_;
  rclcpp::Subscription<std_msgs::msg::String>::SharedPtr subscription_;
};

void look() {
  const auto node = std::make_shared<rclcpp::Node>("observer");
  const auto subscription = node->create_subscription<std_msgs::msg::String>(
      "chatter", 10, [](const std_msgs::msg::String&) {});
  while (subscription->get_publisher_count() == 0) std::this_thread::sleep_for(1ms);
  for (const std::string& name : node->get_node_names()) std::cout << "sees " << name << std::endl;
  for (const auto& info : node->get_publishers_info_by_topic("chatter")) {
    std::cout << "of " << info.node_name() << ", hash " << int{info.topic_type_hash().value[0]}
              << std::endl;
  }
  for (const auto& info : node->get_publishers_info_by_topic("rosout")) {
    std::cout << "lines last " << info.qos_profile().lifespan().seconds() << " s" << std::endl;
  }
}

int main(int argc, char** argv) {
  const auto words = rclcpp::init_and_remove_ros_arguments(argc, argv);
  if (words.size() > 1 && words[1] == "looks") {
    look();
    rclcpp::shutdown();
    return 0;
  }
  const bool has_own_group = words.size() > 1 && words[1] == "own";
  const bool hangs = words.size() > 1 && words[1] == "hangs";
  const std::string deed = words.size() > 1 ? words[1] : "";
  if (deed == "naps") rclcpp::Rate(100).sleep();
  const int most = words.size() > 3 ? std::atoi(words[2].c_str()) : 0;
  {
    rclcpp::executors::SingleThreadedExecutor executor, own;
    const auto talker = std::make_shared<Talker>(most, deed);
    const auto listener = std::make_shared<Listener>(has_own_group);
    executor.add_node(talker);
    executor.add_node(listener);
    if (has_own_group) {
      own.add_callback_group(listener->group(), listener->get_node_base_interface());
    }
    if (deed == "leaves") return 0;
    while (deed == "steps" && rclcpp::ok()) executor.spin_some();
    executor.spin();
  }
  while (hangs) std::this_thread::sleep_for(1h);
  rclcpp::shutdown();
  return words.size() > 3 ? std::atoi(words[3].c_str()) : 0;
}
