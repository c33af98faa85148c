// Tests of the text in user data, by the rules of ROS 2's reader.
// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/key_values.hpp"

#include <map>
#include <string>

#include <gtest/gtest.h>

namespace takt {
namespace {

using Entries = std::map<std::string, std::string>;

TEST(KeyValues, AreReadAsRos2ReadsThem) {
  EXPECT_EQ(key_values("typehash=RIHS01_0a;node=/a/b;"),
            (Entries{{"typehash", "RIHS01_0a"}, {"node", "/a/b"}}));
  EXPECT_EQ(key_values("enclave=/"), (Entries{{"enclave", "/"}}));
  EXPECT_EQ(key_values(std::string("a=1;b=2;\0\0", 10)), (Entries{{"a", "1"}, {"b", "2"}}));
  EXPECT_EQ(key_values("a=1=2;;b=3"), (Entries{{"a", "1=2;"}, {"b", "3"}}));
  EXPECT_EQ(key_values("a=1; b=2"), (Entries{{"a", "1"}, {"b", "2"}}));
  EXPECT_EQ(key_values(""), Entries());
}

// One such character hid the types' hashes, services and clients of Takt from every ROS 2 program,
// while our own reader, which searched for the key, found them.
TEST(KeyValues, AreAllHiddenByOneWrongCharacter) {
  EXPECT_EQ(key_values("typehash=RIHS01_0a;takt_clock=1;"), Entries());
  EXPECT_EQ(key_values("typehash=RIHS01_0a;takt-clock=1;"), Entries());
  EXPECT_EQ(key_values("typehash=RIHS01_0a;  node=/a;"), Entries());
  EXPECT_EQ(key_values("a=1;b=;"), Entries());
  EXPECT_EQ(key_values("a=1;=2;"), Entries());
  EXPECT_EQ(key_values("a=1;b"), Entries());
  EXPECT_EQ(key_values("a=1;\n\n"), Entries());
  EXPECT_EQ(key_values(std::string("\0a=1;", 5)), Entries());
  EXPECT_EQ(key_values("not of ROS 2"), Entries());
}

}  // namespace
}  // namespace takt
