// SPDX-License-Identifier: Apache-2.0
#include "takt/measuring/json_text.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/error.hpp"

namespace takt::rt {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

std::string nested(std::size_t levels) {
  return std::string(levels, '[') + std::string(levels, ']');
}

// What copies such a document calls itself for each level: 300,000 ended the process.
TEST(JsonText, HasALimitOfLevels) {
  EXPECT_NO_THROW(parse_json(nested(64)));
  EXPECT_NO_THROW(parse_json("[\"" + nested(300'000) + "\", \"\\\"[[\"]"));
  for (const std::size_t levels : {65, 300'000}) {
    EXPECT_THAT([&] { parse_json(nested(levels)); },
                ThrowsMessage<Error>(HasSubstr("deeper than 64 levels")));
    EXPECT_TRUE(json_or_null(nested(levels)).is_null());
  }
}

TEST(JsonText, HasNoErrorsOfItsLibrary) {
  for (const char* text : {"", "{", "[1,]", "\xff", "{\"a\":1}}", "nul"}) {
    EXPECT_THAT([&] { parse_json(text); }, ThrowsMessage<Error>("it is no JSON")) << text;
  }
  EXPECT_EQ(parse_json("{\"a\":[1,2]}").at("a").size(), 2U);
}

}  // namespace
}  // namespace takt::rt
