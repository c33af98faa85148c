// Tests of counting messages between processes from their reports.
// SPDX-License-Identifier: Apache-2.0
#include "run/deliveries.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace takt::tools {
namespace {

using nlohmann::json;
using testing::ElementsAre;

json endpoint(const char* topic, bool is_writer, int messages = 0, bool is_reliable = true) {
  static int id = 0;
  return {{"topic", topic},         {"type", "T"},          {"id", ++id},
          {"is_writer", is_writer}, {"messages", messages}, {"is_reliable", is_reliable},
          {"transport", "UDP"}};
}
json writer(const char* topic, int messages = 0, bool is_reliable = true) {
  return endpoint(topic, true, messages, is_reliable);
}
json reader(const char* topic, int messages = 0, bool is_reliable = true) {
  return endpoint(topic, false, messages, is_reliable);
}
json process(const std::vector<json>& endpoints, int pending = 0, bool serves_itself = false) {
  return {{"endpoints", endpoints}, {"pending", pending}, {"serves_itself", serves_itself}};
}
Countable all_of(const std::vector<json>& processes) {
  return Countable(ends_of(processes), [] { return true; });
}

TEST(Deliveries, CountTheMatchesOfEachEndInOtherProcesses) {
  const std::vector<json> wanted =
      count_matches({process({writer("/a"), reader("/a"), writer("/b")}),
                     process({reader("/a"), reader("/c")}), process({reader("/a")})});
  EXPECT_THAT(wanted, ElementsAre(json::array({2, 0, 0}), json::array({1, 0}), json::array({1})));
}

TEST(Deliveries, CountTheProcessItselfWhereItServesItselfByDds) {
  const json itself = process({writer("/a"), reader("/a")}, 0, /*serves_itself=*/true);
  EXPECT_THAT(count_matches({itself}), ElementsAre(json::array({1, 1})));
}

TEST(Deliveries, MatchTypesAndReliabilityAsDdsDoes) {
  json other = reader("/a");
  other["type"] = "U";
  const std::vector<json> wanted =
      count_matches({process({writer("/a", 0, /*is_reliable=*/false)}),
                     process({other, reader("/a"), reader("/a", 0, /*is_reliable=*/false)})});
  EXPECT_THAT(wanted, ElementsAre(json::array({1}), json::array({0, 0, 1})));
}

TEST(Deliveries, AddUpWhatSeveralHaveSentToAReader) {
  const auto sent =
      count_sent({process({writer("/a", 3)}), process({writer("/a", 4), writer("/b")}),
                  process({reader("/b"), reader("/a")})});
  EXPECT_THAT(sent, ElementsAre(ElementsAre(0), ElementsAre(0, 0), ElementsAre(0, 7)));
}

TEST(Deliveries, AreServedWhenAllHasArrivedAndNothingIsPending) {
  const auto all_is = [](int received, int pending, bool is_reliable) {
    const std::vector<json> processes{process({writer("/a", 3)}),
                                      process({reader("/a", received, is_reliable)}, pending)};
    return all_is_served(processes, all_of(processes));
  };
  EXPECT_TRUE(all_is(3, 0, true));
  EXPECT_TRUE(all_is(4, 0, true)) << "a process outside the run sends too";
  EXPECT_FALSE(all_is(2, 0, true));
  EXPECT_TRUE(all_is(2, 0, false)) << "best effort may lose one";
  EXPECT_FALSE(all_is(3, 1, true));
}

TEST(Deliveries, AreNotCountedWhereAnEndHasComeOrAProcessHasDied) {
  const std::vector<json> before{process({writer("/a", 3)}), process({reader("/a", 2)})};
  std::vector<json> after = before;
  after.push_back(process({reader("/a", 1)}));
  EXPECT_TRUE(all_is_served(after, Countable(ends_of(before), [] { return true; })));
  EXPECT_TRUE(all_is_served(before, Countable(ends_of(before), [] { return false; })));
  EXPECT_FALSE(all_is_served(before, Countable(ends_of(before), [] { return true; })));
}

json subscription(int expected, int from_outside, int received, int dropped) {
  return {{"kind", "subscription"},       {"topic", "/a"},        {"expected", expected},
          {"from_outside", from_outside}, {"received", received}, {"dropped", dropped}};
}

TEST(Deliveries, CompleteWhatASubscriptionCouldExpect) {
  const std::vector<json> processes{process({writer("/a", 10)}),
                                    process({writer("/a", 2), reader("/a", 9)})};
  // 2 from its own process by pointer, and 10 from the other; 9 were received, one was dropped.
  json callbacks = json::array({subscription(2 + 8, 8, 9, 1)});
  complete_callbacks(callbacks, processes[1].at("endpoints"), count_sent(processes)[1],
                     ends_of(processes), all_of(processes));
  EXPECT_EQ(callbacks[0].at("expected"), 12);
  EXPECT_EQ(callbacks[0].at("lost"), 2);
}

TEST(Deliveries, LeaveASubscriptionAsItIsWhereNothingCanBeCounted) {
  const std::vector<json> processes{process({writer("/a", 10)}), process({reader("/a", 8)})};
  const json before = json::array({subscription(8, 8, 8, 0)});
  json callbacks = before;
  complete_callbacks(callbacks, processes[1].at("endpoints"), count_sent(processes)[1],
                     ends_of(processes), Countable({}, [] { return true; }));
  EXPECT_EQ(callbacks, before);
}

TEST(Deliveries, SayWhetherSharedMemoryIsUsed) {
  json shared = writer("/a");
  shared["transport"] = "shared memory";
  EXPECT_FALSE(uses_shared_memory({process({writer("/a")}), process({reader("/a")})}));
  EXPECT_TRUE(uses_shared_memory({process({writer("/b")}), process({reader("/b"), shared})}));
}

}  // namespace
}  // namespace takt::tools
