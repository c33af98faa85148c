// PiCAS's order (Choi, Xiang, Kim: "PiCAS: New Design of Priority-Driven Chain-Aware Scheduling for
// ROS2", RTAS 2021): the more critical chain first, inside a chain the later callback first, so
// that an instance that has begun is finished before another begins. Callbacks of no chain come
// after all chains, by priority. Equal ones run in order of arrival.
// SPDX-License-Identifier: Apache-2.0
#include "takt/sched/scheduler.hpp"

namespace takt {
namespace {

struct MoreUrgentInChain {
  bool operator()(const ReadyCallback& a, const ReadyCallback& b) const noexcept {
    const CallbackInfo& first = *a.info;
    const CallbackInfo& second = *b.info;
    const bool first_in_chain = first.chain != kNoChain;
    const bool second_in_chain = second.chain != kNoChain;
    if (first_in_chain != second_in_chain) return first_in_chain;
    if (first.criticality != second.criticality) return first.criticality > second.criticality;
    if (first.priority != second.priority) return first.priority > second.priority;
    if (first.chain != second.chain) return first.chain < second.chain;
    if (first.chain_position != second.chain_position) {
      return first.chain_position > second.chain_position;
    }
    return a.sequence < b.sequence;
  }
};
using ChainPriorityScheduler = HeapScheduler<MoreUrgentInChain>;

}  // namespace
TAKT_REGISTER_SCHEDULER("chain_priority", "PiCAS: critical chains first, later callbacks first",
                        ChainPriorityScheduler, .uses_time = false,
                        .order = analysis::Order::by_urgency)
}  // namespace takt
