// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sys/resource.h>

#include "takt/messages/message_type.hpp"
#include "takt/testing/peer_process.hpp"
#include "takt/transport/dds/participant.hpp"

namespace takt {
namespace {

struct Number {
  std::int64_t value = 0;
};
TAKT_MESSAGE(Number, "test_msgs/msg/Number", value);

long times_waited() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_nvcsw;
}

// Each waited a millisecond and more for Cyclone's threads: a system of 250 nodes ended in seconds.
TEST(CycloneParticipant, EndsThatGoTogetherDoNotWaitOneAfterTheOther) {
  const auto participant = Participant::create({.domain = test_domain(),
                                                .discovery = DiscoveryRange::localhost,
                                                .shared_memory = SharedMemory::off});
  participant->add_node("/node");
  std::vector<std::unique_ptr<RemoteWriter>> writers;
  for (int i = 0; i < 200; ++i) {
    const Endpoint endpoint{"/topic_" + std::to_string(i), &message_type<Number>(), 1, "/node", {}};
    writers.push_back(participant->create_writer(endpoint, std::make_shared<EndpointEvents>()));
  }
  const long before = times_waited();
  writers.clear();
  EXPECT_LT(times_waited() - before, 100);
  EXPECT_TRUE(participant->endpoints().empty());
  participant->remove_node("/node");
}

// What is half gone must not keep its participant, which others would go on to see.
TEST(CycloneParticipant, LeavesTheDomainWithTheLastEnd) {
  const DdsOptions options{.domain = test_domain(),
                           .discovery = DiscoveryRange::localhost,
                           .shared_memory = SharedMemory::off};
  auto participant = Participant::create(options);
  const std::weak_ptr<Participant> weak = participant;
  auto writer = participant->create_writer({"/topic", &message_type<Number>(), 1, "", {}},
                                           std::make_shared<EndpointEvents>());
  participant.reset();
  EXPECT_FALSE(weak.expired());
  writer.reset();
  EXPECT_TRUE(weak.expired());
}

}  // namespace
}  // namespace takt
