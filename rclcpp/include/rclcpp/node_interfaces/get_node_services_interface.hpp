// The name that programs include for what is in rclcpp/node_interfaces/node_interfaces.hpp.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__NODE_INTERFACES__GET_NODE_SERVICES_INTERFACE_HPP_
#define RCLCPP__NODE_INTERFACES__GET_NODE_SERVICES_INTERFACE_HPP_

#include "rclcpp/node_interfaces/node_interfaces.hpp"

#endif  // RCLCPP__NODE_INTERFACES__GET_NODE_SERVICES_INTERFACE_HPP_
