// What ran when, for a timeline.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_TRACE_RING_HPP_
#define TAKT_EXECUTORS_TRACE_RING_HPP_

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "takt/base/time.hpp"
#include "takt/base/visibility.hpp"
#include "takt/sched/scheduler.hpp"

namespace TAKT_PUBLIC takt {

/// One execution of a callback.
struct TraceEvent {
  CallbackId callback = 0;
  std::uint64_t sequence = 0;          // of what it was called for
  std::uint64_t chain_instance = 0;    // the sequence of its chain's first release
  std::uint64_t path = 0;              // of the chain instance up to here, see extend_path
  std::uint64_t lost = 0;              // messages overwritten, or releases missed, since its last
  TimePoint ready{};                   // published, or for timers due
  TimePoint picked{}, start{}, end{};  // by a thread; of the callback
  Nanoseconds cpu_time{0};             // of the callback: without what ran instead of it
  bool has_waited = false;             // it gave up the CPU by itself: a lock, a sleep, a reply
};

/// The last executions on one thread: when it is full, the oldest are overwritten.
/// Thread safety: one writer; read it when the writer has ended.
/// Real-time: recording stores 88 bytes; nothing allocates after construction.
class TraceRing {
 public:
  /// Room for so many, rounded up to a power of two.
  explicit TraceRing(std::size_t capacity)
      : events_(std::bit_ceil(std::max<std::size_t>(capacity, 1))) {}

  void record(const TraceEvent& event) noexcept {
    events_[count_++ & (events_.size() - 1)] = event;
  }

  std::size_t overwritten() const noexcept {
    return count_ > events_.size() ? count_ - events_.size() : 0;
  }
  /// From the oldest to the newest.
  std::vector<TraceEvent> events() const {
    std::vector<TraceEvent> result;
    for (std::size_t i = overwritten(); i < count_; ++i) {
      result.push_back(events_[i & (events_.size() - 1)]);
    }
    return result;
  }

 private:
  std::vector<TraceEvent> events_;
  std::size_t count_ = 0;
};

}  // namespace takt

#endif  // TAKT_EXECUTORS_TRACE_RING_HPP_
