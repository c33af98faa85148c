// The name that programs include for what is in rclcpp/client.hpp.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__FUTURE_RETURN_CODE_HPP_
#define RCLCPP__FUTURE_RETURN_CODE_HPP_

#include "rclcpp/client.hpp"

#endif  // RCLCPP__FUTURE_RETURN_CODE_HPP_
