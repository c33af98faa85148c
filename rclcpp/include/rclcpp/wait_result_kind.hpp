// The name that programs include for what is in rclcpp/wait_set.hpp.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__WAIT_RESULT_KIND_HPP_
#define RCLCPP__WAIT_RESULT_KIND_HPP_

#include "rclcpp/wait_set.hpp"

#endif  // RCLCPP__WAIT_RESULT_KIND_HPP_
