// Metadata of a received message: time stamps, sequence number and GID of the publisher.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__MESSAGE_INFO_HPP_
#define RCLCPP__MESSAGE_INFO_HPP_

#include "takt/entities/subscription.hpp"

#include "rmw/types.h"

namespace rclcpp {

/// Thread safety: a value. Real-time: yes.
class MessageInfo {
 public:
  MessageInfo() : info_{} {}
  explicit MessageInfo(const rmw_message_info_t& info) : info_(info) {}
  explicit MessageInfo(const takt::MessageInfo& info);
  MessageInfo(const MessageInfo&) = default;
  MessageInfo& operator=(const MessageInfo&) = default;
  ~MessageInfo() {}  // NOLINT: not trivial, see Time

  const rmw_message_info_t& get_rmw_message_info() const { return info_; }
  rmw_message_info_t& get_rmw_message_info() { return info_; }

 private:
  rmw_message_info_t info_;
};

}  // namespace rclcpp

#endif  // RCLCPP__MESSAGE_INFO_HPP_
