// The name that programs include for what is in rclcpp/publisher_options.hpp.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__INTRA_PROCESS_SETTING_HPP_
#define RCLCPP__INTRA_PROCESS_SETTING_HPP_

#include "rclcpp/publisher_options.hpp"

#endif  // RCLCPP__INTRA_PROCESS_SETTING_HPP_
