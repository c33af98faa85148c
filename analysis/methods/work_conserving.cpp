// The bound that holds for every order: while a callback waits, its executor works. Casini et al.,
// "Response-Time Analysis of ROS 2 Processing Chains" (ECRTS 2019), Lemma 8, without what it
// assumes of rclcpp's order. That it holds for any is our own argument: from the last instant
// before the arrival at which nothing was pending, until the last callback begins, every thread
// of the executor works, or the callback waits for one of its group that works. All that has run
// until then arrived since that instant.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <fmt/format.h>

#include "takt/analysis/method.hpp"

namespace takt::analysis {
namespace {

class WorkConserving final : public Method {
 public:
  Answer bound(const Path& path) const override {
    const Part& part = path.part;
    const Source& own = part.sources[path.source];
    const Callback& last = part.at(path.last());
    const Time each = each_of_last(path);
    const auto last_of = [&](Time window) { return times(each, own.curve.most(window)); };
    const auto others = [&](Time window) { return part.demand(window) - last_of(window); };
    Time supplied = 0;  // in a longer window no less
    const Time busy = least_fixed_point(
        [&](Time window) {
          return supplied = part.supply.time_for(part.demand(window), part.limit, supplied);
        },
        part.limit);
    if (busy >= kUnbounded) return Answer::none(part.why_overloaded());
    Time longest = 0, worst = 0;
    // What arrives later ends no earlier, so each search goes on from the one before.
    Time end = 1;
    supplied = 0;
    for (const Time offset : own.curve.steps(busy)) {
      end = least_fixed_point(
          [&](Time until) {
            const Time window = std::max(until - last.execution, offset) + 1;
            const Time work = plus(last_of(offset + 1), others(window));
            return supplied = part.supply.time_for(work, part.limit, supplied);
          },
          plus(part.limit, offset), std::max(end, offset + 1));
      const Time response = end < kUnbounded ? end - offset : kUnbounded;
      if (response > longest) worst = offset;
      longest = std::max(longest, response);
    }
    return {longest, "", part.explains ? explain(path, longest, worst) : std::vector<Term>{}};
  }

 private:
  // Of one arrival, the executions of the last callback by way of the path. Those keep their order;
  // a later arrival may overtake by another way.
  static Time each_of_last(const Path& path) {
    Count count = path.part.sources[path.source].messages;
    for (std::size_t i = 0; i + 1 < path.callbacks.size(); ++i) {
      Count messages = 0;
      for (const Output& output : path.part.at(path.callbacks[i]).outputs) {
        const bool is_next =
            output.to == path.callbacks[i + 1] && path.part.is_inside(path.callbacks[i], output);
        if (is_next) messages = plus(messages, output.messages);
      }
      count = times(count, messages);
    }
    return times(path.part.at(path.last()).execution, count);
  }

  static std::vector<Term> explain(const Path& path, Time bound, Time offset) {
    const Part& part = path.part;
    const Time last = part.at(path.last()).execution;
    const Time window = bound > last ? offset + bound - last + 1 : offset + 1;
    std::vector<Term> terms;
    for (std::size_t source = 0; source < part.sources.size(); ++source) {
      const Source& from = part.sources[source];
      Term term = part.term(source, from.curve.most(window), part.costs[source]);
      if (source == path.source) {
        // Later instances of the last callback come after this one.
        const Count later = from.curve.most(window) - from.curve.most(offset + 1);
        term.time -= times(each_of_last(path), later);
        if (later != 0)
          term.what += fmt::format(", but {} × '{}'", later, part.at(path.last()).name);
      }
      terms.push_back(std::move(term));
    }
    part.finish(terms, bound, offset);
    return terms;
  }
};

}  // namespace
TAKT_REGISTER_METHOD(
    "work_conserving", "while a callback waits, its executor works", WorkConserving,
    .assumes = "the threads together do less than one can; with several, each has a CPU",
    .source = "Casini et al., ECRTS 2019, Lemma 8; for any order: our own", .is_general = true)
}  // namespace takt::analysis
