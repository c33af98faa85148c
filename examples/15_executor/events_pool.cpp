// An executor and its scheduler: every event at once, and what is ready for the longest time first.
// SPDX-License-Identifier: Apache-2.0
#include <tuple>

#include "takt/executors/executor.hpp"

struct LongestWaiting {
  bool operator()(const takt::ReadyCallback& a, const takt::ReadyCallback& b) const noexcept {
    return std::tie(a.ready_time, a.sequence) < std::tie(b.ready_time, b.sequence);
  }
};
TAKT_REGISTER_SCHEDULER("longest_waiting", "ready for the longest time first",
                        takt::HeapScheduler<LongestWaiting>)
TAKT_REGISTER_EXECUTOR("events_pool", "every event at once, for a pool of threads",
                       .readiness = takt::Readiness::events, .scheduler = "longest_waiting",
                       .max_threads = 4, .pool = true)
