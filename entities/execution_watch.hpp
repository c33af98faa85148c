// What an analysis took for granted of the executions of a callback, and what was seen instead.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_EXECUTION_WATCH_HPP_
#define TAKT_ENTITIES_EXECUTION_WATCH_HPP_

#include <array>
#include <cstddef>
#include <vector>

#include "takt/base/counter.hpp"
#include "takt/base/time.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

/// Of one callback, by `takt run --watch-bounds`.
/// Thread safety: check() from one thread at a time, seen() from any.
/// Real-time: check() neither blocks nor allocates.
class ExecutionWatch {
 public:
  /// Zero, or empty: nobody knows it, and nothing is compared.
  struct Limits {
    Nanoseconds execution{0};            // processor time
    Nanoseconds bound{0};                // from its arrival to its end
    std::vector<Nanoseconds> distances;  // from the first of 2, 3, … arrivals to the last, at least
    /// Of any n arrivals in a row the last comes (n - 1) · `period` after the first, less `jitter`.
    Nanoseconds period{0}, jitter{0};
  };
  enum class Kind { execution, bound, arrivals };
  static constexpr std::size_t kKinds = 3;
  struct Seen {
    std::uint64_t count = 0;  // how often it was beyond its limit
    Nanoseconds worst{0};     // of arrivals the least distance, else the longest time
    Nanoseconds limit{0};
  };

  explicit ExecutionWatch(Limits limits)
      : limits_(std::move(limits)), arrivals_(limits_.distances.size(), TimePoint{}) {}

  /// Whether an execution that took so long may have used too much processor time: only then
  /// somebody need read that.
  bool may_be_too_long(Nanoseconds wall) const noexcept {
    return limits_.execution != Nanoseconds::zero() && wall > limits_.execution;
  }
  /// An execution has ended. `ready`: {} if that is not known.
  void check(TimePoint ready, TimePoint end, Nanoseconds used) noexcept {
    if (limits_.execution != Nanoseconds::zero() && used > limits_.execution) {
      count(Kind::execution, used, limits_.execution);
    }
    if (ready == TimePoint{}) return;
    if (limits_.bound != Nanoseconds::zero() && end - ready > limits_.bound) {
      count(Kind::bound, end - ready, limits_.bound);
    }
    check_arrival(ready);
    check_pace(ready);
  }
  Seen seen(Kind kind) const noexcept {
    const Counts& counts = counts_[static_cast<std::size_t>(kind)];
    const std::uint64_t count = counts.count.load();
    return {count, Nanoseconds(counts.worst_ns.load()), Nanoseconds(counts.limit_ns.load())};
  }

 private:
  struct Counts {
    Counter<> count;
    Counter<std::int64_t> worst_ns, limit_ns;
  };

  void count(Kind kind, Nanoseconds seen, Nanoseconds limit) noexcept {
    Counts& counts = counts_[static_cast<std::size_t>(kind)];
    const std::int64_t beyond =
        kind == Kind::arrivals ? limit.count() - seen.count() : seen.count() - limit.count();
    const std::int64_t worst = kind == Kind::arrivals
                                   ? counts.limit_ns.own() - counts.worst_ns.own()
                                   : counts.worst_ns.own() - counts.limit_ns.own();
    if (counts.count.own() == 0 || beyond > worst) {
      counts.worst_ns = seen.count();
      counts.limit_ns = limit.count();
    }
    counts.count.publish(counts.count.own() + 1);
  }

  // The last arrivals are a ring; what was overwritten before it was served is none of them.
  void check_arrival(TimePoint ready) noexcept {
    const std::size_t size = arrivals_.size();
    Nanoseconds worst{0}, seen{0}, limit{0};
    for (std::size_t i = 0; i < size; ++i) {
      const TimePoint before = arrivals_[(next_ + size - 1 - i) % size];
      if (before == TimePoint{}) break;
      const Nanoseconds too_early = limits_.distances[i] - (ready - before);
      if (too_early <= worst) continue;
      worst = too_early;
      seen = ready - before;
      limit = limits_.distances[i];
    }
    if (worst > Nanoseconds::zero()) count(Kind::arrivals, seen, limit);
    if (size == 0) return;
    arrivals_[next_] = ready;
    next_ = (next_ + 1) % size;
  }

  // With `due_` as the latest instant at which this one comes if all before did at the pace: as the
  // generic cell rate algorithm (ITU-T I.371) it finds any window that has too many.
  void check_pace(TimePoint ready) noexcept {
    if (limits_.period == Nanoseconds::zero()) return;
    if (ready >= due_) first_ = due_ = ready;
    const Nanoseconds limit = due_ - first_ - limits_.jitter;
    if (ready - first_ < limit) count(Kind::arrivals, ready - first_, limit);
    due_ = later(due_, limits_.period);
  }

  const Limits limits_;
  std::array<Counts, kKinds> counts_;
  std::vector<TimePoint> arrivals_;
  std::size_t next_ = 0;
  TimePoint first_{}, due_{};  // the first of those that came faster than their pace
};

}  // namespace takt

#endif  // TAKT_ENTITIES_EXECUTION_WATCH_HPP_
