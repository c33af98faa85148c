// The depth of a QoS as Cyclone's other users see it: `ros2 topic info --verbose` shows it.
// SPDX-License-Identifier: Apache-2.0
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <dds/dds.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "takt/messages/std_msgs/msg/string.hpp"
#include "takt/nodes/node.hpp"
#include "takt/testing/peer_process.hpp"

namespace takt {
namespace {

using Depths = std::map<std::string, std::int32_t>;  // by topic

/// What a participant without Takt discovers.
class PlainParticipant {
 public:
  explicit PlainParticipant(int domain)
      : handle_(dds_create_participant(static_cast<dds_domainid_t>(domain), nullptr, nullptr)) {}
  ~PlainParticipant() { dds_delete(handle_); }
  PlainParticipant(const PlainParticipant&) = delete;
  PlainParticipant& operator=(const PlainParticipant&) = delete;

  /// Of the topics below rt/depth/, once there are so many.
  Depths discover(dds_entity_t builtin_topic, std::size_t count) const {
    const dds_entity_t reader = dds_create_reader(handle_, builtin_topic, nullptr, nullptr);
    Depths depths;
    EXPECT_TRUE(eventually([&] {
      void* sample = nullptr;
      dds_sample_info_t info;
      while (dds_take(reader, &sample, &info, 1, 1) == 1) {
        note(*static_cast<const dds_builtintopic_endpoint_t*>(sample), depths);
        dds_return_loan(reader, &sample, 1);
      }
      return depths.size() >= count;
    }));
    dds_delete(reader);
    return depths;
  }

 private:
  static void note(const dds_builtintopic_endpoint_t& end, Depths& depths) {
    const std::string prefix = "rt/depth/", topic = end.topic_name;
    if (!topic.starts_with(prefix)) return;
    dds_history_kind_t kind;
    std::int32_t depth = 0;
    ASSERT_TRUE(dds_qget_history(end.qos, &kind, &depth));
    depths[topic.substr(prefix.size())] = kind == DDS_HISTORY_KEEP_LAST ? depth : -1;
  }

  const dds_entity_t handle_;
};

// It was 100 where the QoS says less: what a writer kept for readers that are behind.
TEST(AnnouncedDepth, IsThatOfTheQos) {
  DdsOptions options;
  options.domain = test_domain();
  options.shared_memory = SharedMemory::off;
  const auto participant = Participant::create(options);
  const auto node = std::make_shared<Node>("node", NodeOptions{.participant = participant});
  const PlainParticipant plain(options.domain);
  Depths expected;
  std::vector<std::shared_ptr<void>> ends;
  for (const QoS& depth : {QoS(10), QoS(5), QoS(3), QoS(1), QoS(200), QoS().keep_all()}) {
    for (const auto& [name, qos] : {std::pair("reliable", QoS(depth)),
                                    {"best_effort", QoS(depth).best_effort()},
                                    {"latched", QoS(depth).transient_local()}}) {
      const std::string topic = fmt::format("{}_{}", name, qos.depth);
      expected[topic] = static_cast<std::int32_t>(qos.depth);
      ends.push_back(node->create_publisher<std_msgs::msg::String>("/depth/" + topic, qos));
      ends.push_back(node->create_subscription<std_msgs::msg::String>(
          "/depth/" + topic, qos, [](const std_msgs::msg::String&) {}));
    }
  }
  EXPECT_EQ(expected.at("reliable_16384"), 16384);  // the bound of "all"
  EXPECT_EQ(plain.discover(DDS_BUILTIN_TOPIC_DCPSPUBLICATION, expected.size()), expected);
  EXPECT_EQ(plain.discover(DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION, expected.size()), expected);
}

}  // namespace
}  // namespace takt
