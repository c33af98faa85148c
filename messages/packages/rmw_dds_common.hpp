// What ROS 2's processes tell each other of their nodes, as it is on the wire.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_MESSAGES_PACKAGES_RMW_DDS_COMMON_HPP_
#define TAKT_MESSAGES_PACKAGES_RMW_DDS_COMMON_HPP_

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "takt/messages/message_type.hpp"

namespace takt::rmw_dds_common {

/// The bytes of a DDS GUID: 16 of them since Iron; before, 24 with zeros at the end.
template <std::size_t kBytes>
struct BasicGid {
  std::array<std::uint8_t, kBytes> data{};
  friend auto operator<=>(const BasicGid&, const BasicGid&) = default;
};
template <std::size_t kBytes>
struct BasicNodeEntitiesInfo {
  Bounded<std::string, 256> node_namespace;
  Bounded<std::string, 256> node_name;
  std::vector<BasicGid<kBytes>> reader_gid_seq;
  std::vector<BasicGid<kBytes>> writer_gid_seq;
};
/// All nodes of a participant. The last one that it has sent holds.
template <std::size_t kBytes>
struct BasicParticipantEntitiesInfo {
  BasicGid<kBytes> gid;
  std::vector<BasicNodeEntitiesInfo<kBytes>> node_entities_info_seq;
};

using Gid = BasicGid<16>;
using NodeEntitiesInfo = BasicNodeEntitiesInfo<16>;
using ParticipantEntitiesInfo = BasicParticipantEntitiesInfo<16>;
TAKT_MESSAGE(Gid, "rmw_dds_common/msg/Gid", data);
TAKT_MESSAGE(NodeEntitiesInfo, "rmw_dds_common/msg/NodeEntitiesInfo", node_namespace, node_name,
             reader_gid_seq, writer_gid_seq);
TAKT_MESSAGE(ParticipantEntitiesInfo, "rmw_dds_common/msg/ParticipantEntitiesInfo", gid,
             node_entities_info_seq);

using HumbleGid = BasicGid<24>;
using HumbleNodeEntitiesInfo = BasicNodeEntitiesInfo<24>;
using HumbleParticipantEntitiesInfo = BasicParticipantEntitiesInfo<24>;
TAKT_MESSAGE(HumbleGid, "rmw_dds_common/msg/Gid", data);
TAKT_MESSAGE(HumbleNodeEntitiesInfo, "rmw_dds_common/msg/NodeEntitiesInfo", node_namespace,
             node_name, reader_gid_seq, writer_gid_seq);
TAKT_MESSAGE(HumbleParticipantEntitiesInfo, "rmw_dds_common/msg/ParticipantEntitiesInfo", gid,
             node_entities_info_seq);

}  // namespace takt::rmw_dds_common

#endif  // TAKT_MESSAGES_PACKAGES_RMW_DDS_COMMON_HPP_
