// The callback with the largest priority first; equal ones in order of arrival.
// SPDX-License-Identifier: Apache-2.0
#include "takt/sched/scheduler.hpp"

namespace takt {
namespace {

struct MoreUrgent {
  bool operator()(const ReadyCallback& a, const ReadyCallback& b) const noexcept {
    if (a.info->priority != b.info->priority) return a.info->priority > b.info->priority;
    return a.sequence < b.sequence;
  }
};
using FixedPriorityScheduler = HeapScheduler<MoreUrgent>;

}  // namespace
TAKT_REGISTER_SCHEDULER("fixed_priority", "largest priority first, then order of arrival",
                        FixedPriorityScheduler, .uses_time = false,
                        .order = analysis::Order::by_urgency)
}  // namespace takt
