// Polling point by polling point; inside one, in the order of the executor's list, and then of
// registration: what rclc does (micro-ROS; Staschulat et al., "The rclc Executor: Domain-specific
// deterministic scheduling mechanisms for ROS applications on microcontrollers", EMSOFT 2020).
// SPDX-License-Identifier: Apache-2.0
#include <tuple>

#include "takt/sched/scheduler.hpp"

namespace takt {
namespace {

struct ListedOrder {
  bool operator()(const ReadyCallback& a, const ReadyCallback& b) const noexcept {
    return std::tie(a.window, a.info->registration) < std::tie(b.window, b.info->registration);
  }
};
using ListedScheduler = HeapScheduler<ListedOrder>;

}  // namespace
TAKT_REGISTER_SCHEDULER("listed", "polling point, then the executor's list, then registration",
                        ListedScheduler, .uses_time = false, .order = analysis::Order::in_windows)
}  // namespace takt
