// The bound of taking turns: between two turns of a group, each other group has one at most. Our
// own: the window begins when the group becomes ready; one callback of another may run already;
// inside the group the order is that of arrival.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "takt/analysis/method.hpp"

namespace takt::analysis {
namespace {

class Turns final : public Method {
 public:
  Answer bound(const Path& path) const override {
    const Part& part = path.part;
    if (part.executor.threads != 1) return Answer::none("several threads");
    if (part.executor.is_wait_set) return Answer::none("a snapshot runs whole, whatever arrives");
    if (part.executor.order != Order::in_turns) return Answer::none("the groups take no turns");
    if (!part.supply.holds_in_any_window()) {
      return Answer::none("more urgent threads of its CPU may be behind when it arrives");
    }
    std::vector<Term> terms;
    const Time response = response_of(part, path.last(), terms);
    return with_what_precedes(path, response, std::move(terms));
  }

 private:
  static Time response_of(const Part& part, std::size_t callback, std::vector<Term>& terms) {
    const std::size_t group = part.at(callback).group;
    std::vector<std::pair<Time, std::vector<Part::Inner>>> mine;
    std::map<std::size_t, Time> others;  // by group: its longest
    bool has_messages = false;
    for (const std::size_t other : part.callbacks) {
      const Callback& described = part.at(other);
      if (described.group == group) {
        mine.emplace_back(described.execution, part.inner_arrivals(other));
        has_messages = has_messages || !described.is_timer;
      } else {
        Time& longest = others[described.group];
        longest = std::max(longest, described.execution);
      }
    }
    Time round = 0, blocking = 0;
    for (const auto& [other, longest] : others) {
      round = plus(round, longest);
      blocking = std::max(blocking, part.blocking(longest));
    }
    const auto work = [&](Time window) {
      Time result = blocking;
      for (const auto& [execution, arrivals] : mine) {
        result = plus(result, times(plus(execution, round), most(arrivals, window)));
      }
      return result;
    };
    const auto time_for = [&](Time amount) { return part.supply.time_for(amount, part.limit); };
    const Time busy =
        least_fixed_point([&](Time window) { return time_for(work(window)); }, part.limit);
    if (busy >= kUnbounded) return kUnbounded;
    // A message that is sent before the executor has looked at its timers overtakes one that is
    // due.
    const Time overtaking = part.at(callback).is_timer && has_messages ? part.longest() - 1 : 0;
    Time worst = 0, worst_offset = 0;
    for (const auto& [execution, arrivals] : mine) {
      for (const Time step : steps(arrivals, plus(busy, overtaking))) {
        const Time offset = std::max(Time{0}, step - overtaking);
        const Time response = time_for(work(offset + 1 + overtaking)) - offset;
        if (response > worst) worst_offset = offset;
        worst = std::max(worst, response);
      }
    }
    if (part.explains) {
      const Time window = worst_offset + 1 + overtaking;
      terms = {{"a callback of another group that has begun", blocking},
               {"what has arrived in its group, and a turn of the others for each",
                work(window) - blocking}};
      part.finish(terms, worst, worst_offset);
    }
    return worst;
  }
};

}  // namespace
TAKT_REGISTER_METHOD("turns", "one callback of each group in turn", Turns,
                     .assumes =
                         "one thread, no more urgent one on its CPU; no polling points; the "
                         "groups take turns",
                     .source = "our own")
}  // namespace takt::analysis
