// What iceoryx does not survive: it has locks in shared memory that nobody gives back for a process
// that was killed.
// SPDX-License-Identifier: Apache-2.0
#include <string>

#include <gmock/gmock.h>

#include "takt/testing/shared_memory.hpp"

namespace takt {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

/// One that iceoryx has left behind, see shared_memory_rogue.cpp. Destroyed, it is killed.
class Rogue : public PeerProcess {
 public:
  Rogue(const std::string& topic, const std::string& what)
      : PeerProcess(TAKT_SHARED_MEMORY_ROGUE,
                    std::to_string(test_domain()) + " " + topic + " " + what) {}
  ~Rogue() { kill(); }
};

/// Of a RouDi whose lock was held by a process that was killed.
bool roudi_is_silent() {
  return eventually([] { return find_roudi().unusable.starts_with("RouDi does not answer"); });
}

// Survivors waited for RouDi's answer to their goodbye, and new processes for that to their
// registration, both for ever.
TEST_F(BySharedMemory, WhenRoudiHangsProcessesEndAndOthersBegin) {
  start_roudi();
  Peer from, to("require");
  match(from, to, "block", "/before");
  {
    const Rogue rogue("/rogue", "roudi");
    ASSERT_EQ(rogue.greeting(), "ok");
    ASSERT_TRUE(roudi_is_silent());
  }

  EXPECT_EQ(from.ask("publish /before 1 10 1000"), "ok");  // what is there goes on
  ASSERT_TRUE(to.has("/before", 10));
  EXPECT_EQ(to.received("/before").last, 10);

  EXPECT_THAT(Peer("require").greeting(),
              StartsWith("shared memory is required: RouDi does not answer"));
  Peer late;
  ASSERT_EQ(late.greeting(), "ok");
  match(from, late, "block", "/after");
  EXPECT_THAT(late.state("/after").transport, HasSubstr("RouDi does not answer"));
  EXPECT_EQ(from.ask("publish /after 7"), "ok");
  ASSERT_TRUE(late.has("/after", 1));
  EXPECT_EQ(late.received("/after").last, 7);

  for (Peer* peer : {&from, &to, &late}) peer->end();  // all at once, as each one waits
  for (Peer* peer : {&from, &to, &late}) EXPECT_TRUE(peer->ends());
}

// A subscription's lock is held for ever: it cannot be taken down, and its process ends all the
// same.
TEST_F(BySharedMemory, AProcessEndsThoughOneOfItsReadersIsLocked) {
  start_roudi();
  Peer to("require");
  ASSERT_EQ(to.ask("subscription block /locked 10"), "ok");
  EXPECT_EQ(Rogue("/locked", "reader").greeting(), "ok");
  EXPECT_EQ(to.ask("drop /locked"), "ok");
  EXPECT_TRUE(to.ends());
}

// iceoryx gives a reader 256 messages at once. Those of publishers that DDS does not know never
// come back, so a reader can be deaf; then each message is counted, and reported once a second.
TEST_F(BySharedMemory, WhatADeafReaderLosesIsCounted) {
  start_roudi();
  const Peer from("require"), to("require");
  match(from, to, "block", "/deaf");
  EXPECT_EQ(Rogue("/deaf", "flood 300").greeting(), "ok");
  ASSERT_TRUE(eventually([&] { return to.state("/deaf").lost > 0; }));
  const Received before = to.received("/deaf");
  EXPECT_EQ(before.received, 0u);
  EXPECT_EQ(before.lost, to.state("/deaf").lost);
  EXPECT_EQ(from.ask("publish /deaf 1 5 1000"), "ok");
  ASSERT_TRUE(eventually([&] { return to.received("/deaf").lost >= before.lost + 5; }));
  EXPECT_EQ(to.state("/deaf").messages, to.state("/deaf").lost);
}

}  // namespace
}  // namespace takt
