// A ring of the last executions on a thread, for a timeline.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_TRACE_RING_HPP_
#define TAKT_EXECUTORS_TRACE_RING_HPP_

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "takt/base/counter.hpp"
#include "takt/base/time.hpp"
#include "takt/base/visibility.hpp"
#include "takt/sched/scheduler.hpp"

namespace TAKT_PUBLIC takt {

/// One execution of a callback.
struct TraceEvent {
  CallbackId callback = 0;
  std::uint64_t sequence = 0;          // of the message or release
  std::uint64_t chain_instance = 0;    // the sequence of its chain's first release
  std::uint64_t path = 0;              // of the chain instance up to here, see extend_path
  std::uint64_t lost = 0;              // messages overwritten, or releases missed, since its last
  TimePoint ready{};                   // when it was published or, for timers, due
  TimePoint picked{}, start{}, end{};  // by a thread; of the callback
  Nanoseconds cpu_time{0};             // of the callback, without preemption
  bool has_waited = false;             // it gave up the CPU by itself: a lock, a sleep, a reply
};

// Limit: executions that a thread keeps for a timeline; they take 6 MB. At it: the oldest goes.
// Seen: `overwritten` of the trace.
inline constexpr std::size_t kMostTraceEvents = 65'536;

/// The last executions on one thread, while a trace is on: when the ring is full, the oldest are
/// overwritten.
/// Thread safety: one thread records, another one (the reader) does the rest, also at the same
/// time. The ring is a seqlock: the reader drops events that the writer may have overwritten
/// meanwhile:
/// 1. The writer counts the event as begun, stores its words, each as a release, and counts it.
/// 2. The reader loads the words, each as an acquire, then how many have begun: if it has seen a
///    word of a later event, it also sees that this event has begun.
/// Real-time: recording stores 88 bytes; nothing allocates but begin().
class TraceRing {
 public:
  /// Begins, unless the room is 0.
  explicit TraceRing(std::size_t capacity = 0) {
    if (capacity != 0) begin(capacity);
  }

  /// From now on is_on(), with room for `capacity` events, rounded up to a power of two. The first
  /// call allocates the room, which never changes. Earlier events are forgotten.
  void begin(std::size_t capacity) {
    if (slots_.empty()) slots_ = std::vector<Slot>(std::bit_ceil(capacity));
    first_ = count_;
    is_on_.store(true, std::memory_order_release);  // pairs with is_on()
  }
  void end() noexcept { is_on_.store(false); }

  /// For the thread that records. Acquire: pairs with begin(), which has allocated the room.
  bool is_on() const noexcept { return is_on_.load(std::memory_order_acquire); }
  /// For the thread that records, if the ring is on, or was when the execution began.
  void record(const TraceEvent& event) noexcept {
    std::array<std::uint64_t, kWords> words{};
    std::memcpy(words.data(), &event, sizeof(event));
    const std::uint64_t count = count_.own();
    begun_ = count + 1;
    Slot& slot = slots_[count & (slots_.size() - 1)];
    for (std::size_t i = 0; i < kWords; ++i) slot[i].publish(words[i]);
    count_.publish(count + 1);
  }

  /// How many events were overwritten since it began.
  std::size_t overwritten() const noexcept {
    const std::uint64_t count = count_ - first_;
    return count > slots_.size() ? count - slots_.size() : 0;
  }
  /// From the oldest to the newest.
  std::vector<TraceEvent> events() const {
    std::vector<TraceEvent> result;
    const std::uint64_t end = count_;
    const std::uint64_t begin = end - std::min<std::uint64_t>(end - first_, slots_.size());
    for (std::uint64_t i = begin; i < end; ++i) {
      std::array<std::uint64_t, kWords> words;
      const Slot& slot = slots_[i & (slots_.size() - 1)];
      for (std::size_t word = 0; word < kWords; ++word) words[word] = slot[word];
      result.push_back(std::bit_cast<TraceEvent>(words));
    }
    const std::uint64_t begun = begun_;
    const std::uint64_t gone = begun - begin > slots_.size() ? begun - begin - slots_.size() : 0;
    result.erase(result.begin(), result.begin() + static_cast<std::ptrdiff_t>(
                                                      std::min<std::uint64_t>(gone, end - begin)));
    return result;
  }

 private:
  static constexpr std::size_t kWords = sizeof(TraceEvent) / sizeof(std::uint64_t);
  static_assert(kWords * sizeof(std::uint64_t) == sizeof(TraceEvent));
  using Slot = std::array<Counter<>, kWords>;

  std::vector<Slot> slots_;
  Counter<> begun_, count_;  // of the events whose recording has begun, and ended
  std::atomic<bool> is_on_{false};
  std::uint64_t first_ = 0;  // the count when it began
};

}  // namespace takt

#endif  // TAKT_EXECUTORS_TRACE_RING_HPP_
