// What examples/23_workspace uses of diagnostic_updater, for tests without its source.
// SPDX-License-Identifier: Apache-2.0
#ifndef DIAGNOSTIC_UPDATER_DIAGNOSTIC_UPDATER_HPP_
#define DIAGNOSTIC_UPDATER_DIAGNOSTIC_UPDATER_HPP_

#include <chrono>
#include <string>

#include <diagnostic_msgs/msg/diagnostic_array.hpp>
#include <rclcpp/rclcpp.hpp>

namespace diagnostic_updater {

class DiagnosticStatusWrapper : public diagnostic_msgs::msg::DiagnosticStatus {
 public:
  void summary(unsigned char severity, const std::string& text) {
    level = severity;
    message = text;
  }
  void add(const std::string& key, double value) {
    values.emplace_back();
    values.back().key = key;
    values.back().value = std::to_string(value);
  }
};

/// Of one status.
class Updater {
 public:
  explicit Updater(rclcpp::Node* node)
      : node_(*node),
        statuses_(
            node->create_publisher<diagnostic_msgs::msg::DiagnosticArray>("/diagnostics", 1)) {}
  void setHardwareID(const std::string& id) { hardware_id_ = id; }
  template <class Owner>
  void add(const std::string& name, Owner* owner,
           void (Owner::*diagnose)(DiagnosticStatusWrapper&)) {
    timer_ = node_.create_wall_timer(std::chrono::seconds(1), [this, name, owner, diagnose] {
      DiagnosticStatusWrapper status;
      status.name = std::string(node_.get_name()) + ": " + name;
      status.hardware_id = hardware_id_;
      (owner->*diagnose)(status);
      diagnostic_msgs::msg::DiagnosticArray message;
      message.header.stamp = node_.now();
      message.status.push_back(status);
      statuses_->publish(message);
    });
  }

 private:
  rclcpp::Node& node_;
  std::string hardware_id_;
  rclcpp::Publisher<diagnostic_msgs::msg::DiagnosticArray>::SharedPtr statuses_;
  rclcpp::TimerBase::SharedPtr timer_;
};

}  // namespace diagnostic_updater

#endif  // DIAGNOSTIC_UPDATER_DIAGNOSTIC_UPDATER_HPP_
