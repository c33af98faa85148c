// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/graph_reader.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <condition_variable>
#include <iterator>
#include <set>
#include <tuple>
#include <utility>

#include <fmt/ranges.h>

#include "takt/base/logger.hpp"
#include "takt/base/printable.hpp"
#include "takt/messages/entries.hpp"
#include "takt/messages/type_description.hpp"
#include "takt/transport/dds/key_values.hpp"
#include "takt/transport/dds/node_announcer.hpp"
#include "takt/transport/dds/participant_entities.hpp"

namespace takt {
namespace {

dds_entity_t make_reader(dds_entity_t participant, const Topic& topic, const Endpoint& endpoint,
                         RosGraph form, const dds_listener_t* listener) {
  // The topic has no keys: the depth is shared by all processes, for the time between two reads of
  // Cyclone's thread.
  const WireQoS qos = wire_qos(endpoint.qos, endpoint.qos.depth);
  const std::string text = user_data(endpoint, form);
  dds_qset_userdata(qos.get(), text.data(), text.size());
  return dds_check(dds_create_reader(participant, topic.handle(), qos.get(), listener),
                   "the nodes of others cannot be read");
}

std::string bytes_of(const unsigned char* guid) {
  return {reinterpret_cast<const char*>(guid), 16};
}

// "rq/addRequest" → "/add"; empty: the topic is not of a service.
std::string service_in(std::string_view topic, std::string_view prefix, std::string_view suffix) {
  if (!topic.starts_with(prefix) || !topic.ends_with(suffix) ||
      topic.size() < prefix.size() + suffix.size()) {
    return {};
  }
  return std::string(topic.substr(prefix.size(), topic.size() - prefix.size() - suffix.size()));
}

std::string type_hash_of(std::map<std::string, std::string>& user_data) {
  std::string& hash = user_data["typehash"];
  return is_type_hash(hash) ? std::move(hash) : "";
}

std::string without(std::string type, std::string_view suffix) {
  if (type.ends_with(suffix)) type.resize(type.size() - suffix.size());
  return type;
}

using Listener = std::unique_ptr<dds_listener_t, decltype(&dds_delete_listener)>;

// Limit: nodes that a look at the graph shows. At it: further ones are left out. Seen: the log.
constexpr std::size_t kMostNodes = kMostEntries;
// Limit: publishers that a look at the graph shows, and as many subscriptions, services and
// clients. At it: further ones are left out. Seen: the log.
constexpr std::size_t kMostEndpoints = 100'000;

void note_left_out(std::size_t most, const char* what) {
  static constinit LogThrottle throttle(1);
  if (!throttle.may_log()) return;
  log(LogLevel::warn, "there are more than {} {} on this DDS domain; the others are left out", most,
      what);
}

}  // namespace

/// The last announcement of each live process, by the GUID of its participant.
class GraphReader::Announcements {
 public:
  struct Unref {
    void operator()(ddsi_serdata* sample) const noexcept { ddsi_serdata_unref(sample); }
  };
  using Sample = std::unique_ptr<ddsi_serdata, Unref>;

  explicit Announcements(std::function<void(const Gid&)> on_kept) : on_kept_(std::move(on_kept)) {}
  /// Called when announcements can be taken.
  static void on_data(dds_entity_t reader, void* self) {
    static_cast<Announcements*>(self)->take(reader);
  }
  /// Called when a process has come or gone.
  static void on_matched(dds_entity_t, const dds_subscription_matched_status_t status, void* self) {
    if (status.current_count_change >= 0) return;
    static_cast<Announcements*>(self)->forget_all_of(status.last_publication_handle);
  }
  std::map<Gid, Sample> all() {
    const std::lock_guard lock(mutex_);
    std::map<Gid, Sample> all;
    for (auto& [gid, kept] : kept_) all[gid] = std::move(kept.sample);
    kept_.clear();
    by_age_.clear();
    bytes_ = 0;
    return all;
  }
  Sample find(const Gid& process) {
    const std::lock_guard lock(mutex_);
    const auto kept = kept_.find(process);
    return Sample(kept != kept_.end() ? ddsi_serdata_ref(kept->second.sample.get()) : nullptr);
  }
  /// Waits until this number of processes have sent an announcement since the last all(), at most
  /// until `end`.
  void wait(std::size_t processes, std::chrono::steady_clock::time_point end) {
    std::unique_lock lock(mutex_);
    changed_.wait_until(lock, end, [&] { return kept_.size() >= processes; });
  }

 private:
  // Limit: bytes of an announcement of nodes. At it: a longer one is not read. Seen: its nodes are
  // not shown.
  static constexpr std::size_t kMostBytes = 1 << 20;
  // Limit: bytes of all announcements that wait to be read, of each process the last. At it: the
  // oldest one goes. Seen: its nodes are not shown until they are announced again.
  static constexpr std::size_t kMostUnread = 16 << 20;
  // Limit: processes whose announcements wait to be read. At it: the oldest one goes. Seen: its
  // nodes are not shown until they are announced again.
  static constexpr std::size_t kMostProcesses = 1000;

  struct Kept {
    Sample sample;
    std::size_t bytes = 0;
    std::uint64_t number = 0;
    dds_instance_handle_t writer = 0;
  };

  void take(dds_entity_t reader) {
    ddsi_serdata* taken = nullptr;
    dds_sample_info_t about;
    while (dds_takecdr(reader, &taken, 1, &about, DDS_ANY_STATE) == 1) {
      Sample sample(taken);
      const auto bytes = static_cast<Serdata*>(taken)->bytes();
      constexpr std::size_t kGid = 16;
      if (!about.valid_data || bytes.size() > kMostBytes ||
          bytes.size() < kCdrHeader.size() + kGid) {
        continue;
      }
      const auto* const gid = bytes.data() + kCdrHeader.size();
      keep(bytes_of(reinterpret_cast<const unsigned char*>(gid)),
           {std::move(sample), bytes.size(), 0, about.publication_handle});
    }
  }
  void keep(const Gid& gid, Kept announcement) {
    {
      const std::lock_guard lock(mutex_);
      forget(kept_.find(gid));
      announcement.number = ++last_;
      by_age_[last_] = gid;
      bytes_ += announcement.bytes;
      kept_[gid] = std::move(announcement);
      while (bytes_ > kMostUnread || kept_.size() > kMostProcesses) {
        forget(kept_.find(by_age_.begin()->second));
      }
      changed_.notify_all();
    }
    on_kept_(gid);
  }
  void forget_all_of(dds_instance_handle_t writer) {
    const std::lock_guard lock(mutex_);
    for (auto kept = kept_.begin(); kept != kept_.end();) {
      const auto next = std::next(kept);
      if (kept->second.writer == writer) forget(kept);
      kept = next;
    }
  }
  void forget(std::map<Gid, Kept>::iterator kept) {
    if (kept == kept_.end()) return;
    bytes_ -= kept->second.bytes;
    by_age_.erase(kept->second.number);
    kept_.erase(kept);
  }

  const std::function<void(const Gid&)> on_kept_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<Gid, Kept> kept_;
  std::map<std::uint64_t, Gid> by_age_;
  std::size_t bytes_ = 0;
  std::uint64_t last_ = 0;
};

GraphReader::GraphReader(dds_entity_t participant, RosGraph form,
                         std::function<void(const Gid&)> on_announced)
    : participant_(participant),
      form_(form),
      announcements_(std::make_unique<Announcements>(std::move(on_announced))) {
}

void GraphReader::begin() {
  if (form_ == RosGraph::off) return;
  std::call_once(has_begun_, [this] {
    topic_ = std::make_unique<Topic>(participant_, discovery_endpoint(form_), false);
    const Listener listener(dds_create_listener(announcements_.get()), &dds_delete_listener);
    dds_lset_data_available(listener.get(), &Announcements::on_data);
    dds_lset_subscription_matched(listener.get(), &Announcements::on_matched);
    reader_ = make_reader(participant_, *topic_, discovery_endpoint(form_), form_, listener.get());
  });
}

GraphReader::~GraphReader() {
  if (reader_ != 0) dds_delete(reader_);
}

// Processes announce their nodes again when they discover this reader, which takes a moment.
void GraphReader::await_announced() {
  // Limit: the time for which the first look at the graph waits for the nodes of the processes that
  // are known. At it: those that came are shown. Seen: nodes that only a later look shows.
  constexpr auto kMostWait = std::chrono::milliseconds(1000);
  const auto end = std::chrono::steady_clock::now() + kMostWait;
  const dds_return_t known = dds_get_matched_publications(reader_, nullptr, 0);
  if (known > 0) announcements_->wait(static_cast<std::size_t>(known), end);
}

// With the lock of the processes held.
void GraphReader::take_discovered() {
  for (const auto& [gid, sample] : announcements_->all()) processes_[gid] = decoded(*sample);
}

GraphReader::Process GraphReader::decoded(const ddsi_serdata& announcement) const {
  return form_ == RosGraph::humble ? decoded_as<humble::ParticipantEntitiesInfo>(announcement)
                                   : decoded_as<ParticipantEntitiesInfo>(announcement);
}

template <class ParticipantEntitiesInfo>
GraphReader::Process GraphReader::decoded_as(const ddsi_serdata& announcement) const {
  ParticipantEntitiesInfo info;
  Process process;
  if (!topic_->type().message.decode(static_cast<const Serdata&>(announcement).bytes(), &info)) {
    return process;
  }
  const auto gid = [](const auto& of) { return bytes_of(of.data.data()); };
  for (const auto& node : info.node_entities_info_seq) {
    const std::string& space = node.node_namespace.get();
    const std::size_t number = process.nodes.size();
    process.nodes.push_back(printable((space == "/" ? "" : space) + "/" + node.node_name.get()));
    for (const auto& reader : node.reader_gid_seq) process.owners[gid(reader)] = number;
    for (const auto& writer : node.writer_gid_seq) process.owners[gid(writer)] = number;
  }
  return process;
}

template <class Sample, class Use>
void GraphReader::for_each(dds_entity_t builtin_topic, Use&& use) const {
  const dds_entity_t reader =
      dds_check(dds_create_reader(participant_, builtin_topic, nullptr, nullptr),
                "what is on the domain cannot be listed");
  std::array<void*, 64> samples{};
  std::array<dds_sample_info_t, 64> infos{};
  for (dds_return_t count; (count = dds_take(reader, samples.data(), infos.data(), samples.size(),
                                             samples.size())) > 0;) {
    for (dds_return_t i = 0; i < count; ++i) {
      if (infos[i].valid_data && infos[i].instance_state == DDS_ALIVE_INSTANCE_STATE) {
        use(*static_cast<const Sample*>(samples[i]));
      }
    }
    dds_return_loan(reader, samples.data(), count);
  }
  dds_delete(reader);
}

void GraphReader::read_endpoints(Graph& graph, SentHashes& sent, const Owners& owners,
                                 bool writers) const {
  for_each<dds_builtintopic_endpoint_t>(
      writers ? DDS_BUILTIN_TOPIC_DCPSPUBLICATION : DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION,
      [&](const dds_builtintopic_endpoint_t& found) {
        auto user_data = user_data_of(*found.qos);
        // Escaped at the border, as discovery is untrusted input; valid names of ROS 2 do not
        // change.
        GraphEndpoint endpoint{.name = printable(found.topic_name),
                               .type = printable(ros_type_name(found.type_name)),
                               .type_hash = type_hash_of(user_data),
                               .gid = fmt::format("{:02x}", fmt::join(found.key.v, ".")),
                               .qos = qos_of(*found.qos)};
        // Endpoints of discovery itself are not shown.
        if (endpoint.name == discovery_endpoint(form_).topic ||
            endpoint.type.starts_with("org::eclipse::cyclonedds::builtin")) {
          return;
        }
        const auto owner = owners.find(bytes_of(found.key.v));
        if (owner != owners.end()) endpoint.node = owner->second;
        // The reader of requests stands for a service, the reader of responses for a client.
        const std::string service = service_in(endpoint.name, "rq", "Request");
        const std::string client = service_in(endpoint.name, "rr", "Reply");
        std::vector<GraphEndpoint>* list = writers ? &graph.publishers : &graph.subscriptions;
        if (!service.empty() || !client.empty()) {
          const bool is_service = writers == service.empty();
          const std::string id = user_data[is_service ? kServiceId : kClientId];
          if (writers) {
            if (!id.empty()) sent[id] = endpoint.type_hash;
            return;
          }
          list = is_service ? &graph.services : &graph.clients;
          endpoint.response_hash = sent[id];
          if (!is_service) std::swap(endpoint.type_hash, endpoint.response_hash);
          endpoint.name = service.empty() ? client : service;
          endpoint.type = without(without(endpoint.type, "_Request"), "_Response");
        } else if (endpoint.name.starts_with("rt/")) {
          endpoint.name.erase(0, 2);
        }
        if (list->size() == kMostEndpoints) return note_left_out(kMostEndpoints, "endpoints");
        list->push_back(std::move(endpoint));
      });
}

GraphReader::Owners GraphReader::owners(Graph& graph) {
  if (form_ != RosGraph::off) {
    const std::lock_guard lock(processes_mutex_);
    take_discovered();
  }
  std::set<Gid> alive;
  for_each<dds_builtintopic_participant_t>(DDS_BUILTIN_TOPIC_DCPSPARTICIPANT,
                                           [&](const dds_builtintopic_participant_t& participant) {
                                             alive.insert(bytes_of(participant.key.v));
                                           });
  Owners owners;
  const std::lock_guard lock(processes_mutex_);
  std::erase_if(processes_, [&](const auto& process) { return !alive.contains(process.first); });
  for (const auto& [gid, process] : processes_) {
    const std::size_t room = kMostNodes - graph.nodes.size();
    const std::size_t shown = std::min(process.nodes.size(), room);
    graph.nodes.insert(graph.nodes.end(), process.nodes.begin(),
                       process.nodes.begin() + static_cast<std::ptrdiff_t>(shown));
    if (shown < process.nodes.size()) note_left_out(kMostNodes, "nodes");
    for (const auto& [end, node] : process.owners) {
      owners.insert_or_assign(end, process.nodes[node]);
    }
  }
  std::sort(graph.nodes.begin(), graph.nodes.end());
  return owners;
}

GraphReader::Owners GraphReader::owners_in(const Gid& process) {
  Owners owners;
  const auto add = [&](const Process& of) {
    for (const auto& [end, node] : of.owners) owners.emplace(end, of.nodes[node]);
  };
  // The announcement stays unread, as the limits of number and bytes hold for unread ones.
  if (const auto unread = announcements_->find(process)) {
    add(decoded(*unread));
  } else {
    const std::lock_guard lock(processes_mutex_);
    if (const auto known = processes_.find(process); known != processes_.end()) add(known->second);
  }
  return owners;
}

Graph GraphReader::read() {
  const std::lock_guard lock(mutex_);
  begin();
  if (form_ != RosGraph::off && !std::exchange(has_awaited_, true)) await_announced();
  Graph graph;
  const Owners owners = this->owners(graph);
  SentHashes sent;
  read_endpoints(graph, sent, owners, true);
  read_endpoints(graph, sent, owners, false);
  for (auto* list : {&graph.publishers, &graph.subscriptions, &graph.services, &graph.clients}) {
    std::sort(list->begin(), list->end(), [](const auto& a, const auto& b) {
      return std::tie(a.name, a.node) < std::tie(b.name, b.node);
    });
  }
  return graph;
}

}  // namespace takt
