// A talker and a listener that meet those of ROS 2's demo_nodes_cpp.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/component.hpp"
#include "takt/messages/packages/std_msgs.hpp"

namespace demo {

class Talker : public takt::Node {
 public:
  explicit Talker(const takt::NodeOptions& options) : Node("talker", options) {
    publisher_ = create_publisher<takt::std_msgs::String>("chatter", 10);
    timer_ = create_timer("talk", std::chrono::milliseconds(500), [this] {
      publisher_->publish(takt::std_msgs::String{fmt::format("Hello World: {}", ++count_)});
    });
  }

 private:
  int count_ = 0;
  std::shared_ptr<takt::Publisher<takt::std_msgs::String>> publisher_;
  std::shared_ptr<takt::Timer> timer_;
};

class Listener : public takt::Node {
 public:
  explicit Listener(const takt::NodeOptions& options) : Node("listener", options) {
    subscription_ = create_subscription<takt::std_msgs::String>(
        "chatter", 10, [this](const takt::std_msgs::String& message) {
          log(takt::LogLevel::info, "I heard: [{}]", message.data);
        });
  }

 private:
  std::shared_ptr<takt::Subscription<takt::std_msgs::String>> subscription_;
};

}  // namespace demo

TAKT_REGISTER_COMPONENT(demo::Talker, "says hello twice a second")
TAKT_REGISTER_COMPONENT(demo::Listener, "logs what it hears")
