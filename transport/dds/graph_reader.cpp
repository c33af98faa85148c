// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/graph_reader.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <set>
#include <tuple>
#include <utility>

#include <fmt/ranges.h>

#include "takt/base/printable.hpp"
#include "takt/messages/type_description.hpp"
#include "takt/transport/dds/key_values.hpp"
#include "takt/transport/dds/node_announcer.hpp"
#include "takt/transport/dds/participant_entities.hpp"

namespace takt {
namespace {

dds_entity_t make_reader(dds_entity_t participant, const Topic* topic, const Endpoint& endpoint,
                         RosGraph form) {
  if (topic == nullptr) return 0;
  const WireQoS qos = wire_qos(endpoint.qos, endpoint.qos.depth);
  // There are no keys: so it is the history of all processes together.
  // Limit: announcements of nodes that wait to be read. At it: the oldest are overwritten; their
  // nodes come with the next announcement. Seen: nothing.
  constexpr std::int32_t kMostUnread = 1000;
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, kMostUnread);
  const std::string text = user_data(endpoint, form);
  dds_qset_userdata(qos.get(), text.data(), text.size());
  return dds_check(dds_create_reader(participant, topic->handle(), qos.get(), nullptr),
                   "the nodes of others cannot be read");
}

std::string bytes_of(const unsigned char* guid) {
  return {reinterpret_cast<const char*>(guid), 16};
}

// "rq/addRequest" → "/add"; empty: it is no such topic.
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

}  // namespace

GraphReader::GraphReader(dds_entity_t participant, RosGraph form)
    : participant_(participant),
      form_(form),
      topic_(form == RosGraph::off
                 ? nullptr
                 : std::make_unique<Topic>(participant, discovery_endpoint(form), false)),
      reader_(make_reader(participant, topic_.get(), discovery_endpoint(form), form)) {
}

GraphReader::~GraphReader() {
  if (reader_ != 0) dds_delete(reader_);
}

// Processes announce their nodes anew to a reader that they have seen, which takes them a moment.
void GraphReader::await_announced() {
  // Limit: the time for which the first look at the graph waits for the nodes of the processes that
  // are known. At it: those that came are shown. Seen: nodes that only a later look shows.
  constexpr auto kMostWait = std::chrono::milliseconds(1000);
  const dds_time_t end = dds_time() + std::chrono::nanoseconds(kMostWait).count();
  const dds_entity_t unread = dds_create_readcondition(reader_, DDS_ANY_STATE);
  const dds_entity_t waitset = dds_create_waitset(participant_);
  dds_waitset_attach(waitset, unread, 0);
  const auto have_all_announced = [this] {
    const dds_return_t known = dds_get_matched_publications(reader_, nullptr, 0);
    return known < 0 || processes_.size() >= static_cast<std::size_t>(known);
  };
  for (take_discovered(); !have_all_announced(); take_discovered()) {
    if (dds_waitset_wait_until(waitset, nullptr, 0, end) <= 0) break;
  }
  dds_delete(waitset);
  dds_delete(unread);
}

void GraphReader::take_discovered() {
  form_ == RosGraph::humble ? take_discovered_as<humble::ParticipantEntitiesInfo>()
                            : take_discovered_as<ParticipantEntitiesInfo>();
}

template <class ParticipantEntitiesInfo>
void GraphReader::take_discovered_as() {
  ParticipantEntitiesInfo info;
  ddsi_serdata* sample = nullptr;
  dds_sample_info_t about;
  const auto gid = [](const auto& of) { return bytes_of(of.data.data()); };
  while (dds_takecdr(reader_, &sample, 1, &about, DDS_ANY_STATE) == 1) {
    const bool is_info = about.valid_data && topic_->type().message.decode(
                                                 static_cast<Serdata*>(sample)->bytes(), &info);
    ddsi_serdata_unref(sample);
    if (!is_info) continue;
    Process& process = processes_[gid(info.gid)] = {};
    for (const auto& node : info.node_entities_info_seq) {
      const std::string& space = node.node_namespace.get();
      const std::string name = printable((space == "/" ? "" : space) + "/" + node.node_name.get());
      process.nodes.push_back(name);
      for (const auto& reader : node.reader_gid_seq) process.owners[gid(reader)] = name;
      for (const auto& writer : node.writer_gid_seq) process.owners[gid(writer)] = name;
    }
  }
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

void GraphReader::read_endpoints(Graph& graph, SentHashes& sent, bool writers) const {
  for_each<dds_builtintopic_endpoint_t>(
      writers ? DDS_BUILTIN_TOPIC_DCPSPUBLICATION : DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION,
      [&](const dds_builtintopic_endpoint_t& found) {
        auto user_data = user_data_of(*found.qos);
        // Escaped at the border: names of ROS 2 have nothing to escape.
        GraphEndpoint endpoint{.name = printable(found.topic_name),
                               .type = printable(ros_type_name(found.type_name)),
                               .type_hash = type_hash_of(user_data),
                               .gid = fmt::format("{:02x}", fmt::join(found.key.v, ".")),
                               .qos = qos_of(*found.qos)};
        // The endpoints that serve discovery itself are not shown.
        if (endpoint.name == discovery_endpoint(form_).topic ||
            endpoint.type.starts_with("org::eclipse::cyclonedds::builtin")) {
          return;
        }
        const std::string gid = bytes_of(found.key.v);
        for (const auto& [participant, process] : processes_) {
          if (const auto owner = process.owners.find(gid); owner != process.owners.end()) {
            endpoint.node = owner->second;
          }
        }
        // A service is known by what it receives.
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
        list->push_back(std::move(endpoint));
      });
}

Graph GraphReader::read() {
  const std::lock_guard lock(mutex_);
  if (form_ != RosGraph::off) {
    if (!std::exchange(has_awaited_, true)) await_announced();
    take_discovered();
  }
  std::set<Gid> alive;
  for_each<dds_builtintopic_participant_t>(DDS_BUILTIN_TOPIC_DCPSPARTICIPANT,
                                           [&](const dds_builtintopic_participant_t& participant) {
                                             alive.insert(bytes_of(participant.key.v));
                                           });
  std::erase_if(processes_, [&](const auto& process) { return !alive.contains(process.first); });
  Graph graph;
  for (const auto& [gid, process] : processes_) {
    graph.nodes.insert(graph.nodes.end(), process.nodes.begin(), process.nodes.end());
  }
  std::sort(graph.nodes.begin(), graph.nodes.end());
  SentHashes sent;
  read_endpoints(graph, sent, true);
  read_endpoints(graph, sent, false);
  for (auto* list : {&graph.publishers, &graph.subscriptions, &graph.services, &graph.clients}) {
    std::sort(list->begin(), list->end(), [](const auto& a, const auto& b) {
      return std::tie(a.name, a.node) < std::tie(b.name, b.node);
    });
  }
  return graph;
}

}  // namespace takt
