// The earliest end-to-end deadline first: that of the chain, counted from the release of the
// callback that began its instance. So all callbacks of an instance have one deadline, and its
// priority never changes: job-level fixed, as EDF of graphs has it (Saifullah et al.: "Parallel
// Real-Time Scheduling of DAGs", TPDS 2014; for ROS 2 Bell et al., arXiv 2512.16926). Callbacks
// without such a deadline come last; equal ones run in order of arrival.
// SPDX-License-Identifier: Apache-2.0
#include "takt/sched/scheduler.hpp"

namespace takt {
namespace {

struct EarlierDeadlineOfChain {
  static TimePoint deadline(const ReadyCallback& callback) noexcept {
    const Nanoseconds relative = callback.info->chain_deadline;
    return relative == Nanoseconds::zero() ? kNever : later(callback.root_ready_time, relative);
  }
  bool operator()(const ReadyCallback& a, const ReadyCallback& b) const noexcept {
    const TimePoint first = deadline(a), second = deadline(b);
    return first != second ? first < second : a.sequence < b.sequence;
  }
};
using ChainEdfScheduler = HeapScheduler<EarlierDeadlineOfChain>;

}  // namespace
TAKT_REGISTER_SCHEDULER("chain_edf", "earliest end-to-end deadline of a chain, then arrival",
                        ChainEdfScheduler)
}  // namespace takt
