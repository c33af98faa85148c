// Compile-time errors for the parts of rclcpp that Takt does not have.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__DETAIL__REFUSED_HPP_
#define RCLCPP__DETAIL__REFUSED_HPP_

namespace rclcpp::detail {
template <class...>
inline constexpr bool kRefused = false;
}  // namespace rclcpp::detail

/// Does not compile where the types are known, with an error that says why.
#define RCLCPP_REFUSED_FOR_(what, ...)                   \
  static_assert(::rclcpp::detail::kRefused<__VA_ARGS__>, \
                "Takt's layer for rclcpp has no " what ": see docs/reference/rclcpp.md")

/// Declares a function, of a class or of a namespace, whose calls do not compile.
#define RCLCPP_REFUSED_(name, what)          \
  template <class... Arguments>              \
  void name(Arguments&&...) {                \
    RCLCPP_REFUSED_FOR_(what, Arguments...); \
  }

/// Declares a class that may be named, but not used.
#define RCLCPP_REFUSED_CLASS_(name, what) \
  template <class T>                      \
  class Refused##name {                   \
    RCLCPP_REFUSED_FOR_(what, T);         \
  };                                      \
  using name = Refused##name<void>;

#endif  // RCLCPP__DETAIL__REFUSED_HPP_
