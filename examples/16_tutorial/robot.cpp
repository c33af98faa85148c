// SPDX-License-Identifier: Apache-2.0
#include "takt/takt.hpp"

namespace robot {

struct Position {
  double angle = 0;
};
TAKT_MESSAGE(Position, "robot/msg/Position", angle);
struct Command {
  double torque = 0;
};
TAKT_MESSAGE(Command, "robot/msg/Command", torque);

class Encoder : public takt::Node {
 public:
  explicit Encoder(const takt::NodeOptions& options) : Node("encoder", options) {
    const auto rate_hz = declare_parameter("rate_hz", 500);
    position_ = create_publisher<Position>("position", 1, {.loans = 4});
    timer_ = create_timer("read", takt::Nanoseconds(1'000'000'000 / rate_hz), [this] { read(); });
  }

 private:
  void read() {
    auto position = position_->borrow_loaned_message();
    if (!position) return;  // all four are on their way
    position->angle = angle_ += 0.001;
    position_->publish(std::move(position));
  }

  double angle_ = 0;
  std::shared_ptr<takt::Publisher<Position>> position_;
  std::shared_ptr<takt::Timer> timer_;
};

class Controller : public takt::Node {
 public:
  explicit Controller(const takt::NodeOptions& options) : Node("controller", options) {
    const double gain = declare_parameter("gain", 0.5);
    command_ = create_publisher<Command>("command", 1, {.loans = 4});
    position_ =
        create_subscription<Position>("position", 1, [this, gain](const Position& position) {
          command_->publish(Command{gain * (1 - position.angle)});
        });
  }

 private:
  std::shared_ptr<takt::Publisher<Command>> command_;
  std::shared_ptr<takt::Subscription<Position>> position_;
};

class Mapper : public takt::Node {
 public:
  explicit Mapper(const takt::NodeOptions& options) : Node("mapper", options) {
    timer_ = create_timer("update", std::chrono::milliseconds(50), [] {
      takt::burn_cpu(std::chrono::milliseconds(20));
    });  // stands for work
  }

 private:
  std::shared_ptr<takt::Timer> timer_;
};

}  // namespace robot

TAKT_REGISTER_COMPONENT(robot::Encoder, "publishes the position of a joint")
TAKT_REGISTER_COMPONENT(robot::Controller, "computes the torque of a joint")
TAKT_REGISTER_COMPONENT(robot::Mapper, "updates a map, which takes 20 ms")
