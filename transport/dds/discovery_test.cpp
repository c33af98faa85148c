// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/discovery.hpp"

#include <cstdlib>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/base/error.hpp"

namespace takt {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

constexpr char kRange[] = "ROS_AUTOMATIC_DISCOVERY_RANGE", kPeers[] = "ROS_STATIC_PEERS",
               kLocalhostOnly[] = "ROS_LOCALHOST_ONLY";

class Environment : public testing::Test {
 protected:
  ~Environment() override {
    for (const char* name : {kRange, kPeers, kLocalhostOnly}) unsetenv(name);
  }
  static void set(const char* name, const char* value) { setenv(name, value, /*overwrite=*/1); }
};

TEST_F(Environment, NamesTheRangesOfRos2) {
  EXPECT_EQ(default_discovery(), DiscoveryRange::localhost);
  for (const auto& [name, range] : {std::pair{"", DiscoveryRange::localhost},
                                    {"LOCALHOST", DiscoveryRange::localhost},
                                    {"SUBNET", DiscoveryRange::subnet},
                                    {"OFF", DiscoveryRange::off},
                                    {"SYSTEM_DEFAULT", DiscoveryRange::system}}) {
    set(kRange, name);
    EXPECT_EQ(default_discovery(), range) << name;
  }
  set(kRange, "subnet");
  EXPECT_THAT(default_discovery,
              ThrowsMessage<Error>(HasSubstr("LOCALHOST, SUBNET, OFF or SYSTEM_DEFAULT")));
}

TEST_F(Environment, NamesPeers) {
  EXPECT_THAT(default_static_peers(), IsEmpty());
  set(kPeers, "192.168.1.2;;robot-7.local;");
  EXPECT_THAT(default_static_peers(), ElementsAre("192.168.1.2", "robot-7.local"));
  set(kPeers, "192.168.1.2;<Peer/>");
  EXPECT_THAT(default_static_peers, ThrowsMessage<Error>(HasSubstr("'<Peer/>'")));
  std::string many;  // the names of 10,000 were looked up for minutes
  for (int i = 0; i < 101; ++i) many += "host;";
  set(kPeers, many.c_str());
  EXPECT_THAT(default_static_peers, ThrowsMessage<Error>(HasSubstr("more than 100 hosts")));
}

TEST_F(Environment, LocalhostOnlyOverrulesTheOthers) {
  set(kRange, "SUBNET");
  set(kPeers, "192.168.1.2");
  set(kLocalhostOnly, "0");
  EXPECT_EQ(default_discovery(), DiscoveryRange::subnet);
  set(kLocalhostOnly, "1");
  EXPECT_EQ(default_discovery(), DiscoveryRange::localhost);
  EXPECT_THAT(default_static_peers(), IsEmpty());
}

}  // namespace
}  // namespace takt
