// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/cyclone_participant.hpp"

#include <exception>
#include <filesystem>
#include <optional>
#include <set>
#include <string_view>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/messages/message_types.hpp"
#include "takt/messages/type_description.hpp"
#include "takt/transport/dds/cyclone_entity.hpp"
#include "takt/transport/shared_memory/iceoryx.hpp"

namespace takt {
namespace {

// Cyclone 0.10.2 counts the children of a participant in 14 bits, and an endpoint of ours has two:
// its topic, and its DDS reader or writer. With one child more, Cyclone no longer finds the
// participant.
// Limit: publishers and subscriptions of a process on DDS; services and clients count twice. At it:
// a further one is refused. Seen: the error.
constexpr std::size_t kMostEnds = 8'100;

// Limit: publishers and subscriptions that have gone and whose memory is kept. At it: the first one
// is freed. Seen: nothing.
constexpr std::size_t kMostLeaving = 64;  // by then, Cyclone no longer uses the first

// Properties, as paths in XML would need escapes. The names of the plug-ins are Debian's.
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

std::set<int> threads_of_this_process() {
  std::set<int> threads;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/task")) {
    threads.insert(std::stoi(entry.path().filename()));
  }
  return threads;
}

}  // namespace

CycloneParticipant::CycloneParticipant(const DdsOptions& options)
    : serves_own_process_(options.serves_own_process),
      requires_shared_memory_(options.shared_memory == SharedMemory::require),
      clocks_are_synchronized_(options.synchronized_clocks),
      ros_graph_(options.ros_graph) {
  start_threads(options);
  why_no_shared_memory_ =
      options.shared_memory == SharedMemory::off ? "switched off" : domain_->why_no_shared_memory();
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
  graph_reader_ = std::make_unique<GraphReader>(
      handle_, ros_graph_,
      [this](const std::string& process) { topic_watch_->announced(process); });
  topic_watch_ = std::make_unique<TopicWatch>(
      announcer_ != nullptr ? &announcer_->topic() : nullptr, *graph_reader_);
  topic_watch_->begin(handle_);
}

CycloneParticipant::~CycloneParticipant() {
  topic_watch_->end();
  graph_reader_.reset();
  topic_watch_.reset();
  announcer_.reset();
  for (const Leaving& leaving : leaving_) remove(leaving.end);
  leaving_.clear();
  remove(handle_);
}

// Cyclone's threads inherit all attributes of the thread that creates the participant except the
// name, which Cyclone sets.
void CycloneParticipant::start_threads(const DdsOptions& options) {
  const std::set<int> before = threads_of_this_process();
  std::exception_ptr exception;
  std::string refused, complaint;
  int bootstrap = 0;
  std::thread([&] {
    KeptComplaint kept;
    try {
      ThreadAttributes attributes = options.threads;
      attributes.name = "dds";
      const ThreadState state = apply(attributes, options.realtime);
      refused = state.refused;
      bootstrap = state.tid;
      join(options);
    } catch (...) {
      exception = std::current_exception();
    }
    complaint = kept.text;
  }).join();
  if (exception) std::rethrow_exception(exception);
  if (!complaint.empty()) complain(complaint);
  for (const int thread : threads_of_this_process()) {
    if (before.contains(thread) || thread == bootstrap) continue;
    threads_.push_back(thread_state(thread));
    threads_.back().refused = refused;
  }
}

void CycloneParticipant::join(const DdsOptions& options) {
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
}

std::unique_ptr<RemoteWriter> CycloneParticipant::create_writer(
    const Endpoint& endpoint, std::shared_ptr<EndpointEvents> events) {
  put_away(nullptr);
  check_room();
  return make_writer(*this, endpoint, std::move(events));
}

std::unique_ptr<RemoteReader> CycloneParticipant::create_reader(IntraProcessReader& reader) {
  put_away(nullptr);
  check_room();
  return make_reader(*this, reader);
}

std::vector<EndpointState> CycloneParticipant::endpoints() const {
  const std::lock_guard lock(mutex_);
  std::vector<EndpointState> result;
  for (const CycloneEndpoint* endpoint : endpoints_) result.push_back(endpoint->state());
  return result;
}

void CycloneParticipant::visit_endpoints(const std::function<void(const Endpoint&)>& visit) const {
  const std::lock_guard lock(mutex_);
  for (const CycloneEndpoint* endpoint : endpoints_) visit(endpoint->endpoint());
}

Graph CycloneParticipant::graph() {
  return graph_reader_->read();
}

void CycloneParticipant::add(const CycloneEndpoint& end, const Endpoint& endpoint,
                             dds_entity_t handle, bool is_writer) {
  {
    const std::lock_guard lock(mutex_);
    endpoints_.push_back(&end);
  }
  topic_watch_->add(endpoint, is_writer);
  if (announcer_ != nullptr) announcer_->add_endpoint(endpoint.node, handle, is_writer);
}

void CycloneParticipant::remove(const CycloneEndpoint& end, const Endpoint& endpoint,
                                dds_entity_t handle) noexcept {
  {
    const std::lock_guard lock(mutex_);
    std::erase(endpoints_, &end);
    service_matches_.erase(endpoint.identity.id);  // both endpoints have this id
  }
  topic_watch_->remove(endpoint);
  if (announcer_ != nullptr) announcer_->remove_endpoint(endpoint.node, handle);
}

void CycloneParticipant::let_go(dds_entity_t end, Topic topic, bool is_writer) noexcept {
  begin_deletion(end, topic, is_writer);
  std::optional<Leaving> first;
  {
    const std::lock_guard lock(mutex_);
    leaving_.push_back({end, std::move(topic)});
    if (leaving_.size() <= kMostLeaving) return;
    first.emplace(std::move(leaving_.front()));
    leaving_.pop_front();
  }
  remove(first->end);
}

std::string CycloneParticipant::discovered_hash(const Endpoint& endpoint) {
  if (!endpoint.type->is_serialized || ros_graph_ != RosGraph::jazzy) return {};
  const Graph discovered = graph();
  for (const auto& ends : {discovered.publishers, discovered.subscriptions}) {
    for (const GraphEndpoint& end : ends) {
      const bool is_same = end.name == endpoint.topic && end.type == endpoint.type->name;
      if (is_same && !end.type_hash.empty()) return end.type_hash;
    }
  }
  const MessageType* registered = message_types().find(endpoint.type->name);
  return registered != nullptr ? type_hash(*registered) : "";
}

std::shared_ptr<ServiceMatches> CycloneParticipant::service_matches(const std::string& id) {
  if (id.empty()) return nullptr;
  const std::lock_guard lock(mutex_);
  std::weak_ptr<ServiceMatches>& known = service_matches_[id];
  std::shared_ptr<ServiceMatches> matches = known.lock();
  if (matches == nullptr) known = matches = std::make_shared<ServiceMatches>();
  return matches;
}

void CycloneParticipant::check_room() const {
  const std::lock_guard lock(mutex_);
  if (endpoints_.size() < kMostEnds) return;
  throw Error(fmt::format("a process has at most {} publishers and subscriptions on DDS, "
                          "services and clients counted twice",
                          kMostEnds),
              "give some components a container of their own, or leave `dds` out if they talk to "
              "nobody outside");
}

std::string CycloneParticipant::why_udp(const Endpoint& endpoint, bool is_writer) const {
  if (!why_no_shared_memory_.empty()) return why_no_shared_memory_;
  const MessageType& type = *endpoint.type;
  if (!type.fixed_size) return "variable size";
  const QoS& qos = endpoint.qos;
  if (qos.durability != Durability::volatile_) return "kept for late joiners";
  if (qos.liveliness_kind != Liveliness::automatic || qos.lease_duration != Nanoseconds::zero()) {
    return "its liveliness is watched";
  }
  if (qos.deadline_period != Nanoseconds::zero()) return "it has a deadline";
  if (qos.lifespan_duration != Nanoseconds::zero()) return "it has a lifespan";
  const std::string why = why_no_chunk(type, find_roudi(), is_writer);
  if (!why.empty() && requires_shared_memory_) {
    throw Error(fmt::format("topic '{}' cannot go by shared memory: {}", endpoint.topic, why),
                "say `dds: {shared_memory: auto}` to have it go by UDP");
  }
  return why;
}

}  // namespace takt
