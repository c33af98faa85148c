// Polling point by polling point; inside one, in the order of the executor's list, and then of
// registration: what rclc does (micro-ROS; Staschulat et al., "The rclc Executor: Domain-specific
// deterministic scheduling mechanisms for ROS applications on microcontrollers", EMSOFT 2020).
// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "takt/sched/keyed_heap.hpp"

namespace takt {
namespace {

struct ListedPlace {
  auto operator()(const ReadyCallback& callback) const noexcept {
    return std::pair(callback.window, callback.info->registration);
  }
};
using ListedScheduler = KeyedScheduler<ListedPlace>;

}  // namespace
TAKT_REGISTER_SCHEDULER("listed", "polling point, then the executor's list, then registration",
                        ListedScheduler, .uses_time = false, .order = analysis::Order::in_windows)
}  // namespace takt
