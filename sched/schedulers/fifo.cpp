// First come, first served: the order in which messages were published and timers came due.
// SPDX-License-Identifier: Apache-2.0
#include "takt/sched/scheduler.hpp"

namespace takt {
namespace {

struct EarlierArrival {
  bool operator()(const ReadyCallback& a, const ReadyCallback& b) const noexcept {
    return a.sequence < b.sequence;
  }
};
using FifoScheduler = HeapScheduler<EarlierArrival>;

}  // namespace
TAKT_REGISTER_SCHEDULER("fifo", "order of arrival", FifoScheduler, .uses_time = false,
                        .order = analysis::Order::by_arrival)
}  // namespace takt
