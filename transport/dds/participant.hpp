// Participant: connects this process to a DDS domain.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_DDS_PARTICIPANT_HPP_
#define TAKT_TRANSPORT_DDS_PARTICIPANT_HPP_

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/sched/threads/thread_attributes.hpp"
#include "takt/transport/dds/discovery.hpp"
#include "takt/transport/dds/graph.hpp"
#include "takt/transport/intra_process.hpp"
#include "takt/transport/shared_memory/shared_memory.hpp"

struct ddsi_serdata;  // Cyclone DDS: a message as it travels

namespace TAKT_PUBLIC takt {

/// The number in the environment's ROS_DOMAIN_ID, else 0. Throws Error when that is no domain.
int default_domain();

/// The files of DDS Security: the identity of this process, and what it may do. The policies of the
/// domain and the permissions are signed by their authority.
struct DdsSecurity {
  std::string identity_ca, certificate, private_key;    // PEM
  std::string permissions_ca, governance, permissions;  // PEM, and two S/MIME documents

  /// Throws an Error about a private key that cannot be read, that every user can read or change,
  /// or that is not the certificate's: of these Cyclone says nothing, or not why.
  void check() const;
};

struct DdsOptions {
  int domain = default_domain();  // 0 to 230: only processes of the same domain see each other
  DiscoveryRange discovery = default_discovery();
  /// Addresses of hosts whose processes are discovered, too, under `localhost` and `subnet`.
  std::vector<std::string> static_peers = default_static_peers();
  /// Policy, priority and CPUs of all of Cyclone's threads; they keep Cyclone's names. Not
  /// SCHED_DEADLINE, which they cannot inherit.
  ThreadAttributes threads;
  Realtime realtime = Realtime::prefer;
  /// Other hosts keep the same wall-clock time as this one (PTP): the time stamps of their messages
  /// count for latencies and deadlines. Otherwise those are measured from the arrival here. Within
  /// a host all share one clock.
  bool synchronized_clocks = false;
  /// Readers of this very process are served over DDS too, instead of by pointer. For comparisons.
  bool serves_own_process = false;
  /// Messages of fixed size go to other processes of Takt by shared memory, see shared_memory.hpp.
  SharedMemory shared_memory = SharedMemory::automatic;

  /// nullopt: every process on the domain may read and write everything.
  std::optional<DdsSecurity> security;

  /// The format in which nodes are announced on the domain.
  RosGraph ros_graph = RosGraph::jazzy;

  /// Containers publish their log on `/rosout`.
  bool rosout = true;
  /// Containers publish how they do on `/diagnostics`, while somebody subscribes.
  bool diagnostics = true;
  /// Containers answer ROS 2's parameter services, six for each node, and `get_type_description`.
  bool parameter_services = true;

  /// Throws an Error about threads that cannot be, and about shared memory required with security.
  void check() const;
};

/// What identifies an endpoint on the domain (DDS: its GUID).
using EndpointId = std::array<std::uint8_t, 16>;

/// Sends messages to other processes.
/// Thread safety and real-time: as Participant.
class RemoteWriter {
 public:
  virtual ~RemoteWriter() = default;
  /// How many readers are matched.
  virtual std::size_t reader_count() const noexcept = 0;
  /// The time, for `write` and `write_lent`: to be read before anything is done with the message.
  /// {} while nobody would receive it.
  virtual WallTime stamp() const noexcept = 0;
  /// Encodes and sends the message, or copies it into shared memory; does nothing while no reader
  /// is matched, unless the writer keeps messages for late joiners. `published`: a stamp; {}: now.
  virtual void write(const void* message, WallTime published) noexcept = 0;
  /// A message in shared memory, that `write_lent` sends without a copy and `release` gives back.
  /// It looks like the prototype, or as its last user has left it. nullptr when no reader is
  /// matched, the topic does not go by shared memory, too many are out, or no memory is left: then
  /// send another by `write`.
  virtual MessageBlock* lend(const void* prototype) noexcept = 0;
  /// Sends what `lend` gave, and takes it over.
  virtual void write_lent(MessageBlock& message, WallTime published) noexcept = 0;
  /// With manual liveliness: asserts that the publisher is alive without a message.
  virtual void assert_liveliness() noexcept = 0;
  /// Waits until every reliable reader has confirmed all messages. False: it took too long.
  virtual bool wait_for_acks(Nanoseconds timeout) noexcept = 0;
  virtual EndpointId gid() const noexcept { return {}; }
};

/// Receives messages from other processes until it is destroyed.
/// Thread safety and real-time: as Participant.
class RemoteReader {
 public:
  virtual ~RemoteReader() = default;
  virtual std::size_t writer_count() const noexcept = 0;
  /// With those that were overwritten in shared memory before they came here.
  virtual std::uint64_t received() const noexcept = 0;
  virtual EndpointId gid() const noexcept { return {}; }
};

/// A message that has come from another process. From shared memory it has a payload, in its chunk
/// or, when its reader holds many already, a copy. Else it is not decoded yet: so DDS's thread is
/// free for the next one, and the receiver's thread does the receiver's work. Thread safety: as
/// MessageBlock. Real-time: as Participant; hold_copy and hold_bytes allocate.
class ReceivedBlock final : public MessageBlock, public PoolNode<ReceivedBlock> {
 public:
  /// Empty, too, when it lies in a chunk that does not say that it is of our type.
  std::span<const std::byte> encoded() const noexcept override;
  void hold(ddsi_serdata* sample) noexcept { sample_ = sample; }
  /// `held` is counted down when it is released.
  void hold_chunk(ddsi_serdata* sample, const void* payload,
                  std::atomic<std::size_t>& held) noexcept {
    sample_ = sample;
    payload_ = payload;
    held_ = &held;
  }
  void hold_copy(const void* payload, std::size_t size);
  /// A message that has come from a GenericPublisher of this process, as bytes.
  void hold_bytes(std::span<const std::byte> bytes);
  bool from_heap = false;  // made because the pool was empty

 private:
  void recycle() noexcept override;
  ddsi_serdata* sample_ = nullptr;
  std::atomic<std::size_t>* held_ = nullptr;
  std::unique_ptr<std::byte[]> copy_;
  std::size_t copied_bytes_ = 0;  // of an encoded message; 0: the copy is the payload
};

/// The state of a publisher or subscription on the domain.
struct EndpointState {
  std::string topic;
  std::string type;
  bool is_writer = false;
  Reliability reliability = Reliability::reliable;
  std::size_t matched = 0;     // endpoints in other processes
  std::uint64_t messages = 0;  // sent to, or received from, other processes
  /// "shared memory" (used if the other endpoint can use it, too), or "UDP: " and the reason.
  std::string transport;
  std::uint64_t uncopied = 0;  // messages sent or read in shared memory without a copy
  std::uint64_t lost = 0;      // sent: no memory was left; received: overwritten in shared memory
  std::uint64_t id = 0;        // unique in the process
  EndpointId gid{};
};

/// Topics have ROS 2's names on the wire: "/scan" is "rt/scan", "sensor_msgs/msg/LaserScan" is
/// "sensor_msgs::msg::dds_::LaserScan_".
///
/// Shared memory carries messages of fixed size, with an alignment of at most 8 bytes, between
/// processes of Takt that found the same RouDi when they started. Such a message is written and
/// read in place, or copied once if the publisher or a callback does not use it in place. All other
/// messages use UDP. After RouDi has ended, existing endpoints continue; new ones use UDP, or are
/// rejected if shared memory is required.
///
/// Thread safety: every method from any thread. A message may be held for longer than the reader,
/// or the writer, that it came from.
/// Real-time: set-up only, but for RemoteWriter's `write`, `lend` and `write_lent`, which are as
/// deterministic as Cyclone DDS: they take Cyclone's locks, allocate inside Cyclone and make a
/// system call a message. When RouDi's pools are empty they take 10 ms to find out; the message is
/// counted as lost. Cyclone's and iceoryx's threads call our listener, which moves the message into
/// its reader's ring and announces it: no user code, no lock of ours. Messages that cannot be
/// decoded, and what Cyclone warns of, are counted and logged once a second at most.
class Participant {
 public:
  /// Throws Error when the options are wrong, the domain cannot be joined, with what Cyclone says
  /// of it, or shared memory is required and cannot be had. With shared memory it takes 0.1 s: what
  /// is written before the reader has discovered the writer is lost.
  static std::shared_ptr<Participant> create(const DdsOptions& options);
  virtual ~Participant() = default;

  /// `events` is notified of events between the writer and readers in other processes.
  virtual std::unique_ptr<RemoteWriter> create_writer(
      const Endpoint& endpoint,
      std::shared_ptr<EndpointEvents> events = std::make_shared<EndpointEvents>()) = 0;
  /// What arrives is delivered to `reader`, which must outlive the result.
  virtual std::unique_ptr<RemoteReader> create_reader(IntraProcessReader& reader) = 0;
  virtual bool serves_own_process() const noexcept = 0;
  /// Why nothing goes by shared memory; empty when something can.
  virtual const std::string& why_no_shared_memory() const noexcept = 0;
  virtual std::vector<EndpointState> endpoints() const = 0;
  /// Calls `visit` for each endpoint. It must not make or destroy one, nor ask for the graph.
  virtual void visit_endpoints(const std::function<void(const Endpoint&)>& visit) const = 0;
  /// A node of this process, by its full name, that others are to see.
  virtual void add_node(const std::string& name) = 0;
  virtual void remove_node(const std::string& name) = 0;
  /// What is on the domain, as far as known by now: discovery of others takes some tens of
  /// milliseconds.
  virtual Graph graph() = 0;
  /// Cyclone's threads, as they were right after they had started.
  virtual const std::vector<ThreadState>& threads() const noexcept = 0;
};

/// How often Cyclone has warned so far, in this process: malformed datagrams above all.
std::uint64_t dds_warnings() noexcept;

}  // namespace takt

#endif  // TAKT_TRANSPORT_DDS_PARTICIPANT_HPP_
