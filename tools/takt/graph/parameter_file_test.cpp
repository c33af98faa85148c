// What `takt param dump` writes is read by ROS 2's parser of parameter files, whose rules are here.
// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/configuration/parameter_file.hpp"

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <map>
#include <set>
#include <string>

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include "takt/base/error.hpp"
#include "takt/containers/configuration/system_reader.hpp"

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

/// The same by Takt's own reader; throws std::invalid_argument with its errors.
Json as_json(const ParameterValue& value) {
  return std::visit(
      []<class T>(const T& content) -> Json {
        if constexpr (std::is_same_v<T, std::monostate>)
          return nullptr;
        else
          return content;
      },
      value);
}
std::map<std::string, Json> taken(const document::Value& file, document::Errors& errors) {
  std::map<std::string, Json> parameters;
  try {
    for (const auto& section : document::node_parameters(file, errors)) {
      for (const document::Value& value : section.parameters) {
        const auto parameter = read_parameter(value, errors);
        if (parameter) parameters[section.node + ":" + value.name] = as_json(*parameter);
      }
    }
    errors.throw_if_any();
  } catch (const Error& error) {
    throw std::invalid_argument(error.what());
  }
  return parameters;
}
Json taken(const std::string& text) {
  document::Errors errors("a.yaml");
  const auto file = document::parse_yaml(text, errors, document::Rules::parameters);
  return taken(file, errors).at("/front/lidar:a");
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
  const std::string text = to_yaml({{"/front/lidar", {{document::kRosParameters, parameters}}}});
  const Json read = parameters_in(text);
  EXPECT_EQ(read, parameters) << text;
  for (const auto& [name, value] : parameters.items()) {
    EXPECT_EQ(read.at(name).is_number_float(), value.is_number_float()) << name;
  }
}

std::string file(const std::string& value) {
  return "/front/lidar:\n  ros__parameters:\n    a: " + value + "\n";
}

// The rules above refuse what ROS 2 refuses, and read some values as other ones than YAML does.
TEST(ParameterFile, OfOthersIsRefusedByRos2) {
  for (const char* const value : {"[1, 2.0]", "[yes, 1]", "[a, 1]", "[[1]]", ""}) {
    EXPECT_THROW(parameters_in(file(value)), std::invalid_argument) << value;
  }
  EXPECT_EQ(parameters_in(file("yes"))["a"], Json(true));
  EXPECT_EQ(parameters_in(file("010"))["a"], Json(8));
  EXPECT_EQ(parameters_in(file("tRue"))["a"], Json("tRue"));
}

TEST(ParameterFile, OfOthersIsReadAsRos2DoesButForListsOfNumbers) {
  for (const char* const value : {"[yes, 1]", "[a, 1]", "[[1]]", "[{b: 1}]", "", "1e999"}) {
    EXPECT_THROW(taken(file(value)), std::invalid_argument) << value;
  }
  for (const char* const value : {"y",
                                  "N",
                                  "On",
                                  "oN",
                                  "010",
                                  "08",
                                  "0o10",
                                  "0x1F",
                                  "-0x1F",
                                  "+5",
                                  "5.",
                                  ".5",
                                  ".",
                                  "1e3",
                                  "123E5",
                                  "1_000",
                                  "9223372036854775807",
                                  "9223372036854775808",
                                  "-9223372036854775808",
                                  "12:30:45",
                                  "2024-01-01",
                                  "'yes'",
                                  "\"5\"",
                                  "''",
                                  "' '",
                                  "[on, off]",
                                  "[010, 1]",
                                  "[1.0, 5.]",
                                  "0x1p3",
                                  ".inf",
                                  "-.inf",
                                  "+.inf",
                                  "a b",
                                  "a#b",
                                  "!!int 5"}) {
    const std::string text = file(value);
    const Json expected = parameters_in(text)["a"];
    EXPECT_EQ(taken(text), expected) << value;
    EXPECT_EQ(taken(text).is_number_float(), expected.is_number_float()) << value;
  }
  EXPECT_EQ(taken(file("!!str yes")), Json("yes"));
  EXPECT_EQ(taken(file("[!!str 1, !!str 02.0]")), Json({"1", "02.0"}));
  for (const char* const value : {"null", "~", "nan", "inf", "-inf", "Infinity"}) {
    EXPECT_EQ(taken(file(value)), Json(value));
  }
  EXPECT_TRUE(std::isnan(taken(file(".NaN")).get<double>()));
  EXPECT_EQ(taken(file("[1, 2.5]")), Json({1.0, 2.5}));
  for (const char* const value : {"!!float 1", "!!binary aGk=", "!mine 1"}) {
    EXPECT_ANY_THROW(taken(file(value))) << value;
  }
}

std::string errors_in(const std::string& text) {
  document::Errors errors("a.yaml");
  try {
    taken(document::parse_yaml(text, errors, document::Rules::parameters), errors);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

TEST(ParameterFile, HasNoAliasAndNamesOfNodes) {
  EXPECT_EQ(errors_in("a: {ros__parameters: {b: &x 1, c: *x}}"),
            "a.yaml:1: ROS 2 reads no alias ('*…') here; write the value instead");
  EXPECT_EQ(errors_in("a: {ros__parameters: {<<: {b: 1}}}"),
            "a.yaml:1: a merge key is not supported; write the values instead");
  for (const char* const name : {"/fo*", "/**foo", "/a//n", "my-node", "5a", "/", "a/", "***"}) {
    EXPECT_NE(errors_in(std::string("'") + name + "': {ros__parameters: {b: 1}}"), "") << name;
  }
  for (const char* const name : {"/**", "/*", "/**/n", "/x/*/n", "x/n", "n", "_n5"}) {
    EXPECT_EQ(errors_in(std::string("'") + name + "': {ros__parameters: {b: 1}}"), "") << name;
  }
  EXPECT_EQ(errors_in("ros__parameters: {b: 1}").substr(0, 40),
            "a.yaml:1: no node can have the name ''; ");
  EXPECT_NE(errors_in("a: {b: 1}"), "");
  EXPECT_EQ(errors_in("a:\n  ros__parameters:\n"), "");
  // Later ones hold, in the same section or in another one.
  document::Errors errors("a.yaml");
  const auto read = taken(document::parse_yaml("a: {ros__parameters: {b: 1, c: 1, b: 2}}\n"
                                               "a: {ros__parameters: {d: {e: 3}}}",
                                               errors, document::Rules::parameters),
                          errors);
  EXPECT_EQ(read, (std::map<std::string, Json>{{"/a:b", 2}, {"/a:c", 1}, {"/a:d.e", 3}}));
}

TEST(ParameterFile, MeansNodesByWildcards) {
  const auto is = [](const char* pattern, const char* node) {
    return document::is_for_node(pattern, node);
  };
  EXPECT_TRUE(is("/**", "/n") && is("/**", "/x/n") && is("/*", "/n") && is("/**/n", "/n") &&
              is("/**/n", "/x/y/n") && is("/*/n", "/x/n") && is("/x/**", "/x/n") &&
              is("/x/**/n", "/x/n") && is("/x/n", "/x/n") && is("/**/a/**/b", "/c/a/a/d/b"));
  EXPECT_FALSE(is("/*", "/x/n") || is("/**/n", "/x/m") || is("/*/n", "/n") ||
               is("/x/*", "/x/y/n") || is("/n", "/x/n") || is("/x/n", "/n") ||
               is("/**/a/**/b", "/c/b/a"));
  std::string long_pattern, long_name = "/b";  // would take longer than the world exists
  for (int i = 0; i < 100; ++i) long_pattern += "/**/a", long_name += "/a";
  EXPECT_FALSE(is((long_pattern + "/b").c_str(), long_name.c_str()));
}

/// All sections by the model, as those of taken().
void add_sections(const YAML::Node& map, const std::string& name, std::map<std::string, Json>& all);
void add_values(const YAML::Node& map, const std::string& name, std::map<std::string, Json>& all) {
  for (const auto& entry : map) {
    const std::string key = name + entry.first.Scalar();
    if (entry.second.IsMap()) {
      add_values(entry.second, key + ".", all);
    } else {
      all[key] = value_of(entry.second);
    }
  }
}
void add_sections(const YAML::Node& map, const std::string& name,
                  std::map<std::string, Json>& all) {
  for (const auto& entry : map) {
    const std::string key = entry.first.Scalar();
    if (key == "ros__parameters") {
      if (entry.second.IsMap()) add_values(entry.second, name + ":", all);
    } else {
      add_sections(entry.second, name + (key.starts_with('/') ? "" : "/") + key, all);
    }
  }
}

// A folder with files of robots, which are not Takt's to give on.
TEST(ParameterFile, OfRobotsIsReadAsRos2Does) {
  const char* const folder = std::getenv("TAKT_PARAMETER_FILES");
  if (folder == nullptr) GTEST_SKIP() << "TAKT_PARAMETER_FILES names no folder";
  std::size_t files_read = 0;
  for (const auto& file : std::filesystem::recursive_directory_iterator(folder)) {
    if (file.path().extension() != ".yaml") continue;
    SCOPED_TRACE(file.path());
    std::map<std::string, Json> expected;
    try {
      add_sections(YAML::LoadFile(file.path()), "", expected);
    } catch (const std::exception&) {
      continue;  // ROS 2 does not read it either
    }
    document::Errors errors(file.path());
    try {
      const auto read =
          taken(document::read(file.path(), errors, document::Rules::parameters), errors);
      EXPECT_EQ(Json(read).dump(), Json(expected).dump());  // .nan is not equal to itself
    } catch (const std::exception& error) {
      ADD_FAILURE() << error.what();
    }
    ++files_read;
  }
  EXPECT_GT(files_read, 0u);
}

}  // namespace
}  // namespace takt::tools
