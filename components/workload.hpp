// Synthetic nodes for measurements: they publish, receive, and use CPU time as configured.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_COMPONENTS_WORKLOAD_HPP_
#define TAKT_COMPONENTS_WORKLOAD_HPP_

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/containers/component.hpp"
#include "takt/nodes/lifecycle_node.hpp"

namespace TAKT_INTERNAL takt {

/// Message of variable size.
struct WorkloadMessage {
  std::uint64_t tracking_number = 0;
  std::vector<std::byte> data;
};
TAKT_MESSAGE(WorkloadMessage, "takt/msg/Workload", tracking_number, data);

/// Message of a fixed total size, which can use shared memory.
template <std::size_t Bytes>
struct FixedWorkloadMessage {
  std::uint64_t tracking_number = 0;
  std::array<std::byte, Bytes - sizeof(std::uint64_t)> data{};
};
TAKT_MESSAGE(FixedWorkloadMessage<1'000>, "takt/msg/Workload1000", tracking_number, data);
TAKT_MESSAGE(FixedWorkloadMessage<50'000>, "takt/msg/Workload50000", tracking_number, data);
TAKT_MESSAGE(FixedWorkloadMessage<100'000>, "takt/msg/Workload100000", tracking_number, data);
TAKT_MESSAGE(FixedWorkloadMessage<500'000>, "takt/msg/Workload500000", tracking_number, data);
TAKT_MESSAGE(FixedWorkloadMessage<1'000'000>, "takt/msg/Workload1000000", tracking_number, data);
TAKT_MESSAGE(FixedWorkloadMessage<5'000'000>, "takt/msg/Workload5000000", tracking_number, data);
TAKT_MESSAGE(FixedWorkloadMessage<8'000'000>, "takt/msg/Workload8000000", tracking_number, data);

/// The service that workload clients call.
struct WorkloadService {
  struct Request {
    std::uint64_t tracking_number = 0;
    std::array<std::byte, 10> data{};
  };
  struct Response {
    std::uint64_t tracking_number = 0;
    std::array<std::byte, 10> data{};
  };
};
TAKT_MESSAGE(WorkloadService::Request, "takt/srv/Workload_Request", tracking_number, data);
TAKT_MESSAGE(WorkloadService::Response, "takt/srv/Workload_Response", tracking_number, data);

/// The entities of a workload, and how long their callbacks run.
struct WorkloadEntities {
  std::vector<std::shared_ptr<void>> all;
  std::map<std::string, Nanoseconds, std::less<>> execution_times;  // by callback
  std::map<std::string, Sending, std::less<>> sent;                 // by callback
  bool allocates = false;                                           // messages

  std::optional<Nanoseconds> execution_time(std::string_view callback) const;
  std::optional<Sending> sends(std::string_view callback) const;
};

/// The component `takt::Workload`. Each parameter is a list with one entry per entity. The first
/// list of each kind is required; the defaults of the others are in parentheses:
/// - publishers: topic, period_us, size_bytes (0), fixed_bytes (0: variable size, see size_bytes;
///   otherwise a loaned message of this size), fill_bytes (0; bytes written into each message),
///   work_us (0; CPU time before publishing), pass_by (loaned_msg, unique_ptr, shared_ptr),
///   depth (10), reliability (reliable), durability (volatile)
/// - subscriptions: topic, fixed_bytes (0; must equal that of the publishers), work_us (0),
///   pass_by (const_ref, shared_ptr, unique_ptr), depth (10), reliability (reliable),
///   durability (volatile)
/// - relays: input, output, work_us (0), size_bytes (0), depth (1). Entries with the same output
///   form one relay. When it has a message of each input, it works and publishes. A relay with one
///   input is a filter; with several it is a fusion, and the chains of all inputs continue.
/// - clients: service, period_us
/// - servers: service, work_us (0)
/// Each publisher and client has a timer `<topic>_timer`. Each relay has an exclusive callback
/// group `relay_<output>`; everything else is in the node's default group. Work is measured in CPU
/// time, so time while preempted does not count.
///
/// Thread safety: as Node. Real-time: yes with loaned_msg and const_ref, which allocate nothing;
/// unique_ptr and shared_ptr allocate each message.
class Workload : public Node, public KnowsExecutionTimes {
 public:
  explicit Workload(const NodeOptions& options);
  std::optional<Nanoseconds> execution_time(std::string_view callback) const override;
  bool uses_heap() const override { return entities_.allocates; }
  std::optional<Sending> sends(std::string_view callback) const override {
    return entities_.sends(callback);
  }

 private:
  const WorkloadEntities entities_;
};

/// The component `takt::LifecycleWorkload`: a Workload that is a lifecycle node. While it is not
/// active, it publishes nothing, its timers are stopped, and received messages wait. Its services
/// always respond.
///
/// Thread safety: as LifecycleNode. Real-time: as Workload.
class LifecycleWorkload : public LifecycleNode, public KnowsExecutionTimes {
 public:
  explicit LifecycleWorkload(const NodeOptions& options);
  std::optional<Nanoseconds> execution_time(std::string_view callback) const override;
  bool uses_heap() const override { return entities_.allocates; }
  std::optional<Sending> sends(std::string_view callback) const override {
    return entities_.sends(callback);
  }

 private:
  const WorkloadEntities entities_;
};

}  // namespace takt

#endif  // TAKT_COMPONENTS_WORKLOAD_HPP_
