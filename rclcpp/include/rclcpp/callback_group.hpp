// Callback groups.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__CALLBACK_GROUP_HPP_
#define RCLCPP__CALLBACK_GROUP_HPP_

#include "takt/callback_groups/callback_group.hpp"

namespace rclcpp {
/// Takt's classes; CallbackGroup has the pointer aliases of rclcpp.
using takt::CallbackGroup;
using takt::CallbackGroupType;
}  // namespace rclcpp

#endif  // RCLCPP__CALLBACK_GROUP_HPP_
