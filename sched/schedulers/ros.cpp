// The order of rclcpp: polling points in order; inside one, timers, subscriptions,
// services, clients, waitables, each kind in order of registration. The model is that of Casini
// et al., "Response-Time Analysis of ROS 2 Processing Chains" (ECRTS 2019). That the window comes
// first keeps parked callbacks from losing to every later snapshot, the starvation shown by Teper
// et al. (EMSOFT 2024) for rclcpp's multi-threaded executor.
// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "takt/sched/keyed_heap.hpp"

namespace takt {
namespace {

struct RosPlace {
  auto operator()(const ReadyCallback& callback) const noexcept {
    const CallbackInfo& info = *callback.info;
    const auto kind = static_cast<std::uint64_t>(info.kind);
    return std::pair(callback.window, kind << 32 | info.registration);
  }
};
using RosScheduler = KeyedScheduler<RosPlace>;

}  // namespace
TAKT_REGISTER_SCHEDULER("ros", "rclcpp's order: polling point, kind, registration", RosScheduler,
                        .uses_time = false, .order = analysis::Order::in_windows)
}  // namespace takt
