// Non-preemptive fixed priorities for a path of callbacks: Davis et al., "Controller Area Network
// (CAN) schedulability analysis: Refuted, revisited and revised" (2007), whose busy window is that
// of one callback. For a path it is that of its least urgent callback: meanwhile no less urgent one
// begins, as what a callback sends is ready before the callback returns. PiCAS (Choi et al., RTAS
// 2021) is the special case in which later callbacks are more urgent. The path form is our own.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "takt/analysis/method.hpp"

namespace takt::analysis {
namespace {

class Urgency final : public Method {
 public:
  Answer bound(const Path& path) const override {
    const Part& part = path.part;
    if (const char* const why_not = why_it_fails(path); why_not != nullptr)
      return Answer::none(why_not);
    const Level level(path);
    const Source& own = part.sources[path.source];
    const Callback& last = part.at(path.last());
    // Then no callback of a later instance overtakes this one.
    const bool grows = std::adjacent_find(path.callbacks.begin(), path.callbacks.end(),
                                          [&](std::size_t a, std::size_t b) {
                                            return part.at(a).urgency >= part.at(b).urgency;
                                          }) == path.callbacks.end();
    const Time whole = level.of_path();
    const Time each =
        grows
            ? whole
            : times(times(last.execution, part.executions(path.source, path.last())), own.messages);
    const Time before = level.blocking();
    // What has to be executed before the last callback begins, but for its own execution.
    const auto pending = [&](Time offset, Time window) {
      const Time mine = plus(times(each, own.curve.most(offset + 1)),
                             times(whole - each, own.curve.most(window)));
      return plus(plus(before, mine), level.interference(window));
    };
    const auto time_for = [&](Time work, Time at_least = 0) {
      return part.supply.time_for(work, part.limit, at_least);
    };
    Time supplied = 0;  // in a longer window no less
    const Time busy = least_fixed_point(
        [&](Time window) {
          const Time mine = plus(before, times(whole, own.curve.most(window)));
          return supplied = time_for(plus(mine, level.interference(window)), supplied);
        },
        part.limit);
    if (busy >= kUnbounded) return Answer::none("more urgent callbacks leave nearly no time");
    // What arrives later begins and ends no earlier, so each search goes on from the one before.
    Time longest = 0, worst = 0, begins = 1, until_begin = 0, until_end = 0;
    for (const Time offset : own.curve.steps(busy)) {
      begins = least_fixed_point(
          [&](Time window) {
            const Time work = pending(offset, window) - (last.execution - 1);
            return until_begin = time_for(work, until_begin);
          },
          part.limit, begins);
      if (begins >= kUnbounded) return Answer::none("the response is longer than the limit");
      until_end = time_for(pending(offset, begins), until_end);
      const Time response = until_end - offset;
      if (response > longest) worst = offset;
      longest = std::max(longest, response);
    }
    std::vector<Term> terms;
    if (part.explains) {
      begins = longest + worst - last.execution + 1;
      terms = level.explained(begins, pending(worst, begins), before);
      part.finish(terms, longest, worst);
    }
    return {longest, "", std::move(terms)};
  }

 private:
  // nullptr: it does not.
  static const char* why_it_fails(const Path& path) {
    const Part& part = path.part;
    if (part.executor.threads != 1) return "several threads";
    if (part.executor.is_wait_set) return "a snapshot runs whole, whatever arrives";
    if (part.executor.order != Order::by_urgency) return "no order by urgency";
    if (part.supply.has_equals()) return "a thread of its priority shares its CPU";
    if (!path.is_alone()) return "something else sends to a callback of the path";
    return nullptr;
  }

  /// The callbacks that are at least as urgent as the least urgent one of the path.
  class Level {
   public:
    explicit Level(const Path& path) : path_(path), part_(path.part) {
      least_ = part_.at(path.callbacks.front()).urgency;
      for (const std::size_t callback : path.callbacks) {
        least_ = std::min(least_, part_.at(callback).urgency);
      }
      for (std::size_t source = 0; source < part_.sources.size(); ++source) {
        const Source& from = part_.sources[source];
        Time cost = 0;
        if (is_high(from.callback) || is_own(from.callback)) {
          cost = reached(from.callback, 1);
        }
        costs_.push_back(times(cost, from.messages));
      }
    }

    /// A less urgent callback that runs when the window begins, and what it causes in it.
    Time blocking() const {
      Time longest = 0, caused = 0;
      for (const std::size_t callback : part_.callbacks) {
        if (is_high(callback) || is_own(callback)) continue;
        longest = std::max(longest, part_.at(callback).execution);
        caused = std::max(caused, behind(callback, 1));
      }
      return plus(part_.blocking(longest), caused);
    }
    /// Of all executions of the path that one arrival causes.
    Time of_path() const {
      Time result = 0;
      for (const std::size_t each : path_.callbacks) {
        result =
            plus(result, times(part_.at(each).execution, part_.executions(path_.source, each)));
      }
      return times(result, part_.sources[path_.source].messages);
    }
    /// All others that arrive in the window.
    Time interference(Time window) const {
      Time result = 0;
      for (std::size_t source = 0; source < part_.sources.size(); ++source) {
        result = plus(result, times(costs_[source], part_.sources[source].curve.most(window)));
      }
      return result;
    }

    std::vector<Term> explained(Time window, Time pending, Time before) const {
      std::vector<Term> terms{{"something less urgent that has begun, and what it causes", before},
                              {"the callbacks of the path, also of its other instances",
                               pending - before - interference(window)}};
      for (std::size_t source = 0; source < part_.sources.size(); ++source) {
        const Count count = part_.sources[source].curve.most(window);
        terms.push_back(part_.term(source, count, costs_[source]));
      }
      return terms;
    }

   private:
    bool is_own(std::size_t callback) const {
      return std::find(path_.callbacks.begin(), path_.callbacks.end(), callback) !=
             path_.callbacks.end();
    }
    bool is_high(std::size_t callback) const {
      return part_.at(callback).urgency >= least_ && !is_own(callback);
    }
    /// Of so many executions of the callback and what follows without a less urgent one between;
    /// without those of the path itself.
    Time reached(std::size_t callback, Count count) const {
      const Time own = is_own(callback) ? 0 : times(part_.at(callback).execution, count);
      return plus(own, behind(callback, count));
    }
    Time behind(std::size_t callback, Count count) const {
      Time result = 0;
      for (const Output& output : part_.at(callback).outputs) {
        if (!part_.is_inside(callback, output)) continue;
        if (!is_high(output.to) && !is_own(output.to)) continue;
        result = plus(result, reached(output.to, times(count, output.messages)));
      }
      return result;
    }

    const Path& path_;
    const Part& part_;
    std::int64_t least_ = 0;
    std::vector<Time> costs_;  // by source
  };
};

}  // namespace
TAKT_REGISTER_METHOD("urgency", "non-preemptive fixed priorities, for whole paths", Urgency,
                     .assumes =
                         "one thread, none of its priority on its CPU; no polling points; "
                         "the most urgent first; each callback of the path has one sender; "
                         "messages are sent at the latest at a callback's end",
                     .source = "Davis et al., 2007; for paths: our own")
}  // namespace takt::analysis
