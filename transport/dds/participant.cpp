// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/participant.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <map>
#include <mutex>
#include <random>
#include <set>
#include <thread>

#include <dds/dds.h>
#include <dds/ddsc/dds_loan_api.h>
#include <dds/ddsi/ddsi_shm_transport.h>
#include <dds/ddsrt/log.h>
#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/lockfree/read_section.hpp"
#include "takt/base/lockfree/sequence.hpp"
#include "takt/base/logger.hpp"
#include "takt/base/pi_mutex.hpp"
#include "takt/base/realtime_scope.hpp"
#include "takt/transport/dds/bounded_end.hpp"
#include "takt/transport/dds/cyclone_entity.hpp"
#include "takt/transport/dds/graph_reader.hpp"
#include "takt/transport/dds/loopback_sockets.hpp"
#include "takt/transport/dds/node_announcer.hpp"
#include "takt/transport/dds/topic_watch.hpp"
#include "takt/transport/dds/writer_clocks.hpp"
#include "takt/transport/dds/writer_sequences.hpp"
#include "takt/transport/shared_memory/refused_chunks.hpp"

namespace takt {
namespace {

// ---- The domain ----

constexpr int kLastDomain = 230;  // the ports of the next ones would leave the range of ports

std::atomic<std::uint64_t> warnings{0};

/// Cyclone's complaints: counted, and one a second told.
void complain(std::string_view text) {
  static constinit LogThrottle throttle;
  warnings.fetch_add(1, std::memory_order_relaxed);
  if (const auto left_out = throttle.may_log()) {
    // The count comes first, because long lines are cut.
    log(LogLevel::warn, "DDS{}: {}",
        *left_out == 0 ? "" : fmt::format(" (and {} others before)", *left_out), text);
  }
}

// On a thread that joins a domain: the last complaint, which is the reason if that fails.
thread_local std::string* reason = nullptr;

dds_entity_t check_joined(dds_return_t result, const std::string& what,
                          const std::string& what_to_do) {
  if (result < 0 && !reason->empty()) throw Error(what + ": " + *reason, what_to_do);
  return dds_check(result, what, what_to_do);
}

void log_sink(void*, const dds_log_data_t* data) {
  std::string_view text(data->message, data->size);
  while (text.ends_with('\n')) text.remove_suffix(1);
  if (reason != nullptr) {
    *reason = text;
    std::replace(reason->begin(), reason->end(), '\n', ' ');  // OpenSSL's
  } else if (!count_refused(text)) {
    complain(text);
  }
}

/// Lean, deterministic, discovery over the loopback interface without multicast, messages up to
/// the size of a datagram in one piece. One thread receives: several need no select() before each
/// message, but Cyclone wakes them at its end by a datagram over the network, and waits for ever
/// when the cable is cut.
std::string domain_configuration(const DdsOptions& options, std::uint64_t roudi) {
  const char* interfaces =
      options.loopback_only
          ? R"(<Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces><AllowMulticast>false</AllowMulticast>)"
          : "";
  const char* peers = options.loopback_only ? R"(<Peers><Peer address="127.0.0.1"/></Peers>)" : "";
  std::string shared_memory = "<Enable>false</Enable>";
  if (roudi != 0) {
    // The locator says who shares memory. Of others than us we do not know how their messages lie
    // there; of other machines, and other RouDis, we see nothing.
    shared_memory =
        "<Enable>true</Enable><LogLevel>fatal</LogLevel><Locator>74:61:6b:74:00:00:00:00";
    for (int byte = 0; byte < 8; ++byte) {
      shared_memory += fmt::format(":{:02x}", (roudi >> (8 * byte)) & 0xff);
    }
    shared_memory += fmt::format("</Locator><Prefix>takt_{}</Prefix>", options.domain);
  }
  return fmt::format(
      R"(<CycloneDDS><Domain id="any"><General>{}<MaxMessageSize>65500B</MaxMessageSize><FragmentSize>65000B</FragmentSize></General>)"
      R"(<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>100</MaxAutoParticipantIndex>{}<LeaseDuration>2s</LeaseDuration></Discovery>)"
      R"(<Internal><SocketReceiveBufferSize min="default" max="10MB"/><Watermarks><WhcHigh>16MB</WhcHigh></Watermarks><MultipleReceiveThreads>false</MultipleReceiveThreads></Internal>)"
      R"(<SharedMemory>{}</SharedMemory></Domain></CycloneDDS>)",
      interfaces, peers, shared_memory);
}

/// The RouDi that this process uses, once it has begun to: iceoryx binds a process to one.
std::uint64_t bind_to(const Roudi& roudi) {
  static std::atomic<std::uint64_t> bound{0};
  std::uint64_t before = 0;
  return bound.compare_exchange_strong(before, roudi.identity) ? roudi.identity : before;
}

/// Why this process cannot use the RouDi that runs now; empty: it can.
std::string why_not(const Roudi& roudi) {
  if (!roudi.unusable.empty()) return roudi.unusable;
  if (bind_to(roudi) != roudi.identity) return "RouDi was started again after this process";
  return {};
}

// Properties and not XML, where a path would need escapes. Debian has the plug-ins by these names.
void set_security(dds_qos_t* qos, const DdsSecurity& files) {
  const auto set = [qos](const std::string& name, const std::string& value) {
    dds_qset_prop(qos, ("dds.sec." + name).c_str(), value.c_str());
  };
  set("auth.identity_ca", "file:" + files.identity_ca);
  set("auth.identity_certificate", "file:" + files.certificate);
  set("auth.private_key", "file:" + files.private_key);
  set("access.permissions_ca", "file:" + files.permissions_ca);
  set("access.governance", "file:" + files.governance);
  set("access.permissions", "file:" + files.permissions);
  const auto set_library = [&](const std::string& plugin, const std::string& path,
                               const std::string& functions) {
    set(plugin + ".library.path", path);
    set(plugin + ".library.init", "init_" + functions);
    set(plugin + ".library.finalize", "finalize_" + functions);
  };
  set_library("auth", "dds_security_auth", "authentication");
  set_library("access", "dds_security_ac", "access_control");
  set_library("crypto", "dds_security_crypto", "crypto");
}

/// A process has one of each number, whoever asks first.
class Domain {
 public:
  static std::shared_ptr<Domain> get(const DdsOptions& options) {
    static std::mutex mutex;
    static std::map<int, std::weak_ptr<Domain>> domains;
    const std::lock_guard lock(mutex);
    std::weak_ptr<Domain>& known = domains[options.domain];
    std::shared_ptr<Domain> domain = known.lock();
    if (domain == nullptr) known = domain = std::make_shared<Domain>(options);
    return domain;
  }
  explicit Domain(const DdsOptions& options) {
    if (options.domain < 0 || options.domain > kLastDomain) {
      throw Error(fmt::format("there is no DDS domain {}", options.domain),
                  fmt::format("choose a number from 0 to {}", kLastDomain));
    }
    dds_set_log_sink(log_sink, nullptr);
    const Roudi roudi = find_roudi();
    why_no_shared_memory_ = options.shared_memory == SharedMemory::off
                                ? "switched off when this process joined the domain"
                            : options.security ? "what lies in shared memory is not secured"
                                               : why_not(roudi);
    handle_ = check_joined(
        dds_create_domain(
            static_cast<dds_domainid_t>(options.domain),
            domain_configuration(options, why_no_shared_memory_.empty() ? roudi.identity : 0)
                .c_str()),
        fmt::format("DDS domain {} could not be set up", options.domain),
        "at most 100 processes of one machine can join a domain: choose another by "
        "`dds: {domain: N}`");
    if (why_no_shared_memory_.empty()) bound_exit();
    if (roudi.is_silent && options.shared_memory == SharedMemory::automatic) {
      log(LogLevel::warn, "{}; messages go by UDP", roudi.unusable);
    }
    if (!options.loopback_only) return;
    if (const std::string why = keep_on_loopback(options.domain); !why.empty()) complain(why);
  }
  ~Domain() { remove(handle_); }
  Domain(const Domain&) = delete;
  Domain& operator=(const Domain&) = delete;

  const std::string& why_no_shared_memory() const noexcept { return why_no_shared_memory_; }
  /// Deletes an entity of the domain.
  void remove(dds_entity_t handle) const {
    why_no_shared_memory_.empty() ? delete_within_bound(handle) : void(dds_delete(handle));
  }

 private:
  std::string why_no_shared_memory_;
  dds_entity_t handle_;
};

std::set<int> threads_of_this_process() {
  std::set<int> threads;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task")) {
    threads.insert(std::stoi(entry.path().filename()));
  }
  return threads;
}

// ---- Entities ----

// A reliable writer keeps what a reader has not confirmed yet: as many as the QoS says, or so many.
// They cost memory only while somebody is behind, and the reader's own depth is kept by its ring.
constexpr std::size_t kUnconfirmed = 100;

using Listener = std::unique_ptr<dds_listener_t, decltype(&dds_delete_listener)>;

class CycloneParticipant;

/// What both ends have. One of whose messages some are still held in shared memory lives until they
/// are released, see put_away.
class CycloneEndpoint {
 public:
  CycloneEndpoint(CycloneParticipant& participant, const Endpoint& endpoint, bool is_writer);
  virtual ~CycloneEndpoint();
  CycloneEndpoint(const CycloneEndpoint&) = delete;
  CycloneEndpoint& operator=(const CycloneEndpoint&) = delete;

  EndpointState state() const {
    return {.topic = endpoint_.topic,
            .type = endpoint_.type->name,
            .is_writer = is_writer_,
            .reliability = endpoint_.qos.reliability,
            .matched = matched(),
            .messages = messages_.load(std::memory_order_relaxed),
            .way = is_shared() ? "shared memory" : "UDP: " + why_udp_,
            .uncopied = uncopied_.load(std::memory_order_relaxed),
            .lost = lost_.load(std::memory_order_relaxed),
            .id = number_};
  }
  std::size_t matched() const noexcept {
    const std::size_t count = matched_.load();
    return count != 0 && Clock::steady().now() >= is_known_at_ ? count : 0;
  }
  /// From here on nothing comes from it.
  void close() noexcept;
  /// No message of it is held any more.
  bool is_idle() const noexcept { return held_.load() == 0; }

 protected:
  bool is_shared() const noexcept { return why_udp_.empty(); }
  /// Makes the DDS entity with `create`: dds_create_writer or dds_create_reader.
  template <class Create>
  void make(Create create, std::size_t depth, const Listener& listener);
  void count_matched(dds_entity_t handle, std::size_t count, int change) noexcept;
  virtual EndpointEvents& events() const noexcept = 0;

  const std::shared_ptr<CycloneParticipant> participant_;  // must go last
  const Endpoint endpoint_;
  const bool is_writer_;
  const std::string why_udp_;  // empty: by shared memory
  Topic topic_;
  dds_entity_t handle_ = 0;
  const std::uint64_t number_;
  TimePoint is_known_at_{};
  std::mutex counting_;
  std::atomic<std::size_t> matched_{0};
  std::atomic<std::size_t> held_{0};  // by users, in shared memory
  std::atomic<std::uint64_t> messages_{0}, uncopied_{0}, lost_{0};
};

/// Ends, or lets live on, an endpoint whose owner has gone, and ends those whose messages have come
/// back meanwhile. A message that is never released keeps its endpoint, and the participant.
void put_away(std::unique_ptr<CycloneEndpoint> gone) {
  static auto& mutex = *new std::mutex;  // never destroyed, as messages may outlive `main`
  static auto& waiting = *new std::vector<std::unique_ptr<CycloneEndpoint>>;
  std::vector<std::unique_ptr<CycloneEndpoint>> idle;  // ends without the lock
  const std::lock_guard lock(mutex);
  if (gone != nullptr) waiting.push_back(std::move(gone));
  const auto first = std::partition(waiting.begin(), waiting.end(),
                                    [](const auto& endpoint) { return !endpoint->is_idle(); });
  std::move(first, waiting.end(), std::back_inserter(idle));
  waiting.erase(first, waiting.end());
}

std::uint64_t random_number() {
  std::random_device random;
  return std::uint64_t{random()} << 32 | random();
}

// iceoryx's listener takes 127 readers of a process, and Cyclone does not survive one more.
constexpr std::size_t kMostSharedReaders = 120;

// Cyclone 0.10.2 counts the children of a participant in 14 bits, and an end of ours is two of
// them: its topic, and its own publisher or subscriber. One more, and it knows the participant no
// longer.
constexpr std::size_t kMostEnds = 8'100;

// So long others need to hear of a writer that is new, or of a participant. What comes by shared
// memory from somebody unknown Cyclone 0.10.2 loses, and its memory with it.
constexpr auto kHearsayTime = std::chrono::milliseconds(100);

class CycloneParticipant final : public Participant,
                                 public std::enable_shared_from_this<CycloneParticipant> {
 public:
  explicit CycloneParticipant(const DdsOptions& options)
      : serves_own_process_(options.serves_own_process),
        requires_shared_memory_(options.shared_memory == SharedMemory::require),
        clocks_are_synchronized_(options.synchronized_clocks),
        ros_graph_(options.ros_graph) {
    // Every thread of Cyclone inherits from the one that creates the participant. The thread
    // attributes that it cannot inherit, its name, are Cyclone's.
    const std::set<int> before = threads_of_this_process();
    std::exception_ptr exception;
    std::string refused, said;
    int bootstrap = 0;
    std::thread([&] {
      reason = &said;
      try {
        ThreadAttributes attributes = options.threads;
        attributes.name = "dds";
        const ThreadState state = apply(attributes, options.realtime);
        refused = state.refused;
        bootstrap = state.tid;
        domain_ = Domain::get(options);
        const WireQoS qos(dds_create_qos(), &dds_delete_qos);
        if (options.security) set_security(qos.get(), *options.security);
        if (options.ros_graph != RosGraph::off) {
          constexpr std::string_view kEnclave = "enclave=/;";
          dds_qset_userdata(qos.get(), kEnclave.data(), kEnclave.size());
        }
        handle_ = check_joined(
            dds_create_participant(static_cast<dds_domainid_t>(options.domain), qos.get(), nullptr),
            fmt::format("DDS domain {} could not be joined", options.domain),
            options.security ? "look at the files under `dds: {security: ...}`" : "");
      } catch (...) {
        exception = std::current_exception();
      }
    }).join();
    if (exception) std::rethrow_exception(exception);
    if (!said.empty()) complain(said);
    for (const int thread : threads_of_this_process()) {
      if (before.contains(thread) || thread == bootstrap) continue;
      threads_.push_back(thread_state(thread));
      threads_.back().refused = refused;
    }
    why_no_shared_memory_ = options.shared_memory == SharedMemory::off
                                ? "switched off"
                                : domain_->why_no_shared_memory();
    if (why_no_shared_memory_.empty()) {
      std::this_thread::sleep_for(kHearsayTime);
    } else if (requires_shared_memory_) {
      dds_delete(handle_);
      throw Error("shared memory is required: " + why_no_shared_memory_,
                  "start iox-roudi as this user, or say `dds: {shared_memory: auto}`");
    }
    if (ros_graph_ != RosGraph::off) {
      announcer_ = std::make_unique<NodeAnnouncer>(handle_, ros_graph_);
    }
    topic_watch_ = std::make_unique<TopicWatch>(handle_);
  }
  ~CycloneParticipant() override {
    topic_watch_.reset();
    graph_reader_.reset();
    announcer_.reset();
    remove(handle_);
  }

  std::unique_ptr<RemoteWriter> create_writer(const Endpoint& endpoint,
                                              std::shared_ptr<EndpointEvents> events) override;
  std::unique_ptr<RemoteReader> create_reader(IntraProcessReader& reader) override;
  bool serves_own_process() const noexcept override { return serves_own_process_; }
  bool clocks_are_synchronized() const noexcept { return clocks_are_synchronized_; }
  const std::string& why_no_shared_memory() const noexcept override {
    return why_no_shared_memory_;
  }
  const std::vector<ThreadState>& threads() const noexcept override { return threads_; }

  std::vector<EndpointState> endpoints() const override {
    const std::lock_guard lock(mutex_);
    std::vector<EndpointState> result;
    for (const CycloneEndpoint* endpoint : endpoints_) result.push_back(endpoint->state());
    return result;
  }

  void add_node(const std::string& name) override {
    if (announcer_ != nullptr) announcer_->add_node(name);
  }
  void remove_node(const std::string& name) override {
    if (announcer_ != nullptr) announcer_->remove_node(name);
  }
  Graph graph() override {
    const std::lock_guard lock(mutex_);
    if (graph_reader_ == nullptr) {
      graph_reader_ = std::make_unique<GraphReader>(handle_, ros_graph_);
    }
    return graph_reader_->read();
  }

  dds_entity_t handle() const noexcept { return handle_; }
  void remove(dds_entity_t handle) const { domain_->remove(handle); }
  std::uint64_t id() const noexcept { return id_; }
  RosGraph ros_graph() const noexcept { return ros_graph_; }
  void add(const CycloneEndpoint& end, const Endpoint& endpoint, dds_entity_t handle,
           bool is_writer) {
    {
      const std::lock_guard lock(mutex_);
      endpoints_.push_back(&end);
    }
    topic_watch_->add(endpoint, is_writer);
    if (announcer_ != nullptr) announcer_->add_endpoint(endpoint.node, handle, is_writer);
  }
  void remove(const CycloneEndpoint& end, const Endpoint& endpoint, dds_entity_t handle) noexcept {
    {
      const std::lock_guard lock(mutex_);
      std::erase(endpoints_, &end);
    }
    topic_watch_->remove(endpoint);
    if (announcer_ != nullptr) announcer_->remove_endpoint(handle);
  }

  /// Throws Error when there is no room for one more end.
  void check_room() const {
    const std::lock_guard lock(mutex_);
    if (endpoints_.size() < kMostEnds) return;
    throw Error(fmt::format("a process has {} publishers and subscriptions on DDS at the most, "
                            "services and clients counted twice",
                            kMostEnds),
                "give some components a container of their own, or leave `dds` out if they talk to "
                "nobody outside");
  }
  /// Why the messages of an endpoint do not go by shared memory; empty: they do.
  std::string why_udp(const Endpoint& endpoint, bool is_writer) const {
    if (!why_no_shared_memory_.empty()) return why_no_shared_memory_;
    const MessageType& type = *endpoint.type;
    if (!type.fixed_size) return "variable size";
    const QoS& qos = endpoint.qos;
    if (qos.durability != Durability::volatile_) return "kept for who comes late";
    if (qos.liveliness_kind != Liveliness::automatic || qos.lease_duration != Nanoseconds::zero()) {
      return "its liveliness is watched";
    }
    if (qos.deadline_period != Nanoseconds::zero()) return "it has a deadline";
    if (qos.lifespan_duration != Nanoseconds::zero()) return "it has a lifespan";
    const Roudi roudi = find_roudi();
    std::string why = why_not(roudi);
    if (!why.empty()) {
      // That.
    } else if (type.alignment > kChunkAlignment) {
      why = fmt::format("aligned to {} bytes", type.alignment);
    } else if (type.size > roudi.largest_message) {
      why = fmt::format("{} bytes do not fit into RouDi's largest pool", type.size);
    } else if (!is_writer && shared_reader_count() >= kMostSharedReaders) {
      why = fmt::format("{} subscriptions of this process use it already", kMostSharedReaders);
    }
    if (!why.empty() && requires_shared_memory_) {
      throw Error(fmt::format("topic '{}' cannot go by shared memory: {}", endpoint.topic, why),
                  "say `dds: {shared_memory: auto}` to have it go by UDP");
    }
    return why;
  }

 private:
  static constexpr std::size_t kChunkAlignment = 8;  // Cyclone asks for no more

  const bool serves_own_process_, requires_shared_memory_, clocks_are_synchronized_;
  const RosGraph ros_graph_;
  const std::uint64_t id_ = random_number();
  std::shared_ptr<Domain> domain_;
  std::string why_no_shared_memory_;
  dds_entity_t handle_ = 0;
  std::vector<ThreadState> threads_;
  std::unique_ptr<NodeAnnouncer> announcer_;  // nullptr: others are not told of our nodes
  mutable std::mutex mutex_;
  std::vector<const CycloneEndpoint*> endpoints_;
  std::unique_ptr<GraphReader> graph_reader_;
  std::unique_ptr<TopicWatch> topic_watch_;
};

CycloneEndpoint::CycloneEndpoint(CycloneParticipant& participant, const Endpoint& endpoint,
                                 bool is_writer)
    : participant_(participant.shared_from_this()),
      endpoint_(endpoint),
      is_writer_(is_writer),
      why_udp_(participant.why_udp(endpoint, is_writer)),
      topic_(participant.handle(), endpoint, is_shared()),
      number_(next_sequence()) {
}

CycloneEndpoint::~CycloneEndpoint() {
  participant_->remove(handle_);
}

void CycloneEndpoint::close() noexcept {
  participant_->remove(*this, endpoint_, handle_);
  dds_set_listener(handle_, nullptr);  // waits for the one that runs
}

template <class Create>
void CycloneEndpoint::make(Create create, std::size_t depth, const Listener& listener) {
  // Who is to ignore the own process gets no shared memory from Cyclone: there the reader does it.
  const bool ignores_own_process = !is_shared() && !participant_->serves_own_process();
  const WireQoS qos = wire_qos(endpoint_.qos, depth);
  if (ignores_own_process) dds_qset_ignorelocal(qos.get(), DDS_IGNORELOCAL_PARTICIPANT);
  const std::string told = user_data(endpoint_, participant_->ros_graph());
  dds_qset_userdata(qos.get(), told.data(), told.size());
  handle_ = dds_check(
      create(participant_->handle(), topic_.handle(), qos.get(), listener.get()),
      fmt::format("no DDS {} for topic '{}'", is_writer_ ? "writer" : "reader", endpoint_.topic));
  if (is_shared() && !dds_is_loan_available(handle_)) {
    dds_delete(std::exchange(handle_, 0));
    throw Error("Cyclone DDS gives no shared memory to topic '" + endpoint_.topic + "'");
  }
  if (is_shared()) count_matched(handle_, matched_.load(), 0);
  participant_->add(*this, endpoint_, handle_, is_writer_);
}

// On a thread of Cyclone's, or on that which makes an end.
void CycloneEndpoint::count_matched(dds_entity_t handle, std::size_t count, int change) noexcept {
  if (!is_shared() || participant_->serves_own_process()) {
    matched_.store(count);
    if (change != 0) events().matched(change);
    return;
  }
  // Cyclone counts those of our own participant too.
  const std::lock_guard lock(counting_);  // so that the last one who stores has looked last
  std::vector<dds_instance_handle_t> others(16);
  for (;;) {
    const dds_return_t found =
        is_writer_ ? dds_get_matched_subscriptions(handle, others.data(), others.size())
                   : dds_get_matched_publications(handle, others.data(), others.size());
    if (found < 0) return;  // it is being made, or deleted
    const bool all = static_cast<std::size_t>(found) <= others.size();
    others.resize(static_cast<std::size_t>(found));
    if (all) break;
  }
  dds_instance_handle_t own = 0;
  dds_get_instance_handle(participant_->handle(), &own);
  count = static_cast<std::size_t>(std::count_if(others.begin(), others.end(), [&](auto other) {
    auto* data = is_writer_ ? dds_get_matched_subscription_data(handle, other)
                            : dds_get_matched_publication_data(handle, other);
    const bool is_outside = data != nullptr && data->participant_instance_handle != own;
    if (data != nullptr) dds_builtintopic_free_endpoint(data);
    return is_outside;
  }));
  change = static_cast<int>(count) - static_cast<int>(matched_.exchange(count));
  if (change != 0) events().matched(change);
}

// ---- Writing ----

class CycloneWriter;

/// A message that lies in shared memory and is not sent yet.
class LentBlock final : public MessageBlock, public PoolNode<LentBlock> {
 public:
  void lend(CycloneWriter& writer, ChunkHeader* chunk) noexcept {
    writer_ = &writer;
    chunk_ = chunk;
    payload_ = chunk + 1;
    set_references(1);
  }
  ChunkHeader* take() noexcept { return std::exchange(chunk_, nullptr); }

 private:
  void recycle() noexcept override;

  CycloneWriter* writer_ = nullptr;
  ChunkHeader* chunk_ = nullptr;
};

class CycloneWriter final : public CycloneEndpoint {
 public:
  CycloneWriter(CycloneParticipant& participant, const Endpoint& endpoint,
                std::shared_ptr<EndpointEvents> events)
      : CycloneEndpoint(participant, endpoint, true),
        events_(std::move(events)),
        lent_(Pool<LentBlock>::create(is_shared() ? kMostLent : 0, [](std::uint32_t) {
          return std::make_unique<LentBlock>();
        })) {
    const Listener listener(dds_create_listener(this), &dds_delete_listener);
    dds_lset_publication_matched(
        listener.get(),
        [](dds_entity_t handle, const dds_publication_matched_status_t status, void* self) {
          auto& writer = *static_cast<CycloneWriter*>(self);
          if (status.total_count_change > 0) writer.readers_ever_.fetch_add(1);
          writer.count_matched(handle, status.current_count, status.current_count_change);
        });
    dds_lset_offered_incompatible_qos(
        listener.get(),
        [](dds_entity_t, const dds_offered_incompatible_qos_status_t status, void* self) {
          static_cast<CycloneWriter*>(self)->events_->incompatible(
              policy_name(status.last_policy_id));
        });
    make(&dds_create_writer, std::max(endpoint_.qos.depth, kUnconfirmed), listener);
    if (is_shared()) is_known_at_ = Clock::steady().now() + kHearsayTime;
  }

  void write(const void* message) noexcept {
    if (matched_.load(std::memory_order_relaxed) == 0 &&
        endpoint_.qos.durability == Durability::volatile_) {
      return;
    }
    const ForeignCode cyclone;
    const dds_time_t published = dds_time();
    if (is_shared()) return write_copy(message, published);
    ddsi_serdata* data = encode(topic_.type(), message);
    data->timestamp.v = published;  // forwardcdr keeps it: encoding is a part of the way
    count(dds_forwardcdr(handle_, data));
  }

  MessageBlock* lend(const void* prototype) noexcept {
    if (!is_shared() || matched() == 0) return nullptr;
    LentBlock* block = lent_->acquire();
    if (block == nullptr) return nullptr;
    ChunkHeader* chunk = borrow();
    if (chunk == nullptr) {
      Pool<LentBlock>::recycle(*block);
      return nullptr;
    }
    if (chunk->writer != id_ || chunk->layout_hash != endpoint_.type->layout_hash) {
      std::memcpy(chunk + 1, prototype, endpoint_.type->size);
      identify(*chunk);
    }
    held_.fetch_add(1);
    block->lend(*this, chunk);
    return block;
  }

  void write_lent(MessageBlock& message) noexcept {
    if (matched() != 0) {
      const ForeignCode cyclone;
      const dds_time_t published = dds_time();
      const std::lock_guard lock(mutex_);
      if (send(static_cast<LentBlock&>(message).take(), published)) {
        uncopied_.fetch_add(1, std::memory_order_relaxed);
      }
    }
    message.release();
  }

  void give_back(LentBlock& block) noexcept {
    if (void* chunk = block.take()) {
      const ForeignCode cyclone;
      dds_return_loan(handle_, &chunk, 1);
    }
    Pool<LentBlock>::recycle(block);
    held_.fetch_sub(1);  // the last: from here on we may be gone
  }
  void assert_liveliness() noexcept { dds_assert_liveliness(handle_); }

 private:
  // Cyclone and iceoryx allow eight at once; one is for messages that are copied.
  static constexpr std::size_t kMostLent = 7;

  ChunkHeader* borrow() const noexcept {
    const ForeignCode cyclone;
    void* chunk = nullptr;
    return dds_loan_sample(handle_, &chunk) == DDS_RETCODE_OK ? static_cast<ChunkHeader*>(chunk)
                                                              : nullptr;
  }
  void identify(ChunkHeader& chunk) const noexcept {
    chunk.layout_hash = endpoint_.type->layout_hash;
    chunk.participant = participant_->id();
    chunk.writer = id_;
  }

  void write_copy(const void* message, dds_time_t published) noexcept {
    if (matched() == 0) return;
    const std::lock_guard lock(mutex_);
    ChunkHeader* chunk = borrow();
    if (chunk == nullptr) {
      count(DDS_RETCODE_OUT_OF_RESOURCES);
      return;
    }
    std::memcpy(chunk + 1, message, endpoint_.type->size);
    send(chunk, published);
  }

  // Gives the chunk up. With the mutex held, so that sequence is order.
  bool send(ChunkHeader* chunk, dds_time_t published) noexcept {
    identify(*chunk);
    if (const std::uint64_t readers = readers_ever_.load(); readers != readers_known_) {
      readers_known_ = readers;
      before_newest_ = sequence_;
    }
    chunk->sequence = sequence_ + 1;
    chunk->before = before_newest_;
    if (!count(dds_write_ts(handle_, chunk, published))) return false;
    ++sequence_;
    return true;
  }

  bool count(dds_return_t result) noexcept {
    if (result == DDS_RETCODE_OK) {
      messages_.fetch_add(1, std::memory_order_relaxed);
      return true;
    }
    lost_.fetch_add(1, std::memory_order_relaxed);
    if (static constinit LogThrottle throttle; throttle.may_log()) {
      log(LogLevel::warn, "{}: a message was not sent: no room for it in time", endpoint_.topic);
    }
    return false;
  }

  EndpointEvents& events() const noexcept override { return *events_; }

  const std::shared_ptr<EndpointEvents> events_;
  const std::uint64_t id_ = random_number();
  const PoolPtr<LentBlock> lent_;
  std::atomic<std::uint64_t> readers_ever_{0};
  PiMutex mutex_;               // guards what follows
  std::uint64_t sequence_ = 0;  // of the last one sent by shared memory
  std::uint64_t readers_known_ = 0, before_newest_ = 0;
};

void LentBlock::recycle() noexcept {
  writer_->give_back(*this);
}

/// What its publisher has of a writer, which may live longer.
class WriterEnd final : public RemoteWriter {
 public:
  explicit WriterEnd(std::unique_ptr<CycloneWriter> writer) : writer_(std::move(writer)) {}
  ~WriterEnd() override {
    writer_->close();
    put_away(std::move(writer_));
  }
  std::size_t reader_count() const noexcept override { return writer_->matched(); }
  void write(const void* message) noexcept override { writer_->write(message); }
  MessageBlock* lend(const void* prototype) noexcept override { return writer_->lend(prototype); }
  void write_lent(MessageBlock& message) noexcept override { writer_->write_lent(message); }
  void assert_liveliness() noexcept override { writer_->assert_liveliness(); }

 private:
  std::unique_ptr<CycloneWriter> writer_;
};

std::unique_ptr<RemoteWriter> CycloneParticipant::create_writer(
    const Endpoint& endpoint, std::shared_ptr<EndpointEvents> events) {
  put_away(nullptr);
  check_room();
  return std::make_unique<WriterEnd>(
      std::make_unique<CycloneWriter>(*this, endpoint, std::move(events)));
}

// ---- Reading ----

class CycloneReader final : public CycloneEndpoint, SharedReader {
 public:
  CycloneReader(CycloneParticipant& participant, IntraProcessReader& reader)
      : CycloneEndpoint(participant, reader.endpoint(), false),
        reader_(reader),
        clocks_(participant.clocks_are_synchronized()),
        most_held_(shared_messages_held(endpoint_.qos.depth)),
        blocks_(Pool<ReceivedBlock>::create(endpoint_.qos.depth + 8, [](std::uint32_t) {
          return std::make_unique<ReceivedBlock>();
        })) {
    const Listener listener(dds_create_listener(this), &dds_delete_listener);
    dds_lset_subscription_matched(
        listener.get(),
        [](dds_entity_t handle, const dds_subscription_matched_status_t status, void* self) {
          static_cast<CycloneReader*>(self)->count_matched(handle, status.current_count,
                                                           status.current_count_change);
        });
    dds_lset_requested_incompatible_qos(
        listener.get(),
        [](dds_entity_t, const dds_requested_incompatible_qos_status_t status, void* self) {
          static_cast<CycloneReader*>(self)->events().incompatible(
              policy_name(status.last_policy_id));
        });
    dds_lset_liveliness_changed(
        listener.get(), [](dds_entity_t, const dds_liveliness_changed_status_t status, void* self) {
          static_cast<CycloneReader*>(self)->events().liveliness_changed(
              status.alive_count_change, status.not_alive_count_change);
        });
    dds_lset_sample_lost(listener.get(),
                         [](dds_entity_t, const dds_sample_lost_status_t status, void* self) {
                           static_cast<CycloneReader*>(self)->events().lost(
                               static_cast<std::uint64_t>(status.total_count_change));
                         });
    dds_lset_data_available(listener.get(), [](dds_entity_t handle, void* self) {
      static_cast<CycloneReader*>(self)->receive(handle);
    });
    make(&dds_create_reader,
         is_shared() ? shared_queue_depth(endpoint_.qos.depth, endpoint_.type->size)
                     : std::max(endpoint_.qos.depth, kUnconfirmed),
         listener);
    if (is_shared()) register_reader();
  }
  ~CycloneReader() override { unregister_reader(); }

  std::uint64_t received() const noexcept { return messages_.load(); }

  /// Nothing arrives any more, and what has arrived and was not taken is given back.
  void close() noexcept {
    CycloneEndpoint::close();
    for (bool more = !is_idle(); more;) {
      if (MessageBlock* message = reader_.take(more)) message->release();
    }
  }

 private:
  // On a thread of Cyclone's or iceoryx's, or of a publisher of this process.
  void receive(dds_entity_t handle) noexcept {
    const ForeignCode cyclone;
    ddsi_serdata* sample = nullptr;
    dds_sample_info_t info;
    while (dds_takecdr(handle, &sample, 1, &info, DDS_ANY_STATE) == 1) {
      const ChunkHeader* chunk = chunk_of(*sample);
      if (!info.valid_data || (chunk != nullptr && chunk->participant == participant_->id() &&
                               !participant_->serves_own_process())) {  // that came by pointer
        ddsi_serdata_unref(sample);
        continue;
      }
      ReceivedBlock* block = blocks_->acquire();
      if (block == nullptr) {
        block = new ReceivedBlock;
        block->from_heap = true;
      }
      if (chunk != nullptr) {
        count_overwritten(*chunk, handle, info.publication_handle);
        hold(*block, sample, chunk + 1);
      } else {
        block->hold(sample);
      }
      block->set_references(1);
      messages_.fetch_add(1, std::memory_order_relaxed);
      const TimePoint sent_at = clocks_.sent_at(handle, info);
      const ReadSection section;
      const Arrival arrival{next_sequence(), sent_at};
      block->envelope = {.sequence = arrival.sequence, .ready_time = arrival.ready_time};
      reader_.deliver(*block, arrival);
    }
  }

  /// Where the message lies in shared memory, if it does and is of our type.
  const ChunkHeader* chunk_of(const ddsi_serdata& sample) const noexcept {
    const MessageType& type = *endpoint_.type;
    if (sample.iox_chunk == nullptr ||
        iceoryx_header_from_chunk(sample.iox_chunk)->data_size != sizeof(ChunkHeader) + type.size) {
      return nullptr;
    }
    const auto* chunk = static_cast<const ChunkHeader*>(sample.iox_chunk);
    return chunk->layout_hash == type.layout_hash ? chunk : nullptr;
  }

  void hold(ReceivedBlock& block, ddsi_serdata* sample, const void* payload) {
    if (held_.load() < most_held_) {
      held_.fetch_add(1);
      uncopied_.fetch_add(1, std::memory_order_relaxed);
      block.hold_chunk(sample, payload, held_);
    } else {
      block.hold_copy(payload, endpoint_.type->size);
      ddsi_serdata_unref(sample);
    }
  }

  // `reader`: handle_, which may still be on its way there.
  void count_overwritten(const ChunkHeader& chunk, dds_entity_t reader,
                         dds_instance_handle_t writer) {
    const auto is_matched = [reader](dds_instance_handle_t other) {
      auto* data = dds_get_matched_publication_data(reader, other);
      if (data != nullptr) dds_builtintopic_free_endpoint(data);
      return data != nullptr;
    };
    std::uint64_t overwritten = sequences_.overwritten(chunk, writer, is_matched);
    const std::uint64_t counted = std::min(overwritten, refused_);  // already
    refused_ -= counted;
    overwritten -= counted;
    if (overwritten != 0) count_lost(overwritten);
  }
  void count_lost(std::uint64_t overwritten) {
    messages_.fetch_add(overwritten, std::memory_order_relaxed);
    lost_.fetch_add(overwritten, std::memory_order_relaxed);
    reader_.miss(overwritten);
    events().lost(overwritten);
  }

  void refused() noexcept override {
    ++refused_;
    count_lost(1);
  }
  std::string_view topic() const noexcept override { return endpoint_.topic; }

  EndpointEvents& events() const noexcept override { return *reader_.events(); }

  IntraProcessReader& reader_;
  WriterClocks clocks_;  // only in receive
  const std::size_t most_held_;
  const PoolPtr<ReceivedBlock> blocks_;
  WriterSequences sequences_;  // only in receive
  std::uint64_t refused_ = 0;  // and not found missing yet; only in receive
};

/// What its subscription has of a reader, which may live longer.
class ReaderEnd final : public RemoteReader {
 public:
  explicit ReaderEnd(std::unique_ptr<CycloneReader> reader) : reader_(std::move(reader)) {}
  ~ReaderEnd() override {
    reader_->close();
    put_away(std::move(reader_));
  }
  std::size_t writer_count() const noexcept override { return reader_->matched(); }
  std::uint64_t received() const noexcept override { return reader_->received(); }

 private:
  std::unique_ptr<CycloneReader> reader_;
};

std::unique_ptr<RemoteReader> CycloneParticipant::create_reader(IntraProcessReader& reader) {
  put_away(nullptr);
  check_room();
  return std::make_unique<ReaderEnd>(std::make_unique<CycloneReader>(*this, reader));
}

}  // namespace

std::span<const std::byte> ReceivedBlock::encoded() const noexcept {
  return sample_ != nullptr ? static_cast<const Serdata*>(sample_)->bytes()
                            : std::span<const std::byte>(copy_.get(), copied_bytes_);
}

void ReceivedBlock::hold_bytes(std::span<const std::byte> bytes) {
  copy_ = std::make_unique_for_overwrite<std::byte[]>(bytes.size());
  std::memcpy(copy_.get(), bytes.data(), bytes.size());
  copied_bytes_ = bytes.size();
}

void ReceivedBlock::hold_copy(const void* payload, std::size_t size) {
  copy_ = std::make_unique_for_overwrite<std::byte[]>(size);
  std::memcpy(copy_.get(), payload, size);
  payload_ = copy_.get();
}

void ReceivedBlock::recycle() noexcept {
  if (sample_ != nullptr) ddsi_serdata_unref(std::exchange(sample_, nullptr));
  std::atomic<std::size_t>* held = std::exchange(held_, nullptr);
  payload_ = nullptr;
  copy_.reset();
  if (from_heap) {
    delete this;
  } else {
    Pool<ReceivedBlock>::recycle(*this);
  }
  if (held != nullptr) held->fetch_sub(1);  // the last: from here on the reader may be gone
}

void DdsOptions::check() const {
  if (threads.policy == ThreadPolicy::deadline) {
    throw Error("the threads of DDS inherit their policy, and a reservation is not inherited",
                "choose another policy than SCHED_DEADLINE for them");
  }
  if (security && shared_memory == SharedMemory::require) {
    throw Error("shared memory is required, and what lies there is not secured",
                "leave out one of `shared_memory` and `security`");
  }
}

std::shared_ptr<Participant> Participant::create(const DdsOptions& options) {
  options.check();
  if (options.security) options.security->check();
  put_away(nullptr);
  return std::make_shared<CycloneParticipant>(options);
}

int default_domain() {
  const char* text = std::getenv("ROS_DOMAIN_ID");
  if (text == nullptr || *text == 0) return 0;
  int domain = -1;
  const char* const text_end = text + std::strlen(text);
  const auto [end, error] = std::from_chars(text, text_end, domain);
  if (error != std::errc{} || end != text_end || domain < 0 || domain > kLastDomain) {
    throw Error(fmt::format("ROS_DOMAIN_ID is '{}'", text),
                fmt::format("set it to a number from 0 to {}", kLastDomain));
  }
  return domain;
}

std::uint64_t dds_warnings() noexcept {
  return warnings.load(std::memory_order_relaxed);
}

}  // namespace takt
