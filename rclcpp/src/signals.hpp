// The contexts that signals shut down.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP_SIGNALS_HPP_
#define RCLCPP_SIGNALS_HPP_

#include "rclcpp/context.hpp"

namespace rclcpp::detail {

/// A signal shuts this context down, unless InitOptions::shutdown_on_signal is false by then.
void shut_down_on_signal(Context& context);
void forget_on_signal(Context& context);

}  // namespace rclcpp::detail

#endif  // RCLCPP_SIGNALS_HPP_
