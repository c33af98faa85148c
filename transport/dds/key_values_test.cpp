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

// What ROS 2 shows as INVALID was shown as a hash, and asked for.
TEST(TypeHash, IsWhatRos2Parses) {
  const std::string digits(64, 'a');
  EXPECT_TRUE(
      is_type_hash("RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"));
  EXPECT_TRUE(is_type_hash("RIHS01_" + std::string(64, 'F')));
  for (const std::string& text :
       {std::string(), std::string("RIHS01_"), "RIHS02_" + digits, "rihs01_" + digits,
        "RIHS01_" + digits + "0", "RIHS01_" + digits.substr(1), "RIHS01_" + digits.substr(1) + "g",
        "RIHS1_" + digits, " RIHS01_" + digits}) {
    EXPECT_FALSE(is_type_hash(text)) << text;
  }
}

}  // namespace
}  // namespace takt
