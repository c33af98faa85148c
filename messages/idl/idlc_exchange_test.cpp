// Cyclone's own C type of testdata/msg/Shapes.idl reads the bytes of ours, and writes the same; and
// its time stamps are taken for what they are.
// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <cstring>
#include <fstream>

#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/executors/executor.hpp"
#include "takt/testing/peer_process.hpp"

#include "Shapes.h"
#include "test_msgs/msg/shapes.hpp"

namespace takt {
namespace {

using test_msgs::msg::Colour;
using test_msgs::msg::Shapes;
using test_msgs::msg::Wire;

// Nobody else takes part: there is no network.
constexpr const char* kAlone =
    "<Domain><General><Interfaces><NetworkInterface name='lo' multicast='false'/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General></Domain>";
constexpr dds_domainid_t kDomain = 99;

// Where Cyclone keeps its description of the type: an invalid sample is enough to get at it.
class IdlcType : public testing::Test {
 protected:
  void SetUp() override {
    domain_ = dds_create_domain(kDomain, kAlone);
    ASSERT_GT(domain_, 0) << dds_strretcode(-domain_);
    const dds_entity_t participant = dds_create_participant(kDomain, nullptr, nullptr);
    const dds_entity_t topic =
        dds_create_topic(participant, &test_msgs_msg_Shapes_desc, "shapes", nullptr, nullptr);
    const dds_entity_t reader = dds_create_reader(participant, topic, nullptr, nullptr);
    const dds_entity_t writer = dds_create_writer(participant, topic, nullptr, nullptr);
    test_msgs_msg_Shapes empty{};
    empty.text = const_cast<char*>("");
    ASSERT_EQ(dds_write(writer, &empty), DDS_RETCODE_OK);
    dds_sample_info_t info;
    ASSERT_EQ(dds_takecdr(reader, &sample_, 1, &info, DDS_ANY_STATE), 1);
  }
  void TearDown() override {
    if (sample_ != nullptr) ddsi_serdata_unref(sample_);
    dds_delete(domain_);
  }

  const ddsi_sertype* type() const { return sample_->type; }

 private:
  dds_entity_t domain_ = 0;
  ddsi_serdata* sample_ = nullptr;
};

TEST_F(IdlcType, ReadsTheBytesOfOursAndWritesTheSame) {
  Shapes shapes;
  shapes.colour = Colour::GREEN;
  shapes.part.id = 7;
  shapes.parts = {test_msgs::msg::Part().set__id(8).set__weight(1),
                  test_msgs::msg::Part().set__id(9).set__weight(2)};
  shapes.grid[1][2] = 6;
  shapes.matrix[0][1] = 0.5;
  shapes.rows = {{1}, {}, {2, -1}};
  shapes.word = "hi";
  shapes.colours = {Colour::RED, Colour::GREEN};
  shapes.on = true;
  ByteBuffer ours;
  message_type<Shapes>().encode(&shapes, ours);
  const std::size_t size = ours.bytes().size();
  std::memset(ours.extend(3), 0, 3);  // Cyclone sends in units of four bytes

  ddsrt_iovec_t part{ours.data(), (size + 3) / 4 * 4};
  ddsi_serdata* received = ddsi_serdata_from_ser_iov(type(), SDK_DATA, 1, &part, part.iov_len);
  ASSERT_NE(received, nullptr);
  test_msgs_msg_Shapes theirs{};
  ASSERT_TRUE(ddsi_serdata_to_sample(received, &theirs, nullptr, nullptr));
  EXPECT_EQ(theirs.colour, test_msgs_msg_GREEN);
  EXPECT_EQ(theirs.part.weight, 2.5);
  ASSERT_EQ(theirs.parts._length, 2u);
  EXPECT_EQ(theirs.parts._buffer[1].id, 9);
  EXPECT_EQ(theirs.grid[1][2], 6);
  EXPECT_EQ(theirs.matrix[0][1], 0.5);
  ASSERT_EQ(theirs.rows._length, 3u);
  EXPECT_EQ(theirs.rows._buffer[2]._buffer[1], -1);
  EXPECT_STREQ(theirs.word, "hi");
  EXPECT_TRUE(theirs.on);
  EXPECT_EQ(theirs.number, -7);
  EXPECT_STREQ(theirs.text, "none");

  ddsi_serdata* sent = ddsi_serdata_from_sample(type(), SDK_DATA, &theirs);
  ASSERT_EQ(ddsi_serdata_size(sent), part.iov_len);
  std::vector<std::byte> bytes(part.iov_len);
  ddsi_serdata_to_ser(sent, 0, bytes.size(), bytes.data());
  // All but the options, in which Cyclone says how many bytes are padding.
  std::memset(bytes.data() + 2, 0, 2);
  EXPECT_TRUE(std::equal(bytes.begin(), bytes.end(), ours.data()));
  ddsi_serdata_unref(sent);
  ddsi_serdata_unref(received);
  dds_sample_free(&theirs, &test_msgs_msg_Shapes_desc, DDS_FREE_CONTENTS);
}

// ---- Clocks ----

/// How old the first message of a plain Cyclone writer is to us, whose clock is ten seconds behind.
/// `user_data`: the writer's user data.
Nanoseconds age_of_message(bool clocks_are_synchronized, const std::string& user_data) {
  const int domain = test_domain();
  NodeOptions options;
  options.participant = Participant::create({.domain = domain,
                                             .synchronized_clocks = clocks_are_synchronized,
                                             .shared_memory = SharedMemory::off});
  const auto node = std::make_shared<Node>("node", options);
  const auto executor = executors().make("events", {});
  Promise<bool> arrived;
  const auto subscription = node->create_subscription<Wire>(
      "/clocks", QoS(5).transient_local(), [&](const Wire&) { arrived.set_value(true); });
  executor->add_node(node);

  const dds_entity_t participant = dds_create_participant(domain, nullptr, nullptr);
  const dds_entity_t topic =
      dds_create_topic(participant, &test_msgs_msg_dds__Wire__desc, "rt/clocks", nullptr, nullptr);
  EXPECT_GT(topic, 0) << dds_strretcode(-topic);
  dds_qos_t* const qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(10));
  dds_qset_durability(qos, DDS_DURABILITY_TRANSIENT_LOCAL);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 5);
  dds_qset_userdata(qos, user_data.data(), user_data.size());
  const dds_entity_t writer = dds_create_writer(participant, topic, qos, nullptr);
  dds_delete_qos(qos);
  const test_msgs_msg_dds__Wire_ message{};
  EXPECT_EQ(dds_write_ts(writer, &message, dds_time() - DDS_SECS(10)), DDS_RETCODE_OK);
  EXPECT_EQ(executor->spin_until_future_complete(arrived.get_future(), std::chrono::seconds(60)),
            FutureReturnCode::SUCCESS);
  dds_delete(participant);
  return executor->statistics().at(0).latency.max();
}

// A publisher whose clock was behind made every message miss its deadline.
TEST(WriterClocks, OfAnotherHostDecideNothing) {
  EXPECT_LT(age_of_message(false, ""), std::chrono::seconds(9));
}

TEST(WriterClocks, CountWhereTheyAreTheSameOrKeptTheSame) {
  std::string boot;
  std::ifstream("/proc/sys/kernel/random/boot_id") >> boot;
  EXPECT_GE(age_of_message(false, "taktclock=" + boot + ";"), std::chrono::seconds(9));
  EXPECT_GE(age_of_message(true, ""), std::chrono::seconds(9));
}

}  // namespace
}  // namespace takt
