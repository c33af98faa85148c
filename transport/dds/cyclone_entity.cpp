// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/dds/cyclone_entity.hpp"

#include <array>
#include <bit>
#include <cstring>

#include <arpa/inet.h>
#include <dds/ddsi/ddsi_guid.h>
#include <dds/ddsi/q_thread.h>
#include <dds/ddsi/q_xevent.h>
#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/messages/type_description.hpp"
#include "takt/transport/dds/key_values.hpp"
#include "takt/transport/dds/writer_clocks.hpp"

// Declared here, as dds/ddsi/ddsi_endpoint.h lacks includes that it needs.
extern "C" {
dds_return_t ddsi_delete_writer(ddsi_domaingv* domain, const ddsi_guid* guid);
dds_return_t ddsi_delete_reader(ddsi_domaingv* domain, const ddsi_guid* guid);
xeventq* takt_timed_events(const ddsi_domaingv* domain);  // of timed_events.c
}

namespace takt {
namespace {

dds_duration_t duration(Nanoseconds of) {
  return QoS::is_for_ever(of) ? DDS_INFINITY : of.count();
}
Nanoseconds nanoseconds(dds_duration_t of) {
  return of == DDS_INFINITY ? Nanoseconds::zero() : Nanoseconds(of);
}

ddsi_domaingv* domain_of(const Topic& topic) noexcept {
  return static_cast<ddsi_domaingv*>(ddsrt_atomic_ldvoidp(&topic.type().gv));
}

}  // namespace

dds_entity_t dds_check(dds_return_t result, const std::string& what,
                       const std::string& what_to_do) {
  if (result < 0) throw Error(fmt::format("{}: {}", what, dds_strretcode(result)), what_to_do);
  return result;
}

WireQoS wire_qos(const QoS& qos, std::size_t depth) {
  WireQoS wire(dds_create_qos(), &dds_delete_qos);
  dds_qset_history(wire.get(), DDS_HISTORY_KEEP_LAST, static_cast<std::int32_t>(depth));
  dds_qset_reliability(wire.get(),
                       qos.reliability == Reliability::reliable ? DDS_RELIABILITY_RELIABLE
                                                                : DDS_RELIABILITY_BEST_EFFORT,
                       DDS_MSECS(100));
  const bool is_kept = qos.durability == Durability::transient_local;
  dds_qset_durability(wire.get(),
                      is_kept ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  if (is_kept) {
    dds_qset_durability_service(wire.get(), 0, DDS_HISTORY_KEEP_LAST,
                                static_cast<std::int32_t>(qos.depth), DDS_LENGTH_UNLIMITED,
                                DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  }
  dds_qset_deadline(wire.get(), duration(qos.deadline_period));
  dds_qset_lifespan(wire.get(), duration(qos.lifespan_duration));
  dds_qset_liveliness(wire.get(),
                      qos.liveliness_kind == Liveliness::automatic ? DDS_LIVELINESS_AUTOMATIC
                                                                   : DDS_LIVELINESS_MANUAL_BY_TOPIC,
                      duration(qos.lease_duration));
  dds_qset_writer_data_lifecycle(wire.get(), false);
  return wire;
}

QoS qos_of(const dds_qos_t& wire) {
  QoS qos(1);
  dds_history_kind_t history;
  std::int32_t depth = 0;
  if (dds_qget_history(&wire, &history, &depth)) {
    qos.keep_all();
    if (history == DDS_HISTORY_KEEP_LAST) qos.keep_last(static_cast<std::size_t>(depth));
  }
  dds_reliability_kind_t reliability;
  if (dds_qget_reliability(&wire, &reliability, nullptr)) {
    qos.reliability =
        reliability == DDS_RELIABILITY_RELIABLE ? Reliability::reliable : Reliability::best_effort;
  }
  dds_durability_kind_t durability;
  if (dds_qget_durability(&wire, &durability)) {
    qos.durability =
        durability == DDS_DURABILITY_VOLATILE ? Durability::volatile_ : Durability::transient_local;
  }
  dds_duration_t time = DDS_INFINITY;
  if (dds_qget_deadline(&wire, &time)) qos.deadline_period = nanoseconds(time);
  if (dds_qget_lifespan(&wire, &time)) qos.lifespan_duration = nanoseconds(time);
  dds_liveliness_kind_t liveliness;
  if (dds_qget_liveliness(&wire, &liveliness, &time)) {
    qos.liveliness_kind = liveliness == DDS_LIVELINESS_AUTOMATIC ? Liveliness::automatic
                                                                 : Liveliness::manual_by_topic;
    qos.lease_duration = nanoseconds(time);
  }
  return qos;
}

std::string_view policy_name(std::uint32_t id) noexcept {
  switch (id) {
    case DDS_RELIABILITY_QOS_POLICY_ID:
      return "reliability";
    case DDS_DURABILITY_QOS_POLICY_ID:
      return "durability";
    case DDS_DEADLINE_QOS_POLICY_ID:
      return "deadline";
    case DDS_LIVELINESS_QOS_POLICY_ID:
      return "liveliness";
    default:
      return "another policy";
  }
}

std::string user_data(const Endpoint& endpoint, RosGraph form, const std::string& known_hash) {
  if (form == RosGraph::off) return clock_identity();
  const ServiceIdentity& identity = endpoint.identity;
  std::string text = identity.id + clock_identity();
  if (form != RosGraph::jazzy) return text;
  const std::string hash = !identity.id.empty() ? type_hash(identity.part(endpoint.type->name))
                           : endpoint.type->is_serialized ? known_hash
                                                          : type_hash(*endpoint.type);
  if (!hash.empty()) text += "typehash=" + hash + ";";
  return endpoint.node.empty() ? text : text + "node=" + endpoint.node + ";";
}

std::map<std::string, std::string> user_data_of(const dds_qos_t& qos) {
  void* data = nullptr;
  std::size_t size = 0;
  if (!dds_qget_userdata(&qos, &data, &size) || data == nullptr) return {};
  const std::string text(static_cast<const char*>(data), size);
  dds_free(data);
  return key_values(text);
}

std::string user_data_value(const dds_qos_t& qos, std::string_view key) {
  return user_data_of(qos)[std::string(key)];
}

Topic::Topic(dds_entity_t participant, const Endpoint& endpoint, bool in_shared_memory) {
  auto* type = new Sertype(*endpoint.type, in_shared_memory);
  ddsi_sertype* used = type;
  handle_ = dds_create_topic_sertype(participant, dds_topic_name(endpoint.topic).c_str(), &used,
                                     nullptr, nullptr, nullptr);
  if (handle_ < 0) ddsi_sertype_unref(type);
  dds_check(handle_, fmt::format("topic '{}' with type {} could not be made", endpoint.topic,
                                 endpoint.type->name));
  type_ = static_cast<const Sertype*>(used);
}

TimedCall::TimedCall(const Topic& topic, std::function<void()> function)
    : function_(std::move(function)),
      event_(qxev_callback(
          takt_timed_events(domain_of(topic)), DDSRT_MTIME_NEVER,
          [](xevent*, void* self, ddsrt_mtime_t) { static_cast<TimedCall*>(self)->function_(); },
          this)) {
}

TimedCall::~TimedCall() {
  delete_xevent_callback(event_);
}

void TimedCall::set(Nanoseconds from_now) noexcept {
  resched_xevent_if_earlier(event_,
                            ddsrt_mtime_add_duration(ddsrt_time_monotonic(), from_now.count()));
}

// The first half of dds_delete, made of the same functions.
void begin_deletion(dds_entity_t end, const Topic& topic, bool is_writer) noexcept {
  dds_set_listener(end, nullptr);
  dds_guid_t on_wire{};
  if (dds_get_guid(end, &on_wire) != DDS_RETCODE_OK) return;
  std::array<std::uint32_t, 4> words{};
  std::memcpy(words.data(), on_wire.v, sizeof on_wire.v);
  for (std::uint32_t& word : words) word = ntohl(word);
  const auto guid = std::bit_cast<ddsi_guid_t>(words);
  ddsi_domaingv* const domain = domain_of(topic);
  auto* const self = lookup_thread_state();
  thread_state_awake(self, domain);
  is_writer ? ddsi_delete_writer(domain, &guid) : ddsi_delete_reader(domain, &guid);
  thread_state_asleep(self);
}

}  // namespace takt
