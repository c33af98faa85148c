// What can be asked of a message, service or action type, under rosidl's names.
// SPDX-License-Identifier: Apache-2.0
#ifndef ROSIDL_RUNTIME_CPP__TRAITS_HPP_
#define ROSIDL_RUNTIME_CPP__TRAITS_HPP_

#include <string>
#include <type_traits>

#include "takt/messages/message_type.hpp"
#include "takt/messages/yaml.hpp"

namespace rosidl_generator_traits {

using takt::to_yaml;

template <class T>
struct is_message : std::bool_constant<takt::Message<T>> {};
template <class T>
concept HasRequest = takt::Message<typename T::Request> && takt::Message<typename T::Response>;
template <class T>
struct is_service : std::bool_constant<HasRequest<T>> {};
template <class T>
concept HasGoal = takt::Message<typename T::Goal> && takt::Message<typename T::Result> &&
    takt::Message<typename T::Feedback>;
template <class T>
struct is_action : std::bool_constant<HasGoal<T>> {};

/// True for a type without strings and sequences.
template <takt::Message T>
struct has_fixed_size : std::is_trivially_copyable<T> {};

/// "std_msgs/msg/String"
template <class T>
const char* name() {
  static const std::string text = [] {
    if constexpr (is_message<T>::value) {
      return takt::message_type<T>().name;
    } else if constexpr (is_service<T>::value) {
      const std::string request = takt::message_type<typename T::Request>().name;
      return request.substr(0, request.rfind("_Request"));
    } else {
      static_assert(is_action<T>::value, "T is a message, a service or an action");
      const std::string goal = takt::message_type<typename T::Goal>().name;
      return goal.substr(0, goal.rfind("_Goal"));
    }
  }();
  return text.c_str();
}

/// "std_msgs::msg::String"
template <class T>
const char* data_type() {
  static const std::string text = [] {
    std::string result = name<T>();
    for (std::size_t at = 0; (at = result.find('/', at)) != std::string::npos;) {
      result.replace(at, 1, "::");
    }
    return result;
  }();
  return text.c_str();
}

}  // namespace rosidl_generator_traits

#endif  // ROSIDL_RUNTIME_CPP__TRAITS_HPP_
