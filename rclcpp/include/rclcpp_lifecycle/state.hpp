// States and transitions of lifecycle nodes.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP_LIFECYCLE__STATE_HPP_
#define RCLCPP_LIFECYCLE__STATE_HPP_

#include <cstdint>
#include <string>
#include <utility>

namespace rclcpp_lifecycle {

/// The id of lifecycle_msgs/msg/State, and its label.
/// Thread safety: a value. Real-time: yes, but for copies.
class State {
 public:
  State() = default;
  explicit State(std::uint8_t id, const std::string& label = "") : id_(id), label_(label) {}
  std::uint8_t id() const { return id_; }
  std::string label() const { return label_; }

 private:
  std::uint8_t id_ = 0;
  std::string label_ = "unknown";
};

/// The id of lifecycle_msgs/msg/Transition, its label, and where it leads.
/// Thread safety: a value. Real-time: yes, but for copies.
class Transition {
 public:
  explicit Transition(std::uint8_t id, const std::string& label = "") : id_(id), label_(label) {}
  Transition(std::uint8_t id, const std::string& label, State&& start, State&& goal)
      : id_(id), label_(label), start_(std::move(start)), goal_(std::move(goal)) {}
  std::uint8_t id() const { return id_; }
  std::string label() const { return label_; }
  State start_state() const { return start_; }
  State goal_state() const { return goal_; }

 private:
  std::uint8_t id_;
  std::string label_;
  State start_, goal_;
};

}  // namespace rclcpp_lifecycle

#endif  // RCLCPP_LIFECYCLE__STATE_HPP_
