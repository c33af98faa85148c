// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/component.hpp"

namespace demo {

struct Range {
  float range = 0;
};
TAKT_MESSAGE(Range, "sensor_msgs/msg/Range", range);
struct Twist {
  double x = 0;
};
TAKT_MESSAGE(Twist, "geometry_msgs/msg/Twist", x);

class Follower : public takt::Node {
 public:
  explicit Follower(const takt::NodeOptions& options) : Node("follower", options) {
    using namespace std::chrono_literals;
    gain_ = declare_parameter("gain", 0.5);
    group_ = create_callback_group("loop", takt::CallbackGroupType::MutuallyExclusive);
    publisher_ = create_publisher<Twist>("cmd_vel", 10, {.loans = 12});
    subscription_ = create_subscription<Range>(
        "range", 10, [this](const Range& message) { range_ = message.range; }, group_);
    timer_ = create_timer(
        "control", 10ms, [this] { control(); }, group_);
  }

 private:
  void control() {
    auto command = publisher_->borrow_loaned_message();
    command->x = gain_ * (range_ - 1.0);
    publisher_->publish(std::move(command));
  }

  double gain_ = 0;
  float range_ = 1;
  std::shared_ptr<takt::CallbackGroup> group_;
  std::shared_ptr<takt::Publisher<Twist>> publisher_;
  std::shared_ptr<takt::Subscription<Range>> subscription_;
  std::shared_ptr<takt::Timer> timer_;
};

}  // namespace demo

TAKT_REGISTER_COMPONENT(demo::Follower)
