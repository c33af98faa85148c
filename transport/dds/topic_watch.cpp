// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/topic_watch.hpp"

#include <array>
#include <chrono>
#include <utility>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/logger.hpp"
#include "takt/messages/type_description.hpp"

namespace takt {
namespace {

using Listener = std::unique_ptr<dds_listener_t, decltype(&dds_delete_listener)>;

// Limit: time for which a line about another's end waits for the name of its node. At it: it is
// logged without. Seen: the line.
constexpr Nanoseconds kMostWait = std::chrono::seconds(1);
// Limit: lines that wait for names. At it: further ones are logged without. Seen: the line.
constexpr std::size_t kMostUnnamed = 100;

std::string of_node(const std::string& node) {
  return node.empty() ? "a node whose name is not known" : "node '" + node + "'";
}
/// The GUID of the endpoint's participant.
std::string process_of(const std::string& end) {
  constexpr std::string_view kParticipant("\x00\x00\x01\xc1", 4);
  return end.substr(0, end.size() - kParticipant.size()).append(kParticipant);
}
std::string_view kind(bool is_writer) {
  return is_writer ? "publisher" : "subscription";
}

}  // namespace

TopicWatch::TopicWatch(const Topic* topic, GraphReader& names) : names_of_nodes_(names) {
  if (topic != nullptr) timer_.emplace(*topic, [this] { name_all(); });
}

void TopicWatch::begin(dds_entity_t participant) {
  dds_get_instance_handle(participant, &own_);
  const auto watch = [&](dds_entity_t topic, dds_on_data_available_fn on_data) {
    const Listener listener(dds_create_listener(this), &dds_delete_listener);
    dds_lset_data_available(listener.get(), on_data);
    return dds_check(dds_create_reader(participant, topic, nullptr, listener.get()),
                     "what is on the domain cannot be watched");
  };
  writers_ = watch(DDS_BUILTIN_TOPIC_DCPSPUBLICATION, [](dds_entity_t reader, void* self) {
    static_cast<TopicWatch*>(self)->discover(reader, true);
  });
  readers_ = watch(DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION, [](dds_entity_t reader, void* self) {
    static_cast<TopicWatch*>(self)->discover(reader, false);
  });
  discover(writers_, true);  // endpoints known before
  discover(readers_, false);
}

void TopicWatch::end() noexcept {
  for (dds_entity_t* reader : {&writers_, &readers_}) {
    if (*reader != 0) dds_delete(std::exchange(*reader, 0));
  }
  timer_.reset();
  const std::lock_guard lock(mutex_);
  for (const Unnamed& one : std::exchange(unnamed_, {})) {
    compare(one.topic, one.ours, one.other, "");
  }
}

void TopicWatch::add(const Endpoint& endpoint, bool is_writer) {
  const End end{endpoint.type->name, endpoint.node, endpoint.qos, is_writer};
  const std::lock_guard lock(mutex_);
  Ends& topic = topics_[dds_topic_name(endpoint.topic)];
  topic.ours.emplace(&endpoint, end);
  for (const auto& [gid, other] : topic.others) compare(endpoint.topic, end, other, gid);
}

void TopicWatch::remove(const Endpoint& endpoint) noexcept {
  const std::string name = dds_topic_name(endpoint.topic);
  const std::lock_guard lock(mutex_);
  topics_[name].ours.erase(&endpoint);
  forget_if_empty(name);
}

// Runs on a thread of Cyclone.
void TopicWatch::discover(dds_entity_t reader, bool writers) noexcept {
  std::array<void*, 16> samples{};
  std::array<dds_sample_info_t, 16> infos{};
  for (dds_return_t count; (count = dds_take(reader, samples.data(), infos.data(), samples.size(),
                                             samples.size())) > 0;) {
    for (dds_return_t i = 0; i < count; ++i) {
      const auto& found = *static_cast<const dds_builtintopic_endpoint_t*>(samples[i]);
      const std::string gid(reinterpret_cast<const char*>(found.key.v), sizeof found.key.v);
      const std::lock_guard lock(mutex_);
      if (infos[i].instance_state != DDS_ALIVE_INSTANCE_STATE) {
        if (const auto known = names_.find(gid); known != names_.end()) {
          topics_[known->second].others.erase(gid);
          forget_if_empty(known->second);
          names_.erase(known);
        }
      } else if (infos[i].valid_data && found.participant_instance_handle != own_ &&
                 !names_.contains(gid)) {
        const End other{ros_type_name(found.type_name), user_data_value(*found.qos, "node"),
                        qos_of(*found.qos), writers};
        Ends& topic = topics_[found.topic_name];
        names_.emplace(gid, found.topic_name);
        topic.others.emplace(gid, other);
        for (const auto& [endpoint, ours] : topic.ours) {
          if (compare(endpoint->topic, ours, other, gid)) break;  // one line for each new endpoint
        }
      }
    }
    dds_return_loan(reader, samples.data(), count);
  }
}

void TopicWatch::forget_if_empty(const std::string& name) noexcept {
  const auto topic = topics_.find(name);
  if (topic->second.ours.empty() && topic->second.others.empty()) topics_.erase(topic);
}

// True: there is something to report. `gid`: of the other endpoint; empty: do not wait for its
// node's name.
bool TopicWatch::compare(const std::string& topic, const End& ours, const End& other,
                         const std::string& gid) {
  if (ours.type != other.type) {
    if (waits_for_name(topic, ours, other, gid)) return true;
    complain(
        LogLevel::error,
        fmt::format("topic '{}' has two types, so no message passes: {} for the {} of {} here, "
                    "{} for the {} of {} in another process; give both one type",
                    topic, ours.type, kind(ours.is_writer), of_node(ours.node), other.type,
                    kind(other.is_writer), of_node(other.node)));
    return true;
  }
  if (ours.is_writer == other.is_writer) {
    return !ours.is_writer && compare_servers(topic, ours, other, gid);
  }
  const std::string_view policy =
      ours.is_writer ? ours.qos.refuses(other.qos) : other.qos.refuses(ours.qos);
  if (policy.empty()) return false;
  if (waits_for_name(topic, ours, other, gid)) return true;
  complain(LogLevel::warn,
           fmt::format("topic '{}': the publisher of {} {} offers less than the subscription of {} "
                       "{} asks for: {}; no message passes",
                       topic, of_node(ours.is_writer ? ours.node : other.node),
                       ours.is_writer ? "here" : "in another process",
                       of_node(ours.is_writer ? other.node : ours.node),
                       ours.is_writer ? "in another process" : "here", policy));
  return true;
}

// A reader of requests is a server. A node has many services, but one line for each node is enough.
bool TopicWatch::compare_servers(const std::string& topic, const End& ours, const End& other,
                                 const std::string& gid) {
  constexpr std::string_view kBegin = "rq/", kEnd = "Request";
  if (!topic.starts_with(kBegin) || !topic.ends_with(kEnd)) return false;
  if (doubted_.contains(ours.node) || waits_for_name(topic, ours, other, gid)) return true;
  const std::string name =
      topic.substr(kBegin.size() - 1, topic.size() - kBegin.size() + 1 - kEnd.size());
  const bool is_said = complain(
      LogLevel::warn,
      fmt::format("service '{}' is served by {} here, and by {} in another process: both get each "
                  "request; give each node and container its own name",
                  name, of_node(ours.node), of_node(other.node)));
  if (is_said) doubted_.insert(ours.node);
  return true;
}

// With the lock held. False: log now.
bool TopicWatch::waits_for_name(const std::string& topic, const End& ours, const End& other,
                                const std::string& gid) {
  if (!other.node.empty() || gid.empty() || !timer_ || unnamed_.size() == kMostUnnamed) {
    return false;
  }
  unnamed_.push_back({topic, ours, other, gid, later(Clock::steady().now(), kMostWait)});
  timer_->set(Nanoseconds::zero());
  return true;
}

void TopicWatch::announced(const std::string& process) {
  {
    const std::lock_guard lock(mutex_);
    if (unnamed_.empty()) return;
  }
  name(process);
}

// Logs the lines about a process's endpoints whose nodes are known now.
void TopicWatch::name(const std::string& process) {
  const GraphReader::Owners nodes = names_of_nodes_.owners_in(process);
  const std::lock_guard lock(mutex_);
  std::erase_if(unnamed_, [&](const Unnamed& one) {
    const auto found = nodes.find(one.gid);
    if (found == nodes.end()) return false;
    End other = one.other;
    other.node = found->second;
    compare(one.topic, one.ours, other, "");
    return true;
  });
}

// Runs on Cyclone's thread for timed events.
void TopicWatch::name_all() noexcept {
  std::set<std::string> processes;
  {
    const std::lock_guard lock(mutex_);
    for (const Unnamed& one : unnamed_) processes.insert(process_of(one.gid));
  }
  try {
    names_of_nodes_.begin();
    for (const std::string& process : processes) name(process);
  } catch (const Error&) {  // the announcements cannot be read
  }
  const std::lock_guard lock(mutex_);
  const TimePoint now = Clock::steady().now();
  std::erase_if(unnamed_, [&](const Unnamed& one) {
    return now >= one.until && compare(one.topic, one.ours, one.other, "");
  });
  if (!unnamed_.empty()) timer_->set(unnamed_.front().until - now);  // the first to end
}

bool TopicWatch::complain(LogLevel level, const std::string& line) {
  const auto left_out = throttle_.may_log();
  if (!left_out) return false;
  log(level, "{}{}", *left_out == 0 ? "" : fmt::format("({} others before) ", *left_out), line);
  return true;
}

}  // namespace takt
