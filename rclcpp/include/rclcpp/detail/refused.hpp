// How the layer refuses what it does not have.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__DETAIL__REFUSED_HPP_
#define RCLCPP__DETAIL__REFUSED_HPP_

namespace rclcpp::detail {
template <class...>
inline constexpr bool kRefused = false;
}  // namespace rclcpp::detail

/// A member function that does not compile where it is called, and says why.
#define RCLCPP_REFUSED_(name, what)                                                         \
  template <class... Arguments>                                                             \
  void name(Arguments&&...) {                                                               \
    static_assert(::rclcpp::detail::kRefused<Arguments...>,                                 \
                  "Takt's layer for rclcpp has no " what ": see docs/reference/rclcpp.md"); \
  }

#endif  // RCLCPP__DETAIL__REFUSED_HPP_
