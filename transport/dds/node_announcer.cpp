// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/node_announcer.hpp"

#include <algorithm>
#include <random>

#include <fmt/format.h>

#include "takt/transport/dds/participant_entities.hpp"

namespace takt {
namespace {

dds_guid_t guid_of(dds_entity_t entity) {
  dds_guid_t guid{};
  dds_get_guid(entity, &guid);
  return guid;
}

template <class Gid>
void set(Gid& gid, const dds_guid_t& guid) {
  std::copy(std::begin(guid.v), std::end(guid.v), gid.data.begin());
}

dds_entity_t make_writer(dds_entity_t participant, const Topic& topic, const Endpoint& endpoint,
                         RosGraph form) {
  const WireQoS qos = wire_qos(endpoint.qos, endpoint.qos.depth);
  const std::string text = user_data(endpoint, form);
  dds_qset_userdata(qos.get(), text.data(), text.size());
  return dds_check(dds_create_writer(participant, topic.handle(), qos.get(), nullptr),
                   "nodes cannot be announced to others",
                   "permit the topic ros_discovery_info, or say `dds: {ros_graph: off}`");
}

}  // namespace

Endpoint discovery_endpoint(RosGraph form) {
  QoS qos(1);
  qos.durability = Durability::transient_local;
  return {"ros_discovery_info",
          form == RosGraph::humble ? &message_type<humble::ParticipantEntitiesInfo>()
                                   : &message_type<ParticipantEntitiesInfo>(),
          qos};
}

NodeAnnouncer::NodeAnnouncer(dds_entity_t participant, RosGraph form)
    : form_(form),
      participant_(guid_of(participant)),
      topic_(participant, discovery_endpoint(form), false),
      writer_(make_writer(participant, topic_, discovery_endpoint(form), form)) {
  announce();  // even without nodes: the first look at the graph waits for it
}

void NodeAnnouncer::add_node(const std::string& node) {
  const std::lock_guard lock(mutex_);
  ++nodes_[node].count;
  announce();
}

void NodeAnnouncer::remove_node(const std::string& node) {
  const std::lock_guard lock(mutex_);
  if (--nodes_[node].count == 0) nodes_.erase(node);
  announce();
}

void NodeAnnouncer::add_endpoint(const std::string& node, dds_entity_t endpoint, bool is_writer) {
  const std::lock_guard lock(mutex_);
  const auto found = nodes_.find(node);
  if (found == nodes_.end()) return;
  (is_writer ? found->second.writers : found->second.readers)[endpoint] = guid_of(endpoint);
  announce();
}

void NodeAnnouncer::remove_endpoint(const std::string& node, dds_entity_t endpoint) {
  const std::lock_guard lock(mutex_);
  const auto found = nodes_.find(node);
  if (found == nodes_.end()) return;
  found->second.readers.erase(endpoint);
  found->second.writers.erase(endpoint);
}

void NodeAnnouncer::announce() const {
  form_ == RosGraph::humble ? send<humble::ParticipantEntitiesInfo>()
                            : send<ParticipantEntitiesInfo>();
}

template <class ParticipantEntitiesInfo>
void NodeAnnouncer::send() const {
  ParticipantEntitiesInfo info;
  set(info.gid, participant_);
  for (const auto& [name, node] : nodes_) {
    const std::size_t slash = name.rfind('/');
    auto& announced = info.node_entities_info_seq.emplace_back();
    announced.node_namespace = slash == 0 ? "/" : name.substr(0, slash);
    announced.node_name = name.substr(slash + 1);
    for (const auto& [endpoint, guid] : node.readers) {
      set(announced.reader_gid_seq.emplace_back(), guid);
    }
    for (const auto& [endpoint, guid] : node.writers) {
      set(announced.writer_gid_seq.emplace_back(), guid);
    }
  }
  ddsi_serdata* data = encode(topic_.type(), &info);
  data->timestamp.v = dds_time();
  dds_forwardcdr(writer_, data);
}

std::string new_service_id(std::string_view kind) {
  std::random_device random;
  std::array<unsigned, 16> bytes{};
  std::generate(bytes.begin(), bytes.end(), [&] { return random() & 0xff; });
  return fmt::format("{}={:x};", kind, fmt::join(bytes, "."));
}

}  // namespace takt
