// The name that programs include for what is in rclcpp_lifecycle/state.hpp.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP_LIFECYCLE__TRANSITION_HPP_
#define RCLCPP_LIFECYCLE__TRANSITION_HPP_

#include "rclcpp_lifecycle/state.hpp"

#endif  // RCLCPP_LIFECYCLE__TRANSITION_HPP_
