// Announces the nodes of this process to the other processes of the domain.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_DDS_NODE_ANNOUNCER_HPP_
#define TAKT_TRANSPORT_DDS_NODE_ANNOUNCER_HPP_

#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "takt/transport/dds/cyclone_entity.hpp"

namespace takt {

/// Where nodes are announced: rmw's topic, and the bytes of a DDS GUID in it.
Endpoint discovery_endpoint(RosGraph form);

/// Sends all of it again whenever something comes or a node goes, as ROS 2 does; the last message
/// holds, and late joiners get it. Thread safety: every method from any thread. Real-time: set-up
/// only.
class NodeAnnouncer {
 public:
  NodeAnnouncer(dds_entity_t participant, RosGraph form);
  ~NodeAnnouncer() { dds_delete(writer_); }
  NodeAnnouncer(const NodeAnnouncer&) = delete;
  NodeAnnouncer& operator=(const NodeAnnouncer&) = delete;

  const Topic& topic() const noexcept { return topic_; }
  /// Nodes are called by their full names, and endpoints belong to nodes that were added. Of two
  /// with the same name the endpoints are one's.
  void add_node(const std::string& node);
  void remove_node(const std::string& node);
  void add_endpoint(const std::string& node, dds_entity_t endpoint, bool is_writer);
  /// Others hear of that from DDS. Its id, which they skip from then on, is left out when something
  /// else changes: a message for each endpoint would cost a system that ends the square of its
  /// size.
  void remove_endpoint(const std::string& node, dds_entity_t endpoint);

 private:
  using Guid = dds_guid_t;
  struct Node {
    std::size_t count = 0;  // with that name
    std::map<dds_entity_t, Guid> readers, writers;
  };
  template <class ParticipantEntitiesInfo>
  void send() const;
  void announce() const;

  const RosGraph form_;
  const Guid participant_;
  const Topic topic_;
  const dds_entity_t writer_;
  std::mutex mutex_;
  std::map<std::string, Node> nodes_;
};

}  // namespace takt

#endif  // TAKT_TRANSPORT_DDS_NODE_ANNOUNCER_HPP_
