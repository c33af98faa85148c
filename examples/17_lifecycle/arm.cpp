// SPDX-License-Identifier: Apache-2.0
#include "takt/takt.hpp"

namespace demo {

struct Torque {
  double newton_metres = 0;
};
TAKT_MESSAGE(Torque, "demo/msg/Torque", newton_metres);

class Arm : public takt::LifecycleNode {
 public:
  explicit Arm(const takt::NodeOptions& options) : LifecycleNode("arm", options) {
    declare_parameter("rate_hz", 100);
    torque_ = create_publisher<Torque>("torque", 1, {.loans = 4});
  }

 protected:
  // Gets what the node needs to be active: memory, devices, timers. FAILURE: it stays unconfigured.
  takt::CallbackReturn on_configure(takt::LifecycleState) override {
    const auto rate_hz = get_parameter<std::int64_t>("rate_hz");
    if (rate_hz < 1) return takt::CallbackReturn::FAILURE;
    control_ = create_timer("control", takt::Nanoseconds(1'000'000'000 / rate_hz),
                            [this] { torque_->publish(Torque{0.1 * ++cycle_}); });
    return takt::CallbackReturn::SUCCESS;
  }
  // From here on the timer is due, and the publisher sends. No callback of the node has run yet.
  takt::CallbackReturn on_activate(takt::LifecycleState) override {
    cycle_ = 0;
    return takt::CallbackReturn::SUCCESS;
  }
  // The running callbacks have returned, and no other one begins: the arm can be stopped here.
  takt::CallbackReturn on_deactivate(takt::LifecycleState) override {
    return takt::CallbackReturn::SUCCESS;
  }
  // Gives back what on_configure got.
  takt::CallbackReturn on_cleanup(takt::LifecycleState) override {
    control_.reset();
    return takt::CallbackReturn::SUCCESS;
  }

 private:
  int cycle_ = 0;
  std::shared_ptr<takt::LifecyclePublisher<Torque>> torque_;
  std::shared_ptr<takt::Timer> control_;
};

}  // namespace demo

TAKT_REGISTER_COMPONENT(demo::Arm, "a lifecycle node")
