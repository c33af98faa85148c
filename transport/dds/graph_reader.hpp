// Reads what the processes of a domain publish about themselves.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_DDS_GRAPH_READER_HPP_
#define TAKT_TRANSPORT_DDS_GRAPH_READER_HPP_

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>

#include "takt/base/visibility.hpp"
#include "takt/transport/dds/cyclone_entity.hpp"

namespace TAKT_INTERNAL takt {

/// Of each process the last announcement of its nodes is kept until it is read, undecoded:
/// Cyclone's thread takes it when it comes, so that what a peer sends in a row never lies in the
/// queue. Thread safety: read from any thread. Real-time: no.
class GraphReader {
 public:
  using Gid = std::string;  // the 16 bytes of a DDS GUID

  /// `form`: that of the others' names of nodes; off: they are not read. `on_announced` is called
  /// on Cyclone's thread when a process has announced its nodes, with the GUID of that.
  GraphReader(dds_entity_t participant, RosGraph form,
              std::function<void(const Gid& process)> on_announced);
  ~GraphReader();
  GraphReader(const GraphReader&) = delete;
  GraphReader& operator=(const GraphReader&) = delete;

  /// Listens to announcements from now on. Not on a thread of Cyclone's that reports something. An
  /// announcement of this very process comes before it returns.
  void begin();
  /// The first one waits until the processes that are known have announced their nodes.
  Graph read();
  using Owners = std::unordered_map<Gid, std::string>;  // the nodes of endpoints
  /// Of one process, as far as announced by now. It waits for nothing that takes Cyclone's threads,
  /// on which it may be called.
  Owners owners_in(const Gid& process);

 private:
  /// The nodes of one process: "/ns/name" and the endpoints' owners.
  struct Process {
    std::vector<std::string> nodes;
    std::map<Gid, std::size_t> owners;  // indexes of nodes
  };
  /// Thread safety: of Cyclone's thread, and from any thread. Real-time: no.
  class Announcements;
  void await_announced();
  void take_discovered();
  Process decoded(const ddsi_serdata& announcement) const;
  template <class ParticipantEntitiesInfo>
  Process decoded_as(const ddsi_serdata& announcement) const;
  template <class Sample, class Use>
  void for_each(dds_entity_t builtin_topic, Use&& use) const;
  /// The type hashes of what services and clients send, by their ids.
  using SentHashes = std::map<std::string, std::string>;
  /// Of all; adds the nodes to the graph. Those of processes that have gone are forgotten.
  Owners owners(Graph& graph);
  void read_endpoints(Graph& graph, SentHashes& sent, const Owners& owners, bool writers) const;

  const dds_entity_t participant_;
  const RosGraph form_;
  std::mutex mutex_;  // held by read() all the while
  const std::unique_ptr<Announcements> announcements_;
  std::once_flag has_begun_;
  std::unique_ptr<const Topic> topic_;
  dds_entity_t reader_ = 0;
  bool has_awaited_ = false;
  std::mutex processes_mutex_;  // without calls of Cyclone
  std::map<Gid, Process> processes_;
};

}  // namespace takt

#endif  // TAKT_TRANSPORT_DDS_GRAPH_READER_HPP_
