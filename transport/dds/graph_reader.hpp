// Reads what the processes of a domain publish about themselves.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_DDS_GRAPH_READER_HPP_
#define TAKT_TRANSPORT_DDS_GRAPH_READER_HPP_

#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "takt/transport/dds/cyclone_entity.hpp"

namespace takt {

/// Of each process the last announcement of its nodes is kept until it is read, undecoded:
/// Cyclone's thread takes it when it comes, so that what a peer sends in a row never lies in the
/// queue. Thread safety: read from any thread. Real-time: no.
class GraphReader {
 public:
  /// `form`: that of the others' names of nodes; off: they are not read.
  GraphReader(dds_entity_t participant, RosGraph form);
  ~GraphReader();
  GraphReader(const GraphReader&) = delete;
  GraphReader& operator=(const GraphReader&) = delete;

  /// The first one waits until the processes that are known have announced their nodes.
  Graph read();

 private:
  using Gid = std::string;  // the 16 bytes of a DDS GUID
  /// The nodes of one process: "/ns/name" and the endpoints' owners.
  struct Process {
    std::vector<std::string> nodes;
    std::map<Gid, std::size_t> owners;  // indexes of nodes
  };
  /// Thread safety: of Cyclone's thread, and from any thread. Real-time: no.
  class Announcements;
  void await_announced();
  void take_discovered();
  template <class ParticipantEntitiesInfo>
  void take_discovered_as();
  template <class Sample, class Use>
  void for_each(dds_entity_t builtin_topic, Use&& use) const;
  /// The type hashes of what services and clients send, by their ids.
  using SentHashes = std::map<std::string, std::string>;
  using Owners = std::map<Gid, const std::string*>;  // the nodes of endpoints
  void read_endpoints(Graph& graph, SentHashes& sent, const Owners& owners, bool writers) const;

  const dds_entity_t participant_;
  const RosGraph form_;
  std::mutex mutex_;
  const std::unique_ptr<const Topic> topic_;
  const std::unique_ptr<Announcements> announcements_;
  const dds_entity_t reader_;
  std::map<Gid, Process> processes_;
  bool has_awaited_ = false;
};

}  // namespace takt

#endif  // TAKT_TRANSPORT_DDS_GRAPH_READER_HPP_
