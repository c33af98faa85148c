// SPDX-License-Identifier: Apache-2.0
#include "takt/nodes/parameter.hpp"

#include <gtest/gtest.h>

namespace takt {
namespace {

TEST(ParameterValue, NamesEveryType) {
  EXPECT_EQ(type_name({}), "not set");
  EXPECT_EQ(type_name(true), "boolean");
  EXPECT_EQ(type_name(std::int64_t{1}), "integer");
  EXPECT_EQ(type_name(1.0), "floating-point number");
  EXPECT_EQ(type_name(std::string()), "string");
  EXPECT_EQ(type_name(std::vector<std::uint8_t>()), "byte array");
  EXPECT_EQ(type_name(std::vector<bool>()), "boolean array");
  EXPECT_EQ(type_name(std::vector<std::int64_t>()), "integer array");
  EXPECT_EQ(type_name(std::vector<double>()), "floating-point number array");
  EXPECT_EQ(type_name(std::vector<std::string>()), "string array");
}

TEST(ParameterValue, IsWrittenAsInAFile) {
  EXPECT_EQ(to_string(true), "true");
  EXPECT_EQ(to_string(std::int64_t{-1}), "-1");
  EXPECT_EQ(to_string(0.5), "0.5");
  EXPECT_EQ(to_string(std::string("map")), "'map'");
  EXPECT_EQ(to_string(ParameterValue()), "not set");
  EXPECT_EQ(to_string(std::vector<std::uint8_t>{0, 255}), "[0, 255]");
  EXPECT_EQ(to_string(std::vector<bool>{true, false}), "[true, false]");
  EXPECT_EQ(to_string(std::vector<std::string>{"a", "b"}), "['a', 'b']");
  EXPECT_EQ(to_string(std::vector<double>()), "[]");
}

}  // namespace
}  // namespace takt
