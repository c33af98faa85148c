// The order of rclcpp: polling points in order; inside one, timers, subscriptions,
// services, clients, waitables, each kind in order of registration. The model is that of Casini
// et al., "Response-Time Analysis of ROS 2 Processing Chains" (ECRTS 2019). That the window comes
// first keeps parked callbacks from losing to every later snapshot, the starvation shown by Teper
// et al. (EMSOFT 2024) for rclcpp's multi-threaded executor.
// SPDX-License-Identifier: Apache-2.0
#include <tuple>

#include "takt/sched/scheduler.hpp"

namespace takt {
namespace {

struct RosOrder {
  bool operator()(const ReadyCallback& a, const ReadyCallback& b) const noexcept {
    return std::tie(a.window, a.info->kind, a.info->registration) <
           std::tie(b.window, b.info->kind, b.info->registration);
  }
};
using RosScheduler = HeapScheduler<RosOrder>;

}  // namespace
TAKT_REGISTER_SCHEDULER("ros", "rclcpp's order: polling point, kind, registration", RosScheduler,
                        .uses_time = false, .order = analysis::Order::in_windows)
}  // namespace takt
