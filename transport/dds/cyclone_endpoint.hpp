// What a writer and a reader of Cyclone DDS have in common.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_DDS_CYCLONE_ENDPOINT_HPP_
#define TAKT_TRANSPORT_DDS_CYCLONE_ENDPOINT_HPP_

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <dds/dds.h>

#include "takt/base/clock.hpp"
#include "takt/transport/dds/cyclone_entity.hpp"
#include "takt/transport/dds/participant.hpp"
#include "takt/transport/dds/service_matches.hpp"

namespace takt {

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
    dds_guid_t guid{};
    dds_get_guid(handle_, &guid);
    return {.topic = endpoint_.topic,
            .type = endpoint_.type->name,
            .is_writer = is_writer_,
            .reliability = endpoint_.qos.reliability,
            .matched = confirmed(),
            .messages = messages_.load(std::memory_order_relaxed),
            .transport = is_shared() ? "shared memory" : "UDP: " + why_udp_,
            .uncopied = uncopied_.load(std::memory_order_relaxed),
            .lost = lost_.load(std::memory_order_relaxed),
            .id = number_,
            .gid = std::to_array(guid.v)};
  }
  const Endpoint& endpoint() const noexcept { return endpoint_; }
  std::size_t matched() const noexcept {
    const std::size_t count = matched_.load();
    return count != 0 && Clock::steady().now() >= is_known_at_ ? count : 0;
  }
  /// Of these, when all is ready on the other side, too.
  virtual std::size_t confirmed() const noexcept { return matched(); }
  /// From here on nothing comes from it.
  void close() noexcept;
  /// No message of it is held any more.
  bool is_idle() const noexcept { return held_.load() == 0; }

 protected:
  bool is_shared() const noexcept { return why_udp_.empty(); }
  /// Makes the DDS entity with `create`: dds_create_writer or dds_create_reader.
  void make(decltype(&dds_create_writer) create, std::size_t depth, const Listener& listener);
  void count_matched(dds_entity_t handle, std::size_t count, int change) noexcept;
  /// One end of a service or client notes that another end has come, or gone.
  void note_match(dds_entity_t handle, dds_instance_handle_t other, int change) noexcept;
  virtual EndpointEvents& events() const noexcept = 0;

  const std::shared_ptr<CycloneParticipant> participant_;  // must go last
  const Endpoint endpoint_;
  const bool is_writer_, is_service_;
  const std::string why_udp_;                       // empty: by shared memory
  const std::shared_ptr<ServiceMatches> services_;  // nullptr: this is no part of one
  Topic topic_;
  dds_entity_t handle_ = 0;
  const std::uint64_t number_;
  TimePoint is_known_at_{};
  std::mutex counting_;
  std::atomic<std::size_t> matched_{0};
  std::atomic<std::size_t> held_{0};  // by users, in shared memory
  std::atomic<std::uint64_t> messages_{0}, uncopied_{0}, lost_{0};

 private:
  std::vector<dds_instance_handle_t> matched_ends(dds_entity_t handle) const noexcept;
  void note(dds_entity_t handle, dds_instance_handle_t other, int change) noexcept;
};

/// Ends, or lets live on, an endpoint whose owner has gone, and ends those whose messages have come
/// back meanwhile. A message that is never released keeps its endpoint, and the participant.
void put_away(std::unique_ptr<CycloneEndpoint> gone);

std::uint64_t random_number();

std::unique_ptr<RemoteWriter> make_writer(CycloneParticipant& participant, const Endpoint& endpoint,
                                          std::shared_ptr<EndpointEvents> events);
std::unique_ptr<RemoteReader> make_reader(CycloneParticipant& participant,
                                          IntraProcessReader& reader);

}  // namespace takt

#endif  // TAKT_TRANSPORT_DDS_CYCLONE_ENDPOINT_HPP_
