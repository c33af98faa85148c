// Tests of counting messages between processes from their reports.
// SPDX-License-Identifier: Apache-2.0
#include "run/deliveries.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace takt::tools {
namespace {

using testing::ElementsAre;

using Endpoint = ProcessState::Endpoint;

Endpoint endpoint(const char* topic, bool is_writer, std::uint64_t messages, bool is_reliable) {
  static std::uint64_t id = 0;
  return {{.topic = topic,
           .type = "T",
           .is_writer = is_writer,
           .is_reliable = is_reliable,
           .messages = messages,
           .transport = "UDP"},
          ++id};
}
Endpoint writer(const char* topic, std::uint64_t messages = 0, bool is_reliable = true) {
  return endpoint(topic, true, messages, is_reliable);
}
Endpoint reader(const char* topic, std::uint64_t messages = 0, bool is_reliable = true) {
  return endpoint(topic, false, messages, is_reliable);
}
ProcessState process(const std::vector<Endpoint>& endpoints, std::uint64_t pending = 0,
                     bool serves_itself = false) {
  return {.endpoints = endpoints, .serves_itself = serves_itself, .pending = pending};
}
Countable all_of(const std::vector<ProcessState>& processes) {
  return Countable(ends_of(processes), [] { return true; });
}

TEST(Deliveries, CountTheMatchesOfEachEndInOtherProcesses) {
  const auto wanted =
      count_matches({process({writer("/a"), reader("/a"), writer("/b")}),
                     process({reader("/a"), reader("/c")}), process({reader("/a")})});
  EXPECT_THAT(wanted, ElementsAre(ElementsAre(2, 0, 0), ElementsAre(1, 0), ElementsAre(1)));
}

TEST(Deliveries, CountTheProcessItselfWhereItServesItselfByDds) {
  const ProcessState itself = process({writer("/a"), reader("/a")}, 0, /*serves_itself=*/true);
  EXPECT_THAT(count_matches({itself}), ElementsAre(ElementsAre(1, 1)));
}

TEST(Deliveries, MatchTypesAndReliabilityAsDdsDoes) {
  Endpoint other = reader("/a");
  other.type = "U";
  const auto wanted =
      count_matches({process({writer("/a", 0, /*is_reliable=*/false)}),
                     process({other, reader("/a"), reader("/a", 0, /*is_reliable=*/false)})});
  EXPECT_THAT(wanted, ElementsAre(ElementsAre(1), ElementsAre(0, 0, 1)));
}

TEST(Deliveries, AddUpWhatSeveralHaveSentToAReader) {
  const auto sent =
      count_sent({process({writer("/a", 3)}), process({writer("/a", 4), writer("/b")}),
                  process({reader("/b"), reader("/a")})});
  EXPECT_THAT(sent, ElementsAre(ElementsAre(0), ElementsAre(0, 0), ElementsAre(0, 7)));
}

TEST(Deliveries, AreServedWhenAllHasArrivedAndNothingIsPending) {
  const auto all_is = [](std::uint64_t received, std::uint64_t pending, bool is_reliable) {
    const std::vector<ProcessState> processes{
        process({writer("/a", 3)}), process({reader("/a", received, is_reliable)}, pending)};
    return all_is_served(processes, all_of(processes));
  };
  EXPECT_TRUE(all_is(3, 0, true));
  EXPECT_TRUE(all_is(4, 0, true)) << "a process outside the run sends too";
  EXPECT_FALSE(all_is(2, 0, true));
  EXPECT_TRUE(all_is(2, 0, false)) << "best effort may lose one";
  EXPECT_FALSE(all_is(3, 1, true));
}

TEST(Deliveries, AreNotCountedWhereAnEndHasComeOrAProcessHasDied) {
  const std::vector<ProcessState> before{process({writer("/a", 3)}), process({reader("/a", 2)})};
  std::vector<ProcessState> after = before;
  after.push_back(process({reader("/a", 1)}));
  EXPECT_TRUE(all_is_served(after, Countable(ends_of(before), [] { return true; })));
  EXPECT_TRUE(all_is_served(before, Countable(ends_of(before), [] { return false; })));
  EXPECT_FALSE(all_is_served(before, Countable(ends_of(before), [] { return true; })));
}

rt::Run::Callback subscription(std::uint64_t expected, std::uint64_t from_outside,
                               std::uint64_t received, std::uint64_t dropped) {
  rt::Run::Callback callback;
  callback.statistics.kind = EntityKind::subscription;
  callback.statistics.topic = "/a";
  callback.statistics.expected = expected;
  callback.statistics.from_outside = from_outside;
  callback.statistics.received = received;
  callback.statistics.dropped = dropped;
  return callback;
}

TEST(Deliveries, CompleteWhatASubscriptionCouldExpect) {
  const std::vector<ProcessState> processes{process({writer("/a", 10)}),
                                            process({writer("/a", 2), reader("/a", 9)})};
  // 2 from its own process by pointer, and 10 from the other; 9 were received, one was dropped.
  std::vector<rt::Run::Callback> callbacks{subscription(2 + 8, 8, 9, 1)};
  complete_callbacks(callbacks, processes[1].endpoints, count_sent(processes)[1],
                     ends_of(processes), all_of(processes));
  EXPECT_EQ(callbacks[0].statistics.expected, 12u);
  EXPECT_EQ(callbacks[0].statistics.lost(), 2u);
}

TEST(Deliveries, LeaveASubscriptionAsItIsWhereNothingCanBeCounted) {
  const std::vector<ProcessState> processes{process({writer("/a", 10)}),
                                            process({reader("/a", 8)})};
  std::vector<rt::Run::Callback> callbacks{subscription(8, 8, 8, 0)};
  complete_callbacks(callbacks, processes[1].endpoints, count_sent(processes)[1],
                     ends_of(processes), Countable({}, [] { return true; }));
  EXPECT_EQ(callbacks[0].statistics.expected, 8u);
  EXPECT_EQ(callbacks[0].statistics.lost(), 0u);
}

TEST(Deliveries, SayWhetherSharedMemoryIsUsed) {
  Endpoint shared = writer("/a");
  shared.transport = "shared memory";
  EXPECT_FALSE(uses_shared_memory({process({writer("/a")}), process({reader("/a")})}));
  EXPECT_TRUE(uses_shared_memory({process({writer("/b")}), process({reader("/b"), shared})}));
}

}  // namespace
}  // namespace takt::tools
