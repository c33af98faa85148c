// An allocator for another type.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__ALLOCATOR__ALLOCATOR_COMMON_HPP_
#define RCLCPP__ALLOCATOR__ALLOCATOR_COMMON_HPP_

#include "rcl/allocator.h"
#include "rclcpp/allocator/allocator_deleter.hpp"

namespace rclcpp::allocator {

template <class T, class Allocator>
using AllocRebind = typename std::allocator_traits<Allocator>::template rebind_traits<T>;

}  // namespace rclcpp::allocator

#endif  // RCLCPP__ALLOCATOR__ALLOCATOR_COMMON_HPP_
