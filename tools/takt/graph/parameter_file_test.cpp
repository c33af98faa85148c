// What `takt param dump` writes is read by ROS 2's parser of parameter files, whose rules are here.
// SPDX-License-Identifier: Apache-2.0
#include "graph/parameter_file.hpp"

#include <cstdlib>
#include <limits>
#include <set>
#include <string>

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "graph/dynamic_message.hpp"

namespace takt::tools {
namespace {

using Json = nlohmann::ordered_json;

/// A scalar by rcl_yaml_param_parser (parse.c, get_value):
/// 1. A quoted one is a string.
/// 2. y, yes, true and on are booleans, and so are n, no, false and off: in small or large letters,
///    or with a large first one, but "y" and "n" and their like alone, "tRue" not.
/// 3. What strtoll takes whole, base 0, is an integer: 0x1f is 31, and 010 is 8.
/// 4. .inf, .nan and the like, or what strtod takes whole, is a double: inf, nan, 0x1p3, too.
/// 5. Anything else is a string.
Json scalar(const YAML::Node& node) {
  const std::string& text = node.Scalar();
  if (node.Tag() == "!") return text;
  static const std::set<std::string> kTrue{"Y",    "y",    "yes", "Yes", "YES", "true",
                                           "True", "TRUE", "on",  "On",  "ON"},
      kFalse{"N", "n", "no", "No", "NO", "false", "False", "FALSE", "off", "Off", "OFF"};
  if (kTrue.contains(text) || kFalse.contains(text)) return kTrue.contains(text);
  char* end = nullptr;
  errno = 0;
  const long long integer = std::strtoll(text.c_str(), &end, 0);
  if (errno == 0 && end != text.c_str() && *end == '\0') return integer;
  std::string number = text;
  for (const char* const special :
       {".nan", ".NaN", ".NAN", ".inf", ".Inf", ".INF", "+.inf", "-.inf"}) {
    if (text == special) number.erase(number.find('.'), 1);
  }
  errno = 0;
  const double real = std::strtod(number.c_str(), &end);
  if (errno == 0 && end != number.c_str() && *end == '\0') return real;
  return text;
}

/// A value: a scalar, or a list of scalars of one type. Throws if it is neither.
Json value_of(const YAML::Node& node) {
  if (node.IsScalar()) return scalar(node);
  if (!node.IsSequence()) throw std::invalid_argument("a parameter has no value");
  Json list = Json::array();
  for (const YAML::Node& element : node) {
    if (!element.IsScalar()) throw std::invalid_argument("a list in a list");
    list.push_back(scalar(element));
    if (list.back().type() != list.front().type()) {
      throw std::invalid_argument("a list should be of one type");
    }
  }
  return list;
}

/// Node names that lead to `ros__parameters`, which lead to values by names.
Json parameters_in(const std::string& text) {
  Json parameters;
  for (const auto& entry : YAML::Load(text)["/front/lidar"]["ros__parameters"]) {
    parameters[entry.first.as<std::string>()] = value_of(entry.second);
  }
  return parameters;
}

TEST(ParameterFile, IsReadByRos2AsWhatItWas) {
  Json parameters{{"yes", true},
                  {"least", std::numeric_limits<std::int64_t>::min()},
                  {"whole", 5.0},
                  {"large", 1e20},
                  {"small", 1e-7},
                  {"infinite", -std::numeric_limits<double>::infinity()},
                  {"bytes", {0, 255}},
                  {"gains", {1.0, 0.5, 1e30}},
                  {"flags", {true, false}},
                  {"words", {"yes", "5", ".nan", "a, b]"}}};
  for (const char* const text :
       {"yes",  "off", "Y",   "0x1f", "010", "1e3",  "inf", ".nan", "null", "~",     "",
        "a: b", "- a", "# a", "it's", "\"",  "a\nb", "\t",  "\\",   "[1]",  "\u00fc"}) {
    parameters["text " + std::to_string(parameters.size())] = text;
  }
  const std::string text = to_yaml({{"/front/lidar", {{kRosParameters, parameters}}}});
  const Json read = parameters_in(text);
  EXPECT_EQ(read, parameters) << text;
  for (const auto& [name, value] : parameters.items()) {
    EXPECT_EQ(read.at(name).is_number_float(), value.is_number_float()) << name;
  }
}

// The rules above refuse what ROS 2 refuses, and read some values as other ones than YAML does.
TEST(ParameterFile, OfOthersIsRefusedByRos2) {
  const auto file = [](const std::string& value) {
    return "/front/lidar:\n  ros__parameters:\n    a: " + value + "\n";
  };
  for (const char* const value : {"[1, 2.0]", "[yes, 1]", "[a, 1]", "[[1]]", ""}) {
    EXPECT_THROW(parameters_in(file(value)), std::invalid_argument) << value;
  }
  EXPECT_EQ(parameters_in(file("yes"))["a"], Json(true));
  EXPECT_EQ(parameters_in(file("010"))["a"], Json(8));
  EXPECT_EQ(parameters_in(file("tRue"))["a"], Json("tRue"));
}

}  // namespace
}  // namespace takt::tools
