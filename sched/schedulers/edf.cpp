// The earliest deadline first (Liu, Layland: "Scheduling Algorithms for Multiprogramming in a
// Hard-Real-Time Environment", JACM 1973); on one thread without preemption as Jeffay, Stanat and
// Martel analyse it (RTSS 1991). A callback without a deadline comes last; equal ones run in
// order of arrival.
// SPDX-License-Identifier: Apache-2.0
#include "takt/sched/scheduler.hpp"

namespace takt {
namespace {

struct EarlierDeadline {
  bool operator()(const ReadyCallback& a, const ReadyCallback& b) const noexcept {
    return a.deadline != b.deadline ? a.deadline < b.deadline : a.sequence < b.sequence;
  }
};
using EdfScheduler = HeapScheduler<EarlierDeadline>;

std::optional<Nanoseconds> deadline(const CallbackInfo& info) {
  if (info.deadline == Nanoseconds::zero()) return {};
  return info.deadline;
}

}  // namespace
TAKT_REGISTER_SCHEDULER("edf", "earliest deadline first, then order of arrival", EdfScheduler,
                        .order = analysis::Order::by_point, .point = deadline)
}  // namespace takt
