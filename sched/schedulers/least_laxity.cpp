// The least laxity first (Mok: "Fundamental Design Problems of Distributed Systems for the
// Hard-Real-Time Environment", 1983): laxity is the time that a callback can still wait, its
// deadline less its budget less the time now. Now is the same for all that wait, and none has
// begun, so the order does not change while they wait. Equal ones run in order of arrival.
// SPDX-License-Identifier: Apache-2.0
#include "takt/sched/scheduler.hpp"

namespace takt {
namespace {

TimePoint latest_start(const ReadyCallback& callback) noexcept {
  return callback.deadline == kNever ? kNever : callback.deadline - callback.info->budget;
}

struct LessLaxity {
  bool operator()(const ReadyCallback& a, const ReadyCallback& b) const noexcept {
    const TimePoint first = latest_start(a), second = latest_start(b);
    return first != second ? first < second : a.sequence < b.sequence;
  }
};
using LeastLaxityScheduler = HeapScheduler<LessLaxity>;

std::optional<Nanoseconds> laxity(const CallbackInfo& info) {
  if (info.deadline == Nanoseconds::zero()) return {};
  return info.deadline - info.budget;
}

}  // namespace
TAKT_REGISTER_SCHEDULER("least_laxity", "the callback that can wait least, by deadline and budget",
                        LeastLaxityScheduler, .order = analysis::Order::by_point, .point = laxity)
}  // namespace takt
