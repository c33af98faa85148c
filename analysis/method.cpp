// SPDX-License-Identifier: Apache-2.0
#include "takt/analysis/method.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace takt::analysis {

MethodRegistry& methods() {
  static MethodRegistry registry("analysis");
  return registry;
}

Count Part::executions(std::size_t source, std::size_t callback) const {
  const auto found = caused[source].find(callback);
  return found != caused[source].end() ? found->second : 0;
}

Time Part::longest() const {
  Time result = 0;
  for (const std::size_t callback : callbacks) result = std::max(result, at(callback).execution);
  return result;
}

Time Part::demand(Time window, Time more) const {
  Time result = 0;
  if (executor.let_period > 0) {
    const Time each = plus(snapshot(), times(more, static_cast<Count>(callbacks.size())));
    return times(each, (window + executor.let_period - 1) / executor.let_period);
  }
  looks += sources.size();
  for (std::size_t source = 0; source < sources.size(); ++source) {
    const Time each = plus(costs[source], times(more, counts[source]));
    result = plus(result, times(each, sources[source].curve.most(window)));
  }
  return result;
}

// A spin may have begun before the window, and an early wake be for a release behind it.
Time Part::demand_with_spinning(Time window, Time more) const {
  const Time each = plus(more, plus(executor.spin, executor.early_wake));
  return plus(demand(plus(window, executor.early_wake), each),
              plus(executor.spin, executor.early_wake));
}

Term Part::term(std::size_t source, Count count, Time cost) const {
  return {
      fmt::format("{} × '{}' and what it causes here", count, at(sources[source].callback).name),
      times(count, cost)};
}

void Part::finish(std::vector<Term>& terms, Time bound, Time offset) const {
  Time work = 0;
  for (const Term& term : terms) work = plus(work, term.time);
  if (plus(bound, offset) != work) {
    terms.push_back({"more urgent threads, or the time without a budget", bound + offset - work});
  }
  if (offset != 0) terms.push_back({"has passed when the message arrives", -offset});
  std::erase_if(terms, [](const Term& term) { return term.time == 0; });
}

// What a message of unknown lateness is due to lies where it comes from.
Cause Part::cause_of_overload() const {
  std::vector<const Part*> parts{this};
  parts.insert(parts.end(), above.begin(), above.end());
  for (const Part* part : parts) {
    for (const Source& source : part->sources) {
      if (source.curve.most(1) < kUnbounded) continue;
      const std::string& name = at(source.callback).name;
      if (!source.from) {
        return {executor.name, fmt::format("it is not known how often '{}' runs", name)};
      }
      const Callback& sender = at(source.from->callback);
      for (const Output& output : sender.outputs) {
        if (output.to == source.callback && output.delay >= kUnbounded) {
          return {executor.name, why_delayed(sender, at(source.callback))};
        }
      }
      const auto& before = (*all)[sender.executor].cause;
      if (before && before->executor != executor.name) return *before;
      return {executor.name, fmt::format("it is not known how late '{}' gets messages from '{}'",
                                         name, sender.name)};
    }
  }
  return {executor.name, "there is more work than time, or nearly so"};
}

std::string Part::why_overloaded() const {
  const auto& [where, what] = cause_of_overload();
  if (where == executor.name) return what;
  return fmt::format("messages come by way of '{}', and {}", where, what);
}

std::string why_delayed(const Callback& from, const Callback& to) {
  return fmt::format(
      "it is not known how long messages from '{}' to '{}' take between processes; state it "
      "(`topics: {{NAME: {{delay: …}}}}`)",
      from.name, to.name);
}

Time Part::blocking(Time execution) const {
  const bool is_closed = std::all_of(sources.begin(), sources.end(), [&](const Source& source) {
    return at(source.callback).is_timer;
  });
  return is_closed ? std::max<Time>(0, execution - 1) : execution;
}

std::vector<Part::Inner> Part::inner_arrivals(std::size_t callback) const {
  std::vector<Inner> result;
  const auto known = causes.find(callback);
  if (known == causes.end()) return result;
  for (const std::size_t source : known->second) {
    const Count count = executions(source, callback);
    const Span& span = spans[source].at(callback);
    ArrivalCurve curve =
        sources[source].curve.with_jitter(between(span.earliest_release, span.latest_release));
    if (sources[source].callback != callback) {
      curve = curve.with_least_distance(least_distance_of_outputs());
    }
    result.push_back({std::move(curve), times(count, sources[source].messages)});
  }
  return result;
}

Count Part::backlog(std::size_t callback) const {
  Count result = 0;
  const auto known = causes.find(callback);
  if (known == causes.end()) return result;
  for (const std::size_t source : known->second) {
    const Count count = times(executions(source, callback), sources[source].messages);
    const Time latest = spans[source].at(callback).latest_end;
    result = plus(result, times(count, sources[source].curve.most(latest)));
  }
  return result;
}

Time Part::snapshot() const {
  Time result = 0;
  for (const std::size_t callback : callbacks) result = plus(result, at(callback).execution);
  return result;
}

Time Part::snapshot_until(std::size_t last) const {
  const auto is_served = [&](const Callback& callback) {
    if (executor.order == Order::in_windows) return callback.place <= at(last).place;
    if (executor.order == Order::by_urgency) return callback.urgency >= at(last).urgency;
    return true;
  };
  Time result = executor.sending;  // comes first, also what is of callbacks after `last`
  for (const std::size_t callback : callbacks) {
    if (is_served(at(callback))) result = plus(result, at(callback).execution);
  }
  return result;
}

bool Part::fits_into_period() const {
  return supply.holds_in_any_window() &&
         plus(supply.time_for(snapshot(), limit), system.overheads.wake) <= executor.let_period;
}

Time Part::lateness() const {
  return fits_into_period() ? plus(between(1, supply.time_for(plus(executor.sending, 1), limit)),
                                   system.overheads.wake)
                            : kUnbounded;
}

Time Part::least_distance_of_outputs() const {
  return std::max(Time{0}, executor.let_period - lateness());
}

Time Part::earliest_sent(const Span& span) const {
  return std::max(span.earliest_end, span.earliest_release + least_distance_of_outputs());
}

Time Part::sent_after(std::size_t callback) const {
  if (executor.let_period == 0) return 0;
  const Time ended = plus(supply.time_for(snapshot_until(callback), limit), system.overheads.wake);
  return between(ended, plus(executor.let_period, lateness()));
}

Time Part::longest_held() const {
  return executor.let_period > 0 ? plus(executor.let_period, lateness()) : 0;
}

Time Part::latest_sent(const Span& span, std::size_t callback) const {
  return plus(span.latest_end, sent_after(callback));
}

bool Path::is_alone() const {
  for (std::size_t i = 0; i < callbacks.size(); ++i) {
    for (std::size_t other = 0; other < part.sources.size(); ++other) {
      if (other != source && part.sources[other].callback == callbacks[i]) return false;
    }
    for (const std::size_t from : part.callbacks) {
      if (i != 0 && from == callbacks[i - 1]) continue;
      for (const Output& output : part.at(from).outputs) {
        if (output.to == callbacks[i] && part.is_inside(from, output)) return false;
      }
    }
  }
  return true;
}

Answer with_what_precedes(const Path& path, Time response, std::vector<Term> terms) {
  if (response >= kUnbounded) return Answer::none("there is more work than time, or nearly so");
  if (path.callbacks.size() == 1) return {response, "", std::move(terms)};
  const std::size_t before = path.callbacks[path.callbacks.size() - 2];
  // The thread is awake when it sends to itself; every bound has one wake-up already.
  const Time earlier = path.part.latest_sent(path.part.spans[path.source].at(before), before) -
                       path.part.system.overheads.wake;
  terms.insert(terms.begin(),
               {fmt::format("until '{}' has ended", path.part.at(before).name), earlier});
  return {plus(earlier, response), "", std::move(terms)};
}

Count most(const std::vector<Part::Inner>& arrivals, Time window) {
  Count result = 0;
  for (const auto& [curve, messages] : arrivals) {
    result = plus(result, times(messages, curve.most(window)));
  }
  return result;
}

std::vector<Time> steps(const std::vector<Part::Inner>& arrivals, Time limit, Time from) {
  std::vector<Time> result;
  for (const auto& [curve, messages] : arrivals) {
    const auto more = curve.steps(limit, from);
    result.insert(result.end(), more.begin(), more.end());
  }
  return result;
}

}  // namespace takt::analysis
