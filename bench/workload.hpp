// A node that does what its parameters say: publish, receive, and use the CPU.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BENCH_WORKLOAD_HPP_
#define TAKT_BENCH_WORKLOAD_HPP_

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "takt/entities/node.hpp"

namespace takt {

/// What workload nodes send: a header and so many bytes.
struct WorkloadMessage {
  std::uint64_t tracking_number = 0;
  std::vector<std::byte> data;
};
TAKT_MESSAGE(WorkloadMessage, "takt/msg/Workload", tracking_number, data);

/// The component `takt::Workload`. Its parameters are lists, one entry for each publisher or
/// subscription; lists but the first of each kind may be left out:
/// - publishers: topic, period_us, size_bytes (0), work_us (0: CPU time before publishing),
///   pass_by (loaned_msg, unique_ptr, shared_ptr), depth (10), reliability (reliable)
/// - subscriptions: topic, work_us (0), pass_by (const_ref, shared_ptr, unique_ptr), depth (10),
///   reliability (reliable)
/// Each publisher has a timer of its own, `<topic>_timer`, and each entity a callback group
/// of the node's default kind. Work is CPU time, so being preempted is not work done.
///
/// Thread safety and real-time: loans and const_ref allocate nothing; unique_ptr and shared_ptr
/// allocate as their user does.
class Workload : public Node {
 public:
  explicit Workload(const NodeOptions& options);

 private:
  struct Publishing;
  struct Subscribing;
  void add_publisher(const Publishing& publishing);
  void add_subscription(const Subscribing& subscribing);

  std::vector<std::shared_ptr<void>> entities_;
};

}  // namespace takt

#endif  // TAKT_BENCH_WORKLOAD_HPP_
