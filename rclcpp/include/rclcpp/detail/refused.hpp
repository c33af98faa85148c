// Compile-time errors for the parts of rclcpp that Takt does not have.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__DETAIL__REFUSED_HPP_
#define RCLCPP__DETAIL__REFUSED_HPP_

namespace rclcpp::detail {
template <class...>
inline constexpr bool kRefused = false;
}  // namespace rclcpp::detail

/// Declares a member function whose calls do not compile, with an error that says why.
#define RCLCPP_REFUSED_(name, what)                                                         \
  template <class... Arguments>                                                             \
  void name(Arguments&&...) {                                                               \
    static_assert(::rclcpp::detail::kRefused<Arguments...>,                                 \
                  "Takt's layer for rclcpp has no " what ": see docs/reference/rclcpp.md"); \
  }

#endif  // RCLCPP__DETAIL__REFUSED_HPP_
