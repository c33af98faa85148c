// SPDX-License-Identifier: Apache-2.0
#include "takt/nodes/parameter.hpp"

#include <fmt/format.h>

namespace takt {
namespace {

struct Written {
  std::string operator()(std::monostate) const { return "not set"; }
  std::string operator()(bool value) const { return value ? "true" : "false"; }
  std::string operator()(std::uint8_t value) const { return fmt::format("{}", value); }
  std::string operator()(std::int64_t value) const { return fmt::format("{}", value); }
  std::string operator()(double value) const { return fmt::format("{}", value); }
  std::string operator()(const std::string& value) const { return "'" + value + "'"; }
  template <class T>
  std::string operator()(const std::vector<T>& values) const {
    std::string result = "[";
    for (const T& value : values) result += (result.size() > 1 ? ", " : "") + (*this)(value);
    return result + "]";
  }
};

}  // namespace

std::string_view type_name(const ParameterValue& value) noexcept {
  static constexpr std::string_view kNames[] = {"not set",
                                                "boolean",
                                                "integer",
                                                "floating-point number",
                                                "string",
                                                "byte array",
                                                "boolean array",
                                                "integer array",
                                                "floating-point number array",
                                                "string array"};
  return kNames[value.index()];
}

std::string to_string(const ParameterValue& value) {
  return std::visit(Written(), value);
}

}  // namespace takt
