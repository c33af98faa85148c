// The messages by which ROS 2's processes announce their nodes, in the form of each release.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_DDS_PARTICIPANT_ENTITIES_HPP_
#define TAKT_TRANSPORT_DDS_PARTICIPANT_ENTITIES_HPP_

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/messages/rmw_dds_common/msg/participant_entities_info.hpp"

namespace TAKT_INTERNAL takt {

/// Humble's messages: an id has 24 bytes, the 16 of a DDS GUID and zeros.
namespace TAKT_INTERNAL humble {

struct Gid {
  std::array<std::uint8_t, 24> data{};
};
struct NodeEntitiesInfo {
  Bounded<std::string, 256> node_namespace;
  Bounded<std::string, 256> node_name;
  std::vector<Gid> reader_gid_seq;
  std::vector<Gid> writer_gid_seq;
};
/// All nodes of a participant. Each message takes the place of the one before.
struct ParticipantEntitiesInfo {
  Gid gid;
  std::vector<NodeEntitiesInfo> node_entities_info_seq;
};
TAKT_MESSAGE(Gid, "rmw_dds_common/msg/Gid", data);
TAKT_MESSAGE(NodeEntitiesInfo, "rmw_dds_common/msg/NodeEntitiesInfo", node_namespace, node_name,
             reader_gid_seq, writer_gid_seq);
TAKT_MESSAGE(ParticipantEntitiesInfo, "rmw_dds_common/msg/ParticipantEntitiesInfo", gid,
             node_entities_info_seq);

}  // namespace humble

/// Since Iron.
using rmw_dds_common::msg::ParticipantEntitiesInfo;

}  // namespace takt

#endif  // TAKT_TRANSPORT_DDS_PARTICIPANT_ENTITIES_HPP_
