// The more critical chain first; of equally critical ones, the instance that began first: a fixed
// priority for each instance of a chain, or of a graph whose chains are equally critical, as
// schedulers of graphs on one CPU have it (for ROS 2 Bell et al., arXiv 2512.16926). Where
// `chain_priority` prefers the later callback of a chain, this one prefers the earlier instance,
// through whichever branch it has come. Callbacks of no chain come after all chains, by priority.
// Equal ones run in order of arrival.
// SPDX-License-Identifier: Apache-2.0
#include "takt/sched/scheduler.hpp"

namespace takt {
namespace {

struct MoreUrgentJob {
  bool operator()(const ReadyCallback& a, const ReadyCallback& b) const noexcept {
    const CallbackInfo& first = *a.info;
    const CallbackInfo& second = *b.info;
    const bool first_in_chain = first.chain != kNoChain;
    const bool second_in_chain = second.chain != kNoChain;
    if (first_in_chain != second_in_chain) return first_in_chain;
    if (first.criticality != second.criticality) return first.criticality > second.criticality;
    if (!first_in_chain) {
      if (first.priority != second.priority) return first.priority > second.priority;
    } else if (a.root_ready_time != b.root_ready_time) {
      return a.root_ready_time < b.root_ready_time;
    }
    return a.sequence < b.sequence;
  }
};
using JobPriorityScheduler = HeapScheduler<MoreUrgentJob>;

}  // namespace
TAKT_REGISTER_SCHEDULER("job_priority", "critical chains first, of one chain the earlier instance",
                        JobPriorityScheduler, .order = analysis::Order::by_urgency)
}  // namespace takt
