// Requests and responses of a service are two topics, which are discovered one after the other.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_DDS_SERVICE_MATCHES_HPP_
#define TAKT_TRANSPORT_DDS_SERVICE_MATCHES_HPP_

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include <dds/dds.h>

#include "takt/base/pi_mutex.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_INTERNAL takt {

/// The clients that a service has discovered, or the services that a client has, with the ids in
/// their user data: one is there when its endpoints of both topics are. As rmw_cyclonedds counts
/// them. Thread safety: from any thread. Real-time: hearing and count take a lock with priority
/// inheritance, and allocate nothing.
class ServiceMatches {
 public:
  enum Topic { requests, responses };

  /// `id`: empty where the other side has none, as it is not of ROS 2 or of Takt.
  void add(Topic topic, dds_instance_handle_t end, const std::string& id);
  void remove(Topic topic, dds_instance_handle_t end);
  bool knows(Topic topic, dds_instance_handle_t end) const;
  /// How many are matched by both ends.
  std::size_t count() const;

  /// For a service. A request of this client came from this writer. A writer is one client: of what
  /// says that it is several only the last is known, and none is another writer's. False: it said
  /// before that it was another one.
  bool called(std::uint64_t client, dds_instance_handle_t writer);
  /// How many clients are known, and how often a writer has said that it is another one.
  std::size_t callers() const;
  std::uint64_t changed_callers() const;
  /// What the client's reader of responses does.
  enum class Hearing {
    absent,   // it is not matched yet
    unknown,  // it is, but was not confirmed
    hears,    // it was, or the client has gone
  };
  Hearing hearing(std::uint64_t client) const;
  /// How many ends have come so far.
  std::uint64_t ends() const;
  /// The first so many ends that have come hear what is sent to them.
  void confirm(std::uint64_t ends);

 private:
  struct End {
    std::string id;
    std::uint64_t number;  // in the order of their coming, from 1
  };
  const End* find(Topic topic, const std::string& id) const;
  void forget_caller(dds_instance_handle_t writer);

  mutable PiMutex mutex_;
  std::map<dds_instance_handle_t, End> ends_[2];
  std::uint64_t come_ = 0, confirmed_ = 0;
  std::map<std::uint64_t, dds_instance_handle_t> callers_;
  std::map<dds_instance_handle_t, std::uint64_t> clients_;  // by their writers: as many as these
  std::uint64_t changed_callers_ = 0;
};

}  // namespace takt

#endif  // TAKT_TRANSPORT_DDS_SERVICE_MATCHES_HPP_
