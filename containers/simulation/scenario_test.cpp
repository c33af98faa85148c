// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/simulation/scenario.hpp"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/error.hpp"

namespace takt {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

TEST(Scenario, IsAWord) {
  EXPECT_EQ(to_string(Scenario{}), "1,worst,all=0s");
  const Scenario scenario{.seed = 7,
                          .times = Scenario::Times::drawn,
                          .phases = {{"all", 5ms}, {"/a/b#2", 3ns}, {"/c/d", 1500us}}};
  EXPECT_EQ(to_string(scenario), "7,drawn,all=5ms,/a/b#2=3ns,/c/d=1500us");
  EXPECT_EQ(to_string(Scenario{.phases = {}}), "1,worst");
}

TEST(Scenario, IsReadAsItIsWritten) {
  for (const char* word : {"0,worst", "18446744073709551615,drawn,all=1ns",
                           "7,drawn,all=5ms,/a/b#2=999999999999999ns,/c/d=1500us"}) {
    EXPECT_EQ(to_string(parse_scenario(word)), word);
  }
}

TEST(Scenario, AWordThatIsNoneIsRefused) {
  const auto error = [](const char* word) -> std::string {
    try {
      parse_scenario(word);
    } catch (const Error& refused) {
      return refused.what();
    }
    return "";
  };
  EXPECT_THAT(error(""), HasSubstr("'' is no scenario: '' is no seed, which is a whole number"));
  EXPECT_THAT(error("-1,worst"), HasSubstr("'-1' is no seed"));
  EXPECT_THAT(error("7"), HasSubstr("after the seed stands worst or drawn"));
  EXPECT_THAT(error("7,best"), HasSubstr("after the seed stands worst or drawn"));
  EXPECT_THAT(error("7,worst,"), HasSubstr("'' is no NAME=TIME"));
  EXPECT_THAT(error("7,worst,=1ms"), HasSubstr("'=1ms' is no NAME=TIME"));
  EXPECT_THAT(error("7,worst,/a/b=1"), HasSubstr("has no unit"));
  EXPECT_THAT(error("7,worst,/a/b=1s,/a/b=2s"), HasSubstr("'/a/b' is there twice"));
  EXPECT_THAT(error("7"), HasSubstr("write SEED,worst|drawn and then phases"));
}

}  // namespace
}  // namespace takt
