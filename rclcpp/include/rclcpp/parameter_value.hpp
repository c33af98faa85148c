// Values of parameters, over Takt's.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__PARAMETER_VALUE_HPP_
#define RCLCPP__PARAMETER_VALUE_HPP_

#include <cstdint>
#include <iosfwd>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "takt/messages/rcl_interfaces/msg/parameter_type.hpp"
#include "takt/messages/rcl_interfaces/msg/parameter_value.hpp"
#include "takt/nodes/parameter.hpp"

namespace rclcpp {

/// The order is that of takt::ParameterValue and rcl_interfaces/msg/ParameterType.
enum ParameterType : std::uint8_t {
  PARAMETER_NOT_SET = 0,
  PARAMETER_BOOL = 1,
  PARAMETER_INTEGER = 2,
  PARAMETER_DOUBLE = 3,
  PARAMETER_STRING = 4,
  PARAMETER_BYTE_ARRAY = 5,
  PARAMETER_BOOL_ARRAY = 6,
  PARAMETER_INTEGER_ARRAY = 7,
  PARAMETER_DOUBLE_ARRAY = 8,
  PARAMETER_STRING_ARRAY = 9,
};
std::string to_string(ParameterType type);
std::ostream& operator<<(std::ostream& stream, ParameterType type);

class ParameterTypeException : public std::runtime_error {
 public:
  ParameterTypeException(ParameterType expected, ParameterType actual)
      : std::runtime_error("expected [" + to_string(expected) + "] got [" + to_string(actual) +
                           "]") {}
};

namespace detail {
/// The type that stores a T: std::int64_t for int, double for float, also in lists.
template <class T>
using StoredParameter = decltype(takt::detail::widened(std::declval<std::decay_t<T>>()));
template <class T>
constexpr ParameterType parameter_type_of() {
  using Stored = StoredParameter<T>;
  if constexpr (std::is_same_v<Stored, bool>) return PARAMETER_BOOL;
  if constexpr (std::is_same_v<Stored, std::int64_t>) return PARAMETER_INTEGER;
  if constexpr (std::is_same_v<Stored, double>) return PARAMETER_DOUBLE;
  if constexpr (std::is_same_v<Stored, std::string>) return PARAMETER_STRING;
  if constexpr (std::is_same_v<Stored, std::vector<std::uint8_t>>) return PARAMETER_BYTE_ARRAY;
  if constexpr (std::is_same_v<Stored, std::vector<bool>>) return PARAMETER_BOOL_ARRAY;
  if constexpr (std::is_same_v<Stored, std::vector<std::int64_t>>) return PARAMETER_INTEGER_ARRAY;
  if constexpr (std::is_same_v<Stored, std::vector<double>>) return PARAMETER_DOUBLE_ARRAY;
  if constexpr (std::is_same_v<Stored, std::vector<std::string>>) return PARAMETER_STRING_ARRAY;
  return PARAMETER_NOT_SET;
}
template <class T>
inline constexpr bool kIsParameter = parameter_type_of<T>() != PARAMETER_NOT_SET;
}  // namespace detail

/// Thread safety: a value. Real-time: as its type.
class ParameterValue {
 public:
  ParameterValue() = default;
  explicit ParameterValue(const rcl_interfaces::msg::ParameterValue& message);
  template <class T>
  requires detail::kIsParameter<T>
  explicit ParameterValue(const T& value) : value_(takt::detail::widened(std::decay_t<T>(value))) {}
  explicit ParameterValue(takt::ParameterValue value) : value_(std::move(value)) {}

  ParameterType get_type() const { return static_cast<ParameterType>(value_.index()); }
  rcl_interfaces::msg::ParameterValue to_value_msg() const;
  const takt::ParameterValue& to_takt() const { return value_; }
  friend bool operator==(const ParameterValue&, const ParameterValue&) = default;

  template <ParameterType type>
  const auto& get() const {
    if (get_type() != type) throw ParameterTypeException(type, get_type());
    return std::get<static_cast<std::size_t>(type)>(value_);
  }
  /// A reference to the stored value, or a converted copy if T is another type.
  template <class T>
  decltype(auto) get() const {
    if constexpr (std::is_same_v<T, ParameterValue>) {
      return (*this);
    } else {
      constexpr ParameterType kType = detail::parameter_type_of<T>();
      static_assert(kType != PARAMETER_NOT_SET, "no parameter has this type");
      const auto& stored = get<kType>();
      if constexpr (std::is_same_v<std::decay_t<decltype(stored)>, T>) {
        return (stored);
      } else if constexpr (std::is_arithmetic_v<T>) {
        return static_cast<T>(stored);
      } else {
        return T(stored.begin(), stored.end());
      }
    }
  }

 private:
  takt::ParameterValue value_;
};
std::string to_string(const ParameterValue& value);

}  // namespace rclcpp

#endif  // RCLCPP__PARAMETER_VALUE_HPP_
