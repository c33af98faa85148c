// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/cyclone_participant.hpp"

#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "takt/messages/message_type.hpp"
#include "takt/testing/peer_process.hpp"

namespace takt {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

struct Number {
  std::int64_t value = 0;
};
TAKT_MESSAGE(Number, "test_msgs/msg/Number", value);

long times_waited() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_nvcsw;
}

std::shared_ptr<Participant> make_participant() {
  return Participant::create({.domain = test_domain(),
                              .discovery = DiscoveryRange::localhost,
                              .shared_memory = SharedMemory::off});
}
dds_entity_t handle_of(const Participant& participant) {
  return static_cast<const CycloneParticipant&>(participant).handle();
}

// What thousands had announced stayed, up to 16 MB, where nobody looked at the graph.
TEST(GraphReader, ForgetsWhatIsUnreadOfAProcessThatGoes) {
  const auto reading = make_participant();
  GraphReader reader(handle_of(*reading), RosGraph::jazzy, [](const auto&) {});
  reader.begin();
  auto other = make_participant();
  other->add_node("/node");
  auto writer = other->create_writer({"/topic", &message_type<Number>(), 1, "/node", {}},
                                     std::make_shared<EndpointEvents>());
  dds_guid_t guid{};
  ASSERT_EQ(dds_get_guid(handle_of(*other), &guid), DDS_RETCODE_OK);
  const std::string gid(reinterpret_cast<const char*>(guid.v), sizeof guid.v);
  EXPECT_TRUE(eventually([&] { return reader.owners_in(gid).size() == 1; }));
  writer.reset();
  other.reset();
  EXPECT_TRUE(eventually([&] { return reader.owners_in(gid).empty(); }));
}

// Each waited a millisecond and more for Cyclone's threads: a system of 250 nodes ended in seconds.
TEST(CycloneParticipant, EndsThatGoTogetherDoNotWaitOneAfterTheOther) {
  const auto participant = make_participant();
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

TEST(Participant, RefusesADomainThatCannotBe) {
  EXPECT_THAT([] { Participant::create({.domain = 5000}); },
              ThrowsMessage<Error>(HasSubstr("domain 5000")));
}

TEST(Participant, SaysWhyCycloneRefusesIt) {
  const std::string nowhere = "/nowhere/file";
  DdsOptions options{.domain = test_domain()};
  options.security = {nowhere, nowhere, nowhere, nowhere, nowhere, nowhere};
  EXPECT_THAT([&] { Participant::create(options); }, ThrowsMessage<Error>(HasSubstr(nowhere)));
}

}  // namespace
}  // namespace takt
