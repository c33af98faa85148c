// Parameters: a name and a value.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__PARAMETER_HPP_
#define RCLCPP__PARAMETER_HPP_

#include <iosfwd>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "takt/messages/rcl_interfaces/msg/parameter.hpp"

#include "rclcpp/exceptions/exceptions.hpp"
#include "rclcpp/macros.hpp"
#include "rclcpp/parameter_value.hpp"

namespace rclcpp {

/// Thread safety: a value. Real-time: as its type.
class Parameter {
  template <class F>
  decltype(auto) checked(F&& read) const {
    try {
      return read();
    } catch (const ParameterTypeException& exception) {
      throw exceptions::InvalidParameterTypeException(name_, exception.what());
    }
  }

 public:
  RCLCPP_SMART_PTR_DEFINITIONS(Parameter)

  Parameter() = default;
  explicit Parameter(const std::string& name) : name_(name) {}
  Parameter(const std::string& name, const ParameterValue& value) : name_(name), value_(value) {}
  template <class T>
  requires detail::kIsParameter<T> Parameter(const std::string& name, const T& value)
      : name_(name), value_(value) {}

  friend bool operator==(const Parameter&, const Parameter&) = default;

  ParameterType get_type() const { return value_.get_type(); }
  std::string get_type_name() const { return to_string(get_type()); }
  const std::string& get_name() const { return name_; }
  const ParameterValue& get_parameter_value() const { return value_; }
  rcl_interfaces::msg::ParameterValue get_value_message() const { return value_.to_value_msg(); }

  /// Throws exceptions::InvalidParameterTypeException when the parameter has another type.
  template <ParameterType type>
  decltype(auto) get_value() const {
    return checked([this]() -> decltype(auto) { return value_.get<type>(); });
  }
  template <class T>
  decltype(auto) get_value() const {
    if constexpr (std::is_same_v<T, Parameter>) {
      return (*this);
    } else {
      return checked([this]() -> decltype(auto) { return value_.get<T>(); });
    }
  }
  bool as_bool() const { return get_value<PARAMETER_BOOL>(); }
  std::int64_t as_int() const { return get_value<PARAMETER_INTEGER>(); }
  double as_double() const { return get_value<PARAMETER_DOUBLE>(); }
  const std::string& as_string() const { return get_value<PARAMETER_STRING>(); }
  const std::vector<std::uint8_t>& as_byte_array() const {
    return get_value<PARAMETER_BYTE_ARRAY>();
  }
  const std::vector<bool>& as_bool_array() const { return get_value<PARAMETER_BOOL_ARRAY>(); }
  const std::vector<std::int64_t>& as_integer_array() const {
    return get_value<PARAMETER_INTEGER_ARRAY>();
  }
  const std::vector<double>& as_double_array() const { return get_value<PARAMETER_DOUBLE_ARRAY>(); }
  const std::vector<std::string>& as_string_array() const {
    return get_value<PARAMETER_STRING_ARRAY>();
  }

  static Parameter from_parameter_msg(const rcl_interfaces::msg::Parameter& message);
  rcl_interfaces::msg::Parameter to_parameter_msg() const;
  std::string value_to_string() const { return to_string(value_); }

 private:
  std::string name_;
  ParameterValue value_;
};
/// As JSON.
std::string to_string(const Parameter& parameter);
std::string to_string(const std::vector<Parameter>& parameters);
std::ostream& operator<<(std::ostream& stream, const Parameter& parameter);
std::ostream& operator<<(std::ostream& stream, const std::vector<Parameter>& parameters);

}  // namespace rclcpp

#endif  // RCLCPP__PARAMETER_HPP_
