// Non-preemptive deadlines, and what is like them: the callback with the least point in time runs
// next, which is its ready time and something that does not change: its relative deadline (edf),
// that less its budget (least_laxity), nothing (fifo). George, Rivierre, Spuri: "Preemptive and
// Non-Preemptive Real-Time Uniprocessor Scheduling" (1996), for deadlines; that laxity and order of
// arrival are such points is our own reading.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "takt/analysis/method.hpp"

namespace takt::analysis {
namespace {

class Points final : public Method {
 public:
  Answer bound(const Path& path) const override {
    const Part& part = path.part;
    const Order order = part.executor.order;
    if (part.executor.threads != 1) return Answer::none("several threads");
    if (part.executor.is_wait_set) return Answer::none("a snapshot runs whole, whatever arrives");
    if (order != Order::by_point && order != Order::by_arrival) {
      return Answer::none("no order by deadline, laxity or arrival");
    }
    if (!part.supply.is_dedicated()) return Answer::none("the CPU is not the thread's own");
    if (point(part, path.last()) >= kUnbounded) return Answer::none("it has no deadline");

    std::vector<Term> terms;
    const Time response = response_of(part, path.last(), terms);
    return with_what_precedes(path, response, std::move(terms));
  }

 private:
  /// Callbacks that come together and have the same point.
  struct Other {
    Time execution, longest;  // of all together, of one
    Time point, overtaking;
    std::vector<Part::Inner> arrivals;

    auto kind() const { return std::tie(point, overtaking, arrivals); }
  };

  static Time point(const Part& part, std::size_t callback) {
    return part.executor.order == Order::by_arrival ? 0 : part.at(callback).point;
  }

  static std::vector<Other> others_of(const Part& part, std::size_t callback) {
    std::vector<Other> others;
    const Time longest = part.longest();
    for (const std::size_t other : part.callbacks) {
      if (other == callback) continue;
      // Where arrivals are numbered, a message that is sent before the executor has looked at its
      // timers overtakes one that is due already.
      const bool overtakes = part.executor.order == Order::by_arrival &&
                             part.at(callback).is_timer && !part.at(other).is_timer;
      const Time execution = part.at(other).execution;
      others.push_back({execution, execution, point(part, other), overtakes ? longest - 1 : 0,
                        part.inner_arrivals(other)});
    }
    return together(std::move(others));
  }

  // Many timers have few periods.
  static std::vector<Other> together(std::vector<Other> others) {
    std::sort(others.begin(), others.end(),
              [](const Other& a, const Other& b) { return a.kind() < b.kind(); });
    std::vector<Other> result;
    for (Other& other : others) {
      if (result.empty() || result.back().kind() != other.kind()) {
        result.push_back(std::move(other));
        continue;
      }
      result.back().execution = plus(result.back().execution, other.execution);
      result.back().longest = std::max(result.back().longest, other.longest);
    }
    return result;
  }

  // By what has begun, and has a later point in time.
  static Time blocked(const Part& part, const std::vector<Other>& others, Time point) {
    Time longest = 0;
    for (const Other& other : others) {
      if (other.point > point) longest = std::max(longest, part.blocking(other.longest));
    }
    return longest;
  }

  // Of one callback, from its own arrival.
  static Time response_of(const Part& part, std::size_t callback, std::vector<Term>& terms) {
    const Callback& own = part.at(callback);
    const Time own_point = point(part, callback);
    const Time longest = part.longest();
    const std::vector<Other> others = others_of(part, callback);
    const auto arrivals = part.inner_arrivals(callback);
    const Time busy = least_fixed_point(
        [&](Time window) {
          Time work = plus(part.blocking(longest), times(own.execution, most(arrivals, window)));
          for (const Other& other : others) {
            work = plus(work, times(other.execution, most(other.arrivals, window)));
          }
          return work;
        },
        part.limit);
    if (busy >= kUnbounded) return kUnbounded;

    std::vector<Time> offsets = steps(arrivals, busy);
    for (const Other& other : others) {
      if (other.point >= kUnbounded) continue;
      const Time shift = other.point - own_point - other.overtaking;
      for (const Time step : steps(other.arrivals, busy - shift, -shift)) {
        if (step + shift >= 0) offsets.push_back(step + shift);
      }
    }
    std::sort(offsets.begin(), offsets.end());
    offsets.erase(std::unique(offsets.begin(), offsets.end()), offsets.end());
    const auto blocking = [&](Time offset) { return blocked(part, others, own_point + offset); };
    // Before its own last execution.
    const auto work = [&](Time offset, Time window) {
      Time sum = times(own.execution, most(arrivals, offset + 1)) - (own.execution - 1);
      for (const Other& other : others) {
        if (other.point >= kUnbounded) continue;
        const Time before =
            std::max(Time{0}, offset + 1 + own_point - other.point + other.overtaking);
        sum = plus(sum, times(other.execution, most(other.arrivals, std::min(window, before))));
      }
      return sum;
    };
    Time worst = 0, worst_offset = 0;
    for (const Time offset : offsets) {
      const Time begins = least_fixed_point(
          [&](Time window) { return plus(blocking(offset), work(offset, window)); }, part.limit);
      const Time response = std::max(Time{0}, begins - offset) + own.execution - 1;
      if (response > worst) worst_offset = offset;
      worst = std::max(worst, response);
    }
    if (part.explains) {
      const Time mine = times(own.execution, most(arrivals, worst_offset + 1));
      terms = {{"a callback with a later point in time that has begun", blocking(worst_offset)},
               {fmt::format("{} × itself", most(arrivals, worst_offset + 1)), mine},
               {"callbacks with an earlier point in time",
                std::max(Time{0}, worst + worst_offset - blocking(worst_offset) - mine)}};
      part.finish(terms, worst, worst_offset);
    }
    return worst;
  }
};

}  // namespace
TAKT_REGISTER_METHOD("points", "non-preemptive earliest deadline first, least laxity or arrival",
                     Points,
                     .assumes =
                         "one thread with a CPU of its own; no polling points; the least "
                         "point in time first",
                     .source = "George, Rivierre, Spuri, 1996; for laxity and arrival: our own")
}  // namespace takt::analysis
