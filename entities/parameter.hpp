// Values that a component is configured with.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_PARAMETER_HPP_
#define TAKT_ENTITIES_PARAMETER_HPP_

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace takt {

/// The value of a parameter: rcl_interfaces' types.
using ParameterValue = std::variant<bool, std::int64_t, double, std::string, std::vector<bool>,
                                    std::vector<std::int64_t>, std::vector<double>,
                                    std::vector<std::string>>;
using Parameters = std::map<std::string, ParameterValue, std::less<>>;

/// "integer", "string array" and so on.
std::string_view type_name(const ParameterValue& value) noexcept;

}  // namespace takt

#endif  // TAKT_ENTITIES_PARAMETER_HPP_
