// Preemptive priorities and deadlines, with Baker's stack resource policy for groups: one callback
// that is less urgent, and that a more urgent one of its group might need to wait for, may have
// begun before. Joseph and Pandya, "Finding Response Times in a Real-Time System" (1986), for
// urgencies, with arrivals of any curve as Tindell has them; Spuri, "Analysis of Deadline Scheduled
// Real-Time Systems" (1996), for deadlines. A band with fewer priorities than there are levels lets
// a callback wait for any one that runs on the last of them.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <set>

#include <fmt/format.h>

#include "takt/analysis/method.hpp"

namespace takt::analysis {
namespace {

class Preemption final : public Method {
 public:
  Answer bound(const Path& path) const override {
    const Part& part = path.part;
    if (part.executor.order != Order::by_urgency && part.executor.order != Order::by_point)
      return Answer::none("no order by urgency, deadline or laxity");
    const auto time_for = [&](Time work) { return part.supply.time_for(work, part.limit); };
    const Time busy =
        least_fixed_point([&](Time window) { return time_for(part.demand(window)); }, part.limit);
    if (busy >= kUnbounded) return Answer::none(part.why_overloaded());
    // Whatever the order, all that has come since it was idle is done when it is idle again.
    Answer whole{busy, "", {{"until the executor is idle", busy}}};
    std::vector<Term> terms;
    const Time response = Callbacks(part, path.last()).response(busy, terms);
    Answer by_level = with_what_precedes(path, response, std::move(terms));
    return by_level.bound <= whole.bound ? by_level : whole;
  }

 private:
  /// One callback, and what may run before it.
  class Callbacks {
   public:
    Callbacks(const Part& part, std::size_t callback) : part_(part) {
      std::map<std::size_t, Time> ceilings;
      std::set<Time> levels;
      for (const std::size_t each : part.callbacks) {
        const Time key = key_of(each);
        levels.insert(key);
        const auto known = ceilings.try_emplace(part.at(each).group, key).first;
        known->second = std::min(known->second, key);
      }
      const bool has_all_levels = levels.size() <= part.executor.levels;
      for (const std::size_t each : part.callbacks) {
        const Time ceiling = has_all_levels ? ceilings.at(part.at(each).group) : -kUnbounded;
        Entry entry{part.at(each).execution, key_of(each), ceiling, part.inner_arrivals(each)};
        if (each == callback) {
          own_ = std::move(entry);
        } else {
          others_.push_back(std::move(entry));
        }
      }
    }

    /// From its own arrival.
    Time response(Time busy, std::vector<Term>& terms) const {
      std::vector<Time> offsets = steps(own_.arrivals, busy);
      if (has_deadline()) {
        for (const Entry& other : others_) {
          if (other.key >= kUnbounded) continue;
          const Time shift = other.key - own_.key;
          for (const Time step : steps(other.arrivals, busy - shift, -shift)) {
            if (step + shift >= 0) offsets.push_back(step + shift);
          }
        }
        std::sort(offsets.begin(), offsets.end());
        offsets.erase(std::unique(offsets.begin(), offsets.end()), offsets.end());
      }
      Time worst = 0, worst_offset = 0;
      for (const Time offset : offsets) {
        const Time end = least_fixed_point(
            [&](Time window) { return part_.supply.time_for(work(offset, window), part_.limit); },
            part_.limit);
        if (end >= kUnbounded) return kUnbounded;
        if (end - offset > worst) worst_offset = offset;
        worst = std::max(worst, end - offset);
      }
      if (part_.explains) explain(worst, worst_offset, terms);
      return worst;
    }

   private:
    struct Entry {
      Time execution = 0;
      Time key = 0;      // smaller is more urgent
      Time ceiling = 0;  // the smallest of its group
      std::vector<Part::Inner> arrivals;
    };

    bool is_by_point() const { return part_.executor.order == Order::by_point; }
    bool has_deadline() const { return is_by_point() && own_.key < kUnbounded; }
    Time key_of(std::size_t callback) const {
      const Callback& described = part_.at(callback);
      return is_by_point() ? described.point : -static_cast<Time>(described.urgency);
    }
    // Of those that come so long after the window has begun, and are as urgent.
    Time key_at(Time offset) const { return has_deadline() ? own_.key + offset : own_.key; }
    Time blocking(Time offset) const {
      Time longest = 0;
      for (const Entry& other : others_) {
        if (other.key > key_at(offset) && other.ceiling <= key_at(offset))
          longest = std::max(longest, part_.blocking(other.execution));
      }
      return longest;
    }
    Time before(const Entry& other, Time offset, Time window) const {
      if (other.key > key_at(offset)) return 0;
      const Time until = has_deadline() ? std::min(window, key_at(offset) - other.key + 1) : window;
      return times(other.execution, most(other.arrivals, until));
    }
    Time own(Time offset) const { return times(own_.execution, most(own_.arrivals, offset + 1)); }
    Time work(Time offset, Time window) const {
      Time sum = plus(blocking(offset), own(offset));
      for (const Entry& other : others_) sum = plus(sum, before(other, offset, window));
      return sum;
    }
    void explain(Time response, Time offset, std::vector<Term>& terms) const {
      terms = {{"a less urgent callback that has begun", blocking(offset)},
               {fmt::format("{} × itself", most(own_.arrivals, offset + 1)), own(offset)},
               {"more urgent callbacks",
                work(offset, response + offset) - blocking(offset) - own(offset)}};
      part_.finish(terms, response, offset);
    }

    const Part& part_;
    Entry own_;
    std::vector<Entry> others_;
  };
};

}  // namespace
TAKT_REGISTER_METHOD("preemption", "preemptive urgencies or deadlines, groups by ceilings",
                     Preemption,
                     .assumes =
                         "callbacks interrupt each other on one CPU; the most urgent, or "
                         "the least point in time, first",
                     .source = "Joseph, Pandya, 1986; Spuri, 1996; Baker, 1991",
                     .is_for_preemption = true)
}  // namespace takt::analysis
