// Parameter values, descriptors and results.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_NODES_PARAMETER_HPP_
#define TAKT_NODES_PARAMETER_HPP_

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "takt/base/visibility.hpp"

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

/// What is known of a parameter besides its value.
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

/// What has changed together.
struct ParameterChanges {
  Parameters added, changed;
  std::vector<std::string> deleted;
};

struct ListParametersResult {
  std::vector<std::string> names;
  std::vector<std::string> prefixes;  // of these names: "a.b" for "a.b.c"
};

}  // namespace takt

#endif  // TAKT_NODES_PARAMETER_HPP_
