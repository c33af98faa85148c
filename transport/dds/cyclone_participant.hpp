// The participant on Cyclone DDS: its threads, its endpoints, the graph around it.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_DDS_CYCLONE_PARTICIPANT_HPP_
#define TAKT_TRANSPORT_DDS_CYCLONE_PARTICIPANT_HPP_

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <dds/dds.h>

#include "takt/transport/dds/cyclone_endpoint.hpp"
#include "takt/transport/dds/domain.hpp"
#include "takt/transport/dds/graph_reader.hpp"
#include "takt/transport/dds/node_announcer.hpp"
#include "takt/transport/dds/participant.hpp"
#include "takt/transport/dds/topic_watch.hpp"

namespace takt {

/// How long others need to hear of a writer that is new, or of a participant. What comes by shared
/// memory from an unknown writer Cyclone 0.10.2 loses, and its memory with it.
inline constexpr auto kHearsayTime = std::chrono::milliseconds(100);

class CycloneParticipant final : public Participant,
                                 public std::enable_shared_from_this<CycloneParticipant> {
 public:
  explicit CycloneParticipant(const DdsOptions& options);
  ~CycloneParticipant() override;

  std::unique_ptr<RemoteWriter> create_writer(const Endpoint& endpoint,
                                              std::shared_ptr<EndpointEvents> events) override;
  std::unique_ptr<RemoteReader> create_reader(IntraProcessReader& reader) override;
  bool serves_own_process() const noexcept override { return serves_own_process_; }
  bool clocks_are_synchronized() const noexcept { return clocks_are_synchronized_; }
  const std::string& why_no_shared_memory() const noexcept override {
    return why_no_shared_memory_;
  }
  const std::vector<ThreadState>& threads() const noexcept override { return threads_; }

  std::vector<EndpointState> endpoints() const override;
  void visit_endpoints(const std::function<void(const Endpoint&)>& visit) const override;
  void add_node(const std::string& name) override {
    if (announcer_ != nullptr) announcer_->add_node(name);
  }
  void remove_node(const std::string& name) override {
    if (announcer_ != nullptr) announcer_->remove_node(name);
  }
  Graph graph() override;

  dds_entity_t handle() const noexcept { return handle_; }
  void remove(dds_entity_t handle) const { domain_->remove(handle); }
  /// Deletes a writer or reader: for others it has gone at once, and its memory follows when some
  /// more have gone, so that many that go together do not wait one after the other.
  void let_go(dds_entity_t end, Topic topic, bool is_writer) noexcept;
  std::uint64_t id() const noexcept { return id_; }
  RosGraph ros_graph() const noexcept { return ros_graph_; }
  void add(const CycloneEndpoint& end, const Endpoint& endpoint, dds_entity_t handle,
           bool is_writer);
  void remove(const CycloneEndpoint& end, const Endpoint& endpoint, dds_entity_t handle) noexcept;
  /// The hash that other ends of its topic announce for a type of which only the name is known:
  /// without one, each process of ROS 2 warns. Empty: none does.
  std::string discovered_hash(const Endpoint& endpoint);
  /// What both ends of a service, or of a client, share; nullptr for an empty id.
  std::shared_ptr<ServiceMatches> service_matches(const std::string& id);
  /// Why the messages of an endpoint do not go by shared memory; empty: they do.
  std::string why_udp(const Endpoint& endpoint, bool is_writer) const;

 private:
  struct Leaving {
    dds_entity_t end;
    Topic topic;
  };

  void start_threads(const DdsOptions& options);
  void join(const DdsOptions& options);
  /// Throws Error if the participant has as many publishers and subscriptions as it can.
  void check_room() const;

  const bool serves_own_process_, requires_shared_memory_, clocks_are_synchronized_;
  const RosGraph ros_graph_;
  const std::uint64_t id_ = random_number();
  std::shared_ptr<Domain> domain_;
  std::string why_no_shared_memory_;
  dds_entity_t handle_ = 0;
  std::vector<ThreadState> threads_;
  std::unique_ptr<NodeAnnouncer> announcer_;  // nullptr: our nodes are not announced
  mutable std::mutex mutex_;
  std::vector<const CycloneEndpoint*> endpoints_;
  std::map<std::string, std::weak_ptr<ServiceMatches>> service_matches_;
  std::deque<Leaving> leaving_;
  std::unique_ptr<GraphReader> graph_reader_;
  std::unique_ptr<TopicWatch> topic_watch_;
};

}  // namespace takt

#endif  // TAKT_TRANSPORT_DDS_CYCLONE_PARTICIPANT_HPP_
