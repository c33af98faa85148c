// Nodes that do what their parameters say: publish, receive, and use the CPU.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_COMPONENTS_WORKLOAD_HPP_
#define TAKT_COMPONENTS_WORKLOAD_HPP_

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "takt/nodes/lifecycle_node.hpp"

namespace takt {

/// What workload nodes send: a header and so many bytes.
struct WorkloadMessage {
  std::uint64_t tracking_number = 0;
  std::vector<std::byte> data;
};
TAKT_MESSAGE(WorkloadMessage, "takt/msg/Workload", tracking_number, data);

/// The same with a fixed size, which may go by shared memory: so many bytes in all.
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

/// What workload clients ask.
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

/// The component `takt::Workload`. Its parameters are lists, one entry for each publisher or
/// subscription; lists but the first of each kind may be left out:
/// - publishers: topic, period_us, size_bytes (0), fixed_bytes (0: a message of variable size, with
///   size_bytes; else one of that size, which is lent), fill_bytes (0: so many are written each
///   time), work_us (0: CPU time before publishing), pass_by (loaned_msg, unique_ptr, shared_ptr),
///   depth (10), reliability (reliable), durability (volatile)
/// - subscriptions: topic, fixed_bytes (0: as its publishers), work_us (0),
///   pass_by (const_ref, shared_ptr, unique_ptr), depth (10), reliability (reliable),
///   durability (volatile)
/// - relays: input, output, work_us (0), size_bytes (0), depth (1). Entries with the same
///   output are one relay: when each of its inputs has brought a message, it works and publishes.
///   With one input that is a filter, with several a fusion, in which the chains of all inputs go
///   on.
/// - clients: service, period_us
/// - servers: service, work_us (0)
/// Each publisher and each client has a timer of its own, `<topic>_timer`, each relay an exclusive
/// callback group of its own, `relay_<output>`, and everything else the node's default group.
/// Work is CPU time, so being preempted is not work done.
///
/// Thread safety and real-time: loans and const_ref allocate nothing; unique_ptr and shared_ptr
/// allocate as their user does.
class Workload : public Node {
 public:
  explicit Workload(const NodeOptions& options);

 private:
  const std::vector<std::shared_ptr<void>> entities_;
};

/// The component `takt::LifecycleWorkload`: the same, and while the node is not active it publishes
/// nothing, its timers rest, and what arrives waits. Its services always answer.
///
/// Thread safety and real-time: as Workload and LifecycleNode.
class LifecycleWorkload : public LifecycleNode {
 public:
  explicit LifecycleWorkload(const NodeOptions& options);

 private:
  const std::vector<std::shared_ptr<void>> entities_;
};

}  // namespace takt

#endif  // TAKT_COMPONENTS_WORKLOAD_HPP_
