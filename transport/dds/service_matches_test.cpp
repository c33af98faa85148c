// Whom a service knows.
// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/service_matches.hpp"

#include <gtest/gtest.h>

namespace takt {
namespace {

using Hearing = ServiceMatches::Hearing;

// Each number that a peer made up cost 64 bytes, as long as its writer was there.
TEST(ServiceMatches, RemembersAsManyClientsAsThereAreWriters) {
  ServiceMatches matches;
  matches.add(ServiceMatches::requests, 1, "clientid=1;");
  matches.add(ServiceMatches::requests, 2, "clientid=2;");
  EXPECT_TRUE(matches.called(20, 2));
  EXPECT_TRUE(matches.called(1, 1));
  std::uint64_t changes = 0;
  for (std::uint64_t client = 2; client <= 1000; ++client) changes += !matches.called(client, 1);
  EXPECT_EQ(matches.callers(), 2u);
  EXPECT_EQ(matches.changed_callers(), changes);
  EXPECT_GE(changes, 998u);
  EXPECT_EQ(matches.hearing(20), Hearing::absent) << "the other client's number was taken over";
  EXPECT_EQ(matches.hearing(1000), Hearing::absent);
  matches.add(ServiceMatches::responses, 3, "clientid=1;");
  EXPECT_EQ(matches.hearing(1000), Hearing::unknown);
  matches.confirm(matches.ends());
  EXPECT_EQ(matches.hearing(1000), Hearing::hears);
  EXPECT_EQ(matches.hearing(20), Hearing::absent);
  matches.remove(ServiceMatches::requests, 1);
  matches.remove(ServiceMatches::requests, 2);
  EXPECT_EQ(matches.callers(), 0u);
}

}  // namespace
}  // namespace takt
