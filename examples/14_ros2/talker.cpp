// A talker and a listener that meet those of ROS 2's demo_nodes_cpp.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/component.hpp"
#include "takt/messages/std_msgs/msg/string.hpp"

namespace demo {

class Talker : public takt::Node {
 public:
  explicit Talker(const takt::NodeOptions& options) : Node("talker", options) {
    publisher_ = create_publisher<::std_msgs::msg::String>("chatter", 10);
    timer_ = create_timer("talk", std::chrono::milliseconds(500), [this] {
      publisher_->publish(
          ::std_msgs::msg::String().set__data(fmt::format("Hello World: {}", ++count_)));
    });
  }

 private:
  int count_ = 0;
  std::shared_ptr<takt::Publisher<::std_msgs::msg::String>> publisher_;
  std::shared_ptr<takt::Timer> timer_;
};

class Listener : public takt::Node {
 public:
  explicit Listener(const takt::NodeOptions& options) : Node("listener", options) {
    subscription_ = create_subscription<::std_msgs::msg::String>(
        "chatter", 10, [this](const ::std_msgs::msg::String& message) {
          log(takt::LogLevel::info, "I heard: [{}]", message.data);
        });
  }

 private:
  std::shared_ptr<takt::Subscription<::std_msgs::msg::String>> subscription_;
};

}  // namespace demo

TAKT_REGISTER_COMPONENT(demo::Talker, "says hello twice a second")
TAKT_REGISTER_COMPONENT(demo::Listener, "logs what it hears")
