// Parameters of nodes: values, descriptors, results and callbacks.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_NODES_PARAMETER_HPP_
#define TAKT_NODES_PARAMETER_HPP_

#include <concepts>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/entities/callback_list.hpp"

namespace TAKT_PUBLIC takt {

/// The value of a parameter: rcl_interfaces' types in their order. The first one is not set.
using ParameterValue =
    std::variant<std::monostate, bool, std::int64_t, double, std::string, std::vector<std::uint8_t>,
                 std::vector<bool>, std::vector<std::int64_t>, std::vector<double>,
                 std::vector<std::string>>;
using Parameters = std::map<std::string, ParameterValue, std::less<>>;

struct Parameter {
  std::string name;
  ParameterValue value;
};

/// "integer", "string array" and so on; "not set".
std::string_view type_name(const ParameterValue& value) noexcept;
/// As configuration files write it: 0.5, 'map', [1, 2].
std::string to_string(const ParameterValue& value);

/// Both ends belong to the range. Between them, only whole steps from `from_value` do; a step of 0
/// allows every value.
struct IntegerRange {
  std::int64_t from_value = 0, to_value = 0;
  std::uint64_t step = 0;
};
/// The same. Values that differ by rounding only are equal.
struct FloatingPointRange {
  double from_value = 0, to_value = 0, step = 0;
};

/// The properties of a parameter besides its value.
struct ParameterDescriptor {
  std::string description;
  std::string additional_constraints;  // for readers; callbacks check them
  bool read_only = false;              // only the configuration may give it
  /// The value may have any type, or none, and the parameter may be undeclared. Otherwise, its type
  /// is that of the default value, for good. A range is one of values of its type.
  bool dynamic_typing = false;
  std::optional<IntegerRange> integer_range;               // of an integer
  std::optional<FloatingPointRange> floating_point_range;  // of a floating-point number
};

/// The result of setting parameters.
struct SetParametersResult {
  bool successful = true;
  std::string reason;  // why not
};

/// Parameters that have changed together.
struct ParameterChanges {
  Parameters added, changed;
  std::vector<std::string> deleted;
};

struct ListParametersResult {
  std::vector<std::string> names;
  std::vector<std::string> prefixes;  // of these names: "a.b" for "a.b.c"
};

/// Called first, with the values that are to be set; may change, add and remove some.
using PreSetParametersCallback = std::function<void(Parameters&)>;
/// Called with values before they are set; may reject them all with a reason.
using OnSetParametersCallback = std::function<SetParametersResult(const Parameters&)>;
/// Called with values after they were set.
using PostSetParametersCallback = std::function<void(const Parameters&)>;
/// Each keeps a callback: when it is dropped, no further call begins, and one that runs on another
/// thread is waited for, but for calls that wait for each other.
using PreSetParametersHandle = detail::CallbackHandle<void(Parameters&)>;
using OnSetParametersHandle = detail::CallbackHandle<SetParametersResult(const Parameters&)>;
using PostSetParametersHandle = detail::CallbackHandle<void(const Parameters&)>;

/// Called after parameters were declared, set or undeclared, on the thread that did so, in the
/// order of the changes.
using ParametersListener = std::function<void(const ParameterChanges&)>;

namespace detail {

// The range of the code's integer type.
struct IntegerLimits {
  std::int64_t lowest = std::numeric_limits<std::int64_t>::min();
  std::int64_t highest = std::numeric_limits<std::int64_t>::max();
};

template <class T>
inline constexpr bool kIsInteger = std::integral<T> && !std::same_as<T, bool>;
template <class T>
inline constexpr bool kIsList = false;
template <class Item>
inline constexpr bool kIsList<std::vector<Item>> = true;
template <class T>
constexpr IntegerLimits integer_limits() {
  IntegerLimits limits;
  if constexpr (kIsList<T>) {
    limits = integer_limits<typename T::value_type>();
  } else if constexpr (kIsInteger<T>) {
    using Own = std::numeric_limits<T>;
    limits.lowest = static_cast<std::int64_t>(Own::min());
    if constexpr (std::is_signed_v<T> || sizeof(T) < sizeof(std::int64_t)) {
      limits.highest = static_cast<std::int64_t>(Own::max());
    }
  }
  return limits;
}
// int and float become the parameter types int64 and double, also in lists; a list of bytes is one.
template <class T>
auto widened(T value) {
  if constexpr (kIsInteger<T>) {
    return static_cast<std::int64_t>(value);
  } else if constexpr (std::floating_point<T>) {
    return static_cast<double>(value);
  } else if constexpr (std::convertible_to<T, std::string>) {
    return std::string(std::move(value));
  } else if constexpr (kIsList<T> && !std::same_as<T, std::vector<std::uint8_t>>) {
    using List = std::vector<decltype(widened(typename T::value_type{}))>;
    if constexpr (std::same_as<T, List>) return value;
    return List(value.begin(), value.end());
  } else {
    return value;
  }
}

[[noreturn]] void refuse_type(const std::string& node, std::string_view name,
                              const ParameterValue& is, const ParameterValue& wanted);
[[noreturn]] void refuse_narrow(const std::string& node, std::string_view name,
                                const ParameterValue& is);

/// Throws Error when the value is of another type, or more than T can hold.
template <class T>
T as(const std::string& node, std::string_view name, ParameterValue value) {
  if constexpr (std::same_as<T, ParameterValue>) {
    return value;
  } else {
    using Stored = decltype(widened(std::declval<T>()));
    auto* stored = std::get_if<Stored>(&value);
    if (stored == nullptr) refuse_type(node, name, value, ParameterValue(Stored{}));
    constexpr IntegerLimits kLimits = integer_limits<T>();
    const auto check = [&](const auto& item) {
      if constexpr (kIsInteger<std::decay_t<decltype(item)>>) {
        if (item < kLimits.lowest || item > kLimits.highest) refuse_narrow(node, name, value);
      }
    };
    if constexpr (kIsList<T> && !std::same_as<T, Stored>) {
      for (const auto& item : *stored) check(item);
      return T(stored->begin(), stored->end());
    } else {
      check(*stored);
      return static_cast<T>(std::move(*stored));
    }
  }
}

}  // namespace detail
}  // namespace takt

#endif  // TAKT_NODES_PARAMETER_HPP_
