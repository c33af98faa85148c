// Calls that only rclcpp has, each with a small model of what it promises.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP_SEQUENCES_OWN_CALLS_HPP_
#define RCLCPP_SEQUENCES_OWN_CALLS_HPP_

#include <cstdint>
#include <functional>

#include "rclcpp/rclcpp.hpp"

namespace rclcpp {

using NextByte = std::function<std::uint8_t()>;

// Each returns the promise that was broken, or nullptr, and makes its own nodes in this context.

/// Callbacks of a shutdown remove each other, while other threads shut down, too.
const char* shut_down(const NextByte& next);
/// A callback removes its node, moves it or throws, under each spin of one node.
const char* spin_a_node(const Context::SharedPtr& context, const NextByte& next);
/// Drops requests of a client that are older than a time.
const char* prune_requests(const Context::SharedPtr& context, const NextByte& next);
/// A wait set changes while a thread waits.
const char* change_a_wait_set(const Context::SharedPtr& context, const NextByte& next);
/// A clock switches between real and simulated time, while threads sleep by it.
const char* switch_a_clock(const Context::SharedPtr& context, const NextByte& next);
/// Makes timers with and without autostart.
const char* make_timers(const Context::SharedPtr& context, const NextByte& next);
/// Callbacks of parameters remove each other.
const char* remove_parameter_callbacks(const Context::SharedPtr& context, const NextByte& next);

}  // namespace rclcpp

#endif  // RCLCPP_SEQUENCES_OWN_CALLS_HPP_
