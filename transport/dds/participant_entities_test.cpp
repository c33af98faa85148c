// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/participant_entities.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace takt {
namespace {

template <class ParticipantEntitiesInfo>
std::vector<int> bytes_of_one_node() {
  ParticipantEntitiesInfo info;
  info.gid.data[0] = 1;
  auto& node = info.node_entities_info_seq.emplace_back();
  node.node_namespace = "/";
  node.node_name = "a";
  node.reader_gid_seq.emplace_back().data[0] = 2;
  node.writer_gid_seq.emplace_back().data[15] = 3;
  ByteBuffer buffer;
  message_type<ParticipantEntitiesInfo>().encode(&info, buffer);
  std::vector<int> bytes;
  for (const std::byte byte : buffer.bytes()) bytes.push_back(static_cast<int>(byte));
  return bytes;
}

// One node "/a" with a reader and a writer, whose ids are so long; XCDR1, little endian.
std::vector<int> expected(std::size_t gid_bytes) {
  std::vector<int> bytes{0, 1, 0, 0};
  const auto append = [&](std::vector<int> more) {
    bytes.insert(bytes.end(), more.begin(), more.end());
  };
  const auto gid = [&](std::size_t place, int value) {
    std::vector<int> id(gid_bytes);
    id[place] = value;
    append(id);
  };
  gid(0, 1);
  append({1, 0, 0, 0, 2, 0, 0, 0, '/', 0, 0, 0, 2, 0, 0, 0, 'a', 0, 0, 0});
  append({1, 0, 0, 0});
  gid(0, 2);
  append({1, 0, 0, 0});
  gid(15, 3);
  return bytes;
}

TEST(ParticipantEntities, AreOnTheWireAsInEachReleaseOfRos2) {
  EXPECT_EQ(bytes_of_one_node<humble::ParticipantEntitiesInfo>(), expected(24));
  EXPECT_EQ(bytes_of_one_node<ParticipantEntitiesInfo>(), expected(16));
}

// By the rules of rmw_cyclonedds' reader of `ros_discovery_info`: plain CDR, lengths that the
// message has, texts that end with the 0 that their length counts, and have no more than 256 bytes.
TEST(ParticipantEntities, OfOthersAreRefusedAsRos2RefusesThem) {
  const std::vector<int> right = expected(16);
  const auto is_read = [](const std::vector<int>& ints) {
    std::vector<std::byte> bytes;
    for (const int each : ints) bytes.push_back(static_cast<std::byte>(each));
    ParticipantEntitiesInfo info;
    return message_type<ParticipantEntitiesInfo>().decode(bytes, &info);
  };
  EXPECT_TRUE(is_read(right));
  const auto with = [&](std::size_t place, int value) {
    std::vector<int> bytes = right;
    bytes.at(place) = value;
    return bytes;
  };
  constexpr std::size_t kNodes = 4 + 16, kLength = kNodes + 4, kText = kLength + 4;
  EXPECT_FALSE(is_read(with(1, 7)));              // another encoding
  EXPECT_FALSE(is_read(with(kNodes, 2)));         // a node more than there are
  EXPECT_FALSE(is_read(with(kNodes + 3, 0x7f)));  // very many
  EXPECT_FALSE(is_read(with(kLength, 200)));      // a text beyond the message
  EXPECT_FALSE(is_read(with(kText + 1, 'x')));    // without its end
  EXPECT_FALSE(is_read({right.begin(), right.end() - 1}));
  std::vector<int> wide = right;
  wide[kLength] = 257 + 1 - 256;
  wide[kLength + 1] = 1;
  wide.insert(wide.begin() + kText, 256, '/');
  EXPECT_FALSE(is_read(wide));  // 257 characters
}

}  // namespace
}  // namespace takt
