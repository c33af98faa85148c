// What all entities of Cyclone DDS are made with: QoS, topics, user data.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_DDS_CYCLONE_ENTITY_HPP_
#define TAKT_TRANSPORT_DDS_CYCLONE_ENTITY_HPP_

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include <dds/dds.h>

#include "takt/base/visibility.hpp"
#include "takt/transport/dds/cyclone_type.hpp"
#include "takt/transport/dds/graph.hpp"
#include "takt/transport/intra_process.hpp"

struct xevent;  // Cyclone's

namespace TAKT_INTERNAL takt {

/// Throws Error, with what Cyclone calls it, when the result is one.
dds_entity_t dds_check(dds_return_t result, const std::string& what,
                       const std::string& what_to_do = {});

using WireQoS = std::unique_ptr<dds_qos_t, decltype(&dds_delete_qos)>;

/// `depth`: of the history that Cyclone keeps.
WireQoS wire_qos(const QoS& qos, std::size_t depth);
/// The QoS of an endpoint of another process; the depth is 1 where discovery does not contain it.
QoS qos_of(const dds_qos_t& wire);
/// As files call it, and QoS::refuses.
std::string_view policy_name(std::uint32_t id) noexcept;

/// What others want to know of an endpoint beyond its name and type. ROS 2: "typehash=RIHS01_...;",
/// "serviceid=...;". Takt: "node=/...;", and see clock_identity.
/// `known_hash`: the type's where only its name is known.
std::string user_data(const Endpoint& endpoint, RosGraph form, const std::string& known_hash = {});
/// What another endpoint's `user_data` says, by key.
std::map<std::string, std::string> user_data_of(const dds_qos_t& qos);
/// Under one key; empty: nothing.
std::string user_data_value(const dds_qos_t& qos, std::string_view key);

/// A topic of the participant for as long as one of its endpoints lives.
class Topic {
 public:
  Topic(dds_entity_t participant, const Endpoint& endpoint, bool in_shared_memory);
  ~Topic() {
    if (handle_ != 0) dds_delete(handle_);
  }
  Topic(Topic&& other) noexcept : handle_(std::exchange(other.handle_, 0)), type_(other.type_) {}
  Topic(const Topic&) = delete;
  Topic& operator=(const Topic&) = delete;

  dds_entity_t handle() const noexcept { return handle_; }
  const Sertype& type() const noexcept { return *type_; }

 private:
  dds_entity_t handle_;
  const Sertype* type_ = nullptr;  // Cyclone's, alive as long as the topic
};

/// A function that Cyclone's thread for timed events calls once after each `set`.
/// Thread safety: from any thread; but the destructor, which waits for a call that runs, not from
/// that function.
/// Real-time: `set` takes a lock of Cyclone's, for a moment.
class TimedCall {
 public:
  /// `topic`: of the same domain.
  TimedCall(const Topic& topic, std::function<void()> function);
  ~TimedCall();
  TimedCall(const TimedCall&) = delete;
  TimedCall& operator=(const TimedCall&) = delete;
  /// Ignored while an earlier time is set.
  void set(Nanoseconds from_now) noexcept;

 private:
  const std::function<void()> function_;
  xevent* event_;
};

/// Deletes what others and Cyclone's threads see of a writer or reader. What is left frees
/// dds_delete, which would otherwise wait for a millisecond until these threads have let go of it.
/// `topic`: its own.
void begin_deletion(dds_entity_t end, const Topic& topic, bool is_writer) noexcept;

}  // namespace takt

#endif  // TAKT_TRANSPORT_DDS_CYCLONE_ENTITY_HPP_
