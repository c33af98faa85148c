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
  for (const char* word :
       {"0,worst", "18446744073709551615,drawn,all=1ns",
        "3,worst,lost=/a/b@0s,late=/a/b#2@3s+20ms,slow=/c/d@1500us",
        "4,drawn,all=1ms,doubled=/a/b@1s,reordered=/a/b@1s,full=/a/b@1s,throws=/a@1s",
        "7,drawn,all=5ms,/a/b#2=999999.999999999s,/c/d=1500us"}) {
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
  EXPECT_THAT(error("7"), HasSubstr("write SEED,worst|drawn, phases and faults"));
  for (const char* fault : {"lost=/a/b", "lost=@1s", "lost=/a/b@1s+2s"}) {
    EXPECT_THAT(error(("7,worst," + std::string(fault)).c_str()),
                HasSubstr(std::string("'") + fault +
                          "' is no fault; write lost=CALLBACK@TIME, as "
                          "lost=/planner/imu@3s"));
  }
  EXPECT_THAT(error("7,worst,late=/a/b@1s"), HasSubstr("write late=CALLBACK@TIME+TIME"));
  EXPECT_THAT(error("7,worst,late=/a/b@1+1s"), HasSubstr("has no unit"));
}

TEST(Fault, ItsKindsAreAList) {
  using Kind = Fault::Kind;
  EXPECT_EQ(parse_fault_kinds("slow,lost"), (FaultKinds{Kind::lost, Kind::slow}));
  EXPECT_EQ(parse_fault_kinds("all").size(), 7u);
  for (const char* list : {"", "lost,", "none"}) {
    try {
      parse_fault_kinds(list);
      FAIL() << list;
    } catch (const Error& refused) {
      EXPECT_THAT(refused.what(), HasSubstr("' is no kind of fault; valid: lost, late, doubled, "
                                            "reordered, full, slow, throws, all"));
    }
  }
  try {
    parse_fault_kinds("lost,clock");
    FAIL();
  } catch (const Error& refused) {
    EXPECT_THAT(refused.what(), HasSubstr("'clock' is no kind of fault: timers follow the steady "
                                          "clock, which does not jump; valid: lost, "));
  }
}

}  // namespace
}  // namespace takt
