// What the other callbacks of a pool can run while one of them waits. Bertogna, Cirinei, Lipari:
// "Schedulability Analysis of Global Scheduling Algorithms on Multiprocessor Platforms" (TPDS
// 2009), and its iteration over responses (Bertogna, Cirinei, RTSS 2007). Our own: callbacks are
// not preempted, and exclude each other by groups. At each instant at which a callback waits,
// either one of its group runs, or all threads run others: so the work of the others counts by the
// number of threads. What is there already when it arrives, arrived within its own response.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <functional>
#include <vector>

#include <fmt/format.h>

#include "takt/analysis/method.hpp"

namespace takt::analysis {
namespace {

class Workload final : public Method {
 public:
  Answer bound(const Path& path) const override {
    const Part& part = path.part;
    if (part.executor.threads == 1) return Answer::none("one thread");
    const Waiting waiting(part, path.last());
    const auto threads = static_cast<Count>(part.executor.threads);
    // The least time at which nothing can keep it waiting any longer.
    const Time begins = least_fixed_point(
        [&](Time window) {
          const Time shared = waiting.of_others(window) / threads;
          return plus(plus(waiting.of_group(window), shared), 1);
        },
        part.limit);
    if (begins >= kUnbounded) return Answer::none(part.why_overloaded());
    const Callback& last = part.at(path.last());
    // While it waits no thread goes to sleep: so each wakes up once, one after the other.
    const Time waking = times(part.system.overheads.wake, threads - 1);
    const Time response = plus(plus(begins - 1, last.execution), waking);
    std::vector<Term> terms;
    if (part.explains) {
      terms = {{fmt::format("others of the group of '{}'", last.name), waiting.of_group(begins)},
               {fmt::format("the others, by {} threads", threads),
                begins - 1 - waiting.of_group(begins)},
               {"the other threads wake up", waking},
               {fmt::format("'{}'", last.name), last.execution}};
    }
    return with_what_precedes(path, response, std::move(terms));
  }

 private:
  /// What may run from when the callback becomes ready until it begins.
  class Waiting {
   public:
    Waiting(const Part& part, std::size_t callback) : part_(part), callback_(callback) {
      const auto is_other_group = [&](std::size_t other) {
        return other == callback || part.at(other).group != part.at(callback).group;
      };
      knows_order_ = !part.executor.is_wait_set && earlier() == 0 &&
                     std::all_of(part.callbacks.begin(), part.callbacks.end(), is_other_group);
    }

    Time of_group(Time window) const {
      Time result = times(part_.at(callback_).execution, earlier());
      for (const std::size_t other : part_.callbacks) {
        if (other == callback_ || part_.at(other).group != part_.at(callback_).group) continue;
        result = plus(result, work_of(other, window, window));
      }
      return result;
    }
    Time of_others(Time window) const {
      Time result = 0;
      std::vector<Time> less_urgent;
      // A timer has its place in the order of arrival only when a thread has looked at the clock.
      const bool is_by_arrival = knows_order_ && part_.executor.order == Order::by_arrival &&
                                 !part_.at(callback_).is_timer;
      for (const std::size_t other : part_.callbacks) {
        const Callback& described = part_.at(other);
        if (described.group == part_.at(callback_).group) continue;
        if (knows_order_ && part_.executor.order == Order::by_urgency &&
            described.urgency < part_.at(callback_).urgency) {
          less_urgent.push_back(described.execution);
          continue;
        }
        result = plus(result, work_of(other, is_by_arrival ? 1 : window, window));
      }
      // Of these, each thread runs one when it arrives.
      std::sort(less_urgent.begin(), less_urgent.end(), std::greater<>());
      less_urgent.resize(std::min(less_urgent.size(), part_.executor.threads));
      for (const Time execution : less_urgent) result = plus(result, execution);
      return result;
    }

   private:
    /// From when an execution may begin, and until when it has ended.
    Time response(std::size_t source, std::size_t callback) const {
      const Span& span = part_.spans[source].at(callback);
      return between(span.earliest_release, span.latest_end);
    }
    /// Its own executions that are not over when it arrives.
    Count earlier() const {
      Count result = -1;
      for (std::size_t source = 0; source < part_.sources.size(); ++source) {
        const Count count =
            times(part_.executions(source, callback_), part_.sources[source].messages);
        if (count == 0) continue;
        const Time since = std::max<Time>(1, response(source, callback_));
        result = plus(result, times(count, part_.sources[source].curve.most(since)));
      }
      return result;
    }
    /// What it executes in the window, of arrivals that are not over when that begins, or come
    /// until then. The first of them ends in time, and the last does not begin before it arrives.
    Time work_of(std::size_t callback, Time until, Time window) const {
      Time result = 0;
      for (std::size_t source = 0; source < part_.sources.size(); ++source) {
        const Count count =
            times(part_.executions(source, callback), part_.sources[source].messages);
        if (count == 0) continue;
        const ArrivalCurve& curve = part_.sources[source].curve;
        const Time before = response(source, callback), each = part_.at(callback).execution;
        const Count arrivals = curve.most(std::max<Time>(1, plus(until, before)));
        Time work = times(times(count, arrivals), each);
        if (count == 1 && arrivals > 1) {
          const Time ends = plus(window, before) - curve.least_distance(arrivals);
          const Time both = std::clamp<Time>(ends, each, times(2, each));
          work = plus(times(arrivals - 2, each), both);
        }
        result = plus(result, work);
      }
      return result;
    }

    const Part& part_;
    const std::size_t callback_;
    bool knows_order_ = false;
  };
};

}  // namespace
TAKT_REGISTER_METHOD(
    "workload", "what several threads can run while a callback waits", Workload,
    .assumes = "several threads with a CPU each; no logical execution time",
    .source = "Bertogna, Cirinei, Lipari, TPDS 2009; groups and no preemption: our own")
}  // namespace takt::analysis
