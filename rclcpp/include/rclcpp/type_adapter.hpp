// Types of the user's that are converted from and to messages.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__TYPE_ADAPTER_HPP_
#define RCLCPP__TYPE_ADAPTER_HPP_

#include <type_traits>

#include "takt/messages/message_type.hpp"

namespace rclcpp {

/// A specialisation has is_specialized, custom_type, ros_message_type, and the functions
/// convert_to_ros_message and convert_to_custom.
template <class Custom, class Message = void, class Enable = void>
struct TypeAdapter {
  using is_specialized = std::false_type;
  using custom_type = Custom;
  using ros_message_type = Custom;
};

template <class T>
struct is_type_adapter : std::false_type {};
template <class... Ts>
struct is_type_adapter<TypeAdapter<Ts...>> : std::true_type {};

/// Declares that a custom type stands for this message wherever no message type is named.
template <class T>
struct ImplicitTypeAdapter {
  using is_specialized = std::false_type;
};

template <class T>
struct adapt_type {
  template <class Message>
  using as = TypeAdapter<T, Message>;
};

namespace detail {

template <class T>
struct Adapted {  // T is a message, not adapted
  static constexpr bool kIsAdapted = false;
  using Custom = T;
  using Ros = T;
};
template <class Custom_, class Ros_, class Enable>
struct Adapted<TypeAdapter<Custom_, Ros_, Enable>> {
  static_assert(TypeAdapter<Custom_, Ros_, Enable>::is_specialized::value,
                "no rclcpp::TypeAdapter is specialised for these types");
  static constexpr bool kIsAdapted = true;
  using Adapter = TypeAdapter<Custom_, Ros_, Enable>;
  using Custom = Custom_;
  using Ros = Ros_;
};
template <class T>
requires(ImplicitTypeAdapter<T>::is_specialized::value) struct Adapted<T>
    : Adapted<ImplicitTypeAdapter<T>> {
};
template <class T>
requires(ImplicitTypeAdapter<T>::is_specialized::value) struct Adapted<ImplicitTypeAdapter<T>> {
  static constexpr bool kIsAdapted = true;
  using Adapter = ImplicitTypeAdapter<T>;
  using Custom = typename Adapter::custom_type;
  using Ros = typename Adapter::ros_message_type;
};

}  // namespace detail
}  // namespace rclcpp

/// Lets a program name only the custom type when it makes a publisher or subscription. Use at
/// global scope.
#define RCLCPP_USING_CUSTOM_TYPE_AS_ROS_MESSAGE_TYPE(CUSTOM_TYPE, ROS_MESSAGE_TYPE)                \
  template <>                                                                                      \
  struct rclcpp::ImplicitTypeAdapter<CUSTOM_TYPE>                                                  \
      : public rclcpp::TypeAdapter<CUSTOM_TYPE, ROS_MESSAGE_TYPE> {                                \
    static_assert(is_specialized::value, "no rclcpp::TypeAdapter is specialised for these types"); \
  }

#endif  // RCLCPP__TYPE_ADAPTER_HPP_
