// SPDX-License-Identifier: Apache-2.0
#include "yaml_file.hpp"

#include <gtest/gtest.h>

#include "takt/containers/configuration/document.hpp"

namespace takt::tools {
namespace {

TEST(YamlFile, PutsIntoOneLineWhatFits) {
  const std::string name(60, 'n');
  EXPECT_EQ(yaml_file({{"short", {{"list", {1, 2.5, true}}, {"time", "5ms"}}},
                       {"long", {{{"first", name}, {"second", name}}, "text"}}}),
            "short: {list: [1, 2.5, true], time: 5ms}\n"
            "long:\n"
            "  - first: " +
                name +
                "\n"
                "    second: " +
                name +
                "\n"
                "  - text\n");
}

TEST(YamlFile, TextIsReadBackAsText) {
  const std::vector<std::string> texts{
      "/node/topic", "",      "true", "null", "~",    "17", "-1.5", "0x1f", ".nan",       "a: b",
      "- a",         "a # b", "{}",   "*a",   "it's", "\"", "a\nb", " a ",  "2 × 3 µs, é"};
  document::Errors errors("");
  const document::Value read =
      document::parse_yaml(yaml_file({{"texts", texts}, {"a: b", "keys, too"}}), errors);
  EXPECT_NE(document::find(read, "a: b"), nullptr);
  const auto& list = std::get<document::List>(document::find(read, "texts")->content);
  ASSERT_EQ(list.size(), texts.size());
  for (std::size_t i = 0; i < texts.size(); ++i) {
    ASSERT_TRUE(std::holds_alternative<std::string>(list[i].content)) << texts[i];
    EXPECT_EQ(std::get<std::string>(list[i].content), texts[i]);
  }
}

}  // namespace
}  // namespace takt::tools
