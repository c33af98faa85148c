// SPDX-License-Identifier: Apache-2.0
#include "takt/analysis/analysis.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "takt/analysis/solver.hpp"
#include "takt/analysis/supplies.hpp"

namespace takt::analysis {
namespace {

// Limit: paths of callbacks through an executor, for `takt analyze`. At it: the analysis fails.
// Seen: the error.
constexpr std::size_t kMostPaths = 10'000;
// What has not settled by then counts as unbounded.
// Limit: rounds until the bounds of a system settle. At it: what has not settled has no bound.
// Seen: the reason in the result.
constexpr int kMostRounds = 1000;
// Limit: looks at sources until then, some seconds. At it: as for rounds. Seen: the same.
constexpr std::uint64_t kMostLooks = 200'000'000;

/// The reason that says most of the system: that of a method that applies to every order.
std::string reason(const Executor& executor, const std::vector<MethodBound>& answers) {
  std::string result = answers.front().why_not;
  for (const MethodBound& answer : answers) {
    const MethodTraits traits = methods().traits(answer.method);
    const bool is_telling = executor.let_period > 0 ? traits.is_for_let
                            : executor.levels > 0   ? traits.is_for_preemption
                                                    : traits.is_general;
    if (is_telling) result = answer.why_not;
  }
  return result.empty() ? "it is above the limit of the analysis" : result;
}

}  // namespace

Solver::Solver(const System& system, const Options& options)
    : system_(system), limit_(options.limit) {
  for (const std::string& name : options.methods.empty() ? methods().names() : options.methods) {
    methods_.push_back({name, methods().make(name), methods().traits(name)});
  }
  order_callbacks();
  for (const Executor& executor : system_.executors) {
    parts_.push_back({.system = system_, .executor = executor, .all = &parts_, .limit = limit_});
  }
  make_supplies(parts_);
  make_sources();
  for (Part& part : parts_) make_paths(part);
  for (int round = 0; improve(round); ++round) {
  }
  if (!options.explains) return;
  for (Part& part : parts_) part.explains = true;
  std::set<std::size_t> on_chains;
  for (const Chain& chain : system_.chains) {
    on_chains.insert(chain.callbacks.begin(), chain.callbacks.end());
  }
  for (AnalysedPath& path : paths_) {
    if (on_chains.contains(path.path.last())) analyse(path);
  }
}

void Solver::order_callbacks() {
  std::vector<std::size_t> senders(system_.callbacks.size());
  for (const Callback& callback : system_.callbacks) {
    for (const Output& output : callback.outputs) ++senders[output.to];
  }
  for (std::size_t i = 0; i < senders.size(); ++i) {
    if (senders[i] == 0) ordered_.push_back(i);
  }
  for (std::size_t next = 0; next < ordered_.size(); ++next) {
    for (const Output& output : system_.callbacks[ordered_[next]].outputs) {
      if (--senders[output.to] == 0) ordered_.push_back(output.to);
    }
  }
  if (ordered_.size() == system_.callbacks.size()) return;
  const auto in_circle =
      std::find_if(senders.begin(), senders.end(), [](std::size_t count) { return count != 0; });
  throw Error(fmt::format("callbacks send to each other in a circle, with or before '{}'",
                          system_.callbacks[in_circle - senders.begin()].name),
              "there is no bound for what may go on for ever; state which messages do not go on");
}

void Solver::make_sources() {
  for (std::size_t i = 0; i < system_.callbacks.size(); ++i) {
    parts_[system_.callbacks[i].executor].callbacks.push_back(i);
    if (const auto& arrivals = system_.callbacks[i].arrivals) {
      add_source({.callback = i,
                  .curve = arrivals->with_jitter(system_.overheads.wake),
                  .longest_gap = system_.callbacks[i].longest_gap});
    }
  }
  for (const std::size_t from : ordered_) {
    const std::size_t executor = system_.callbacks[from].executor;
    for (const Output& output : system_.callbacks[from].outputs) {
      if (is_inside(from, output) || output.messages == 0) continue;
      const std::size_t sources = parts_[executor].sources.size();
      for (std::size_t source = 0; source < sources; ++source) {
        const Count count = parts_[executor].executions(source, from);
        if (count == 0) continue;
        const Source& before = parts_[executor].sources[source];
        add_source({.callback = output.to,
                    .curve = before.curve,
                    .messages = times(times(before.messages, count), output.messages),
                    .from = Source::From{from, source}});
      }
    }
  }
}

void Solver::add_source(Source source) {
  Part& part = parts_[system_.callbacks[source.callback].executor];
  auto& caused = part.caused.emplace_back();
  auto& spans = part.spans.emplace_back();
  caused[source.callback] = 1;
  for (const std::size_t from : ordered_) {
    const auto found = caused.find(from);
    if (found == caused.end()) continue;
    Span& span = spans[from];
    span.earliest_end = span.earliest_release + system_.callbacks[from].least_execution;
    for (const Output& output : system_.callbacks[from].outputs) {
      if (!is_inside(from, output)) continue;
      const bool is_first = !caused.contains(output.to);
      caused[output.to] = plus(caused[output.to], times(found->second, output.messages));
      Time& earliest = spans[output.to].earliest_release;
      const Time sent = part.earliest_sent(span);
      earliest = is_first ? sent : std::min(earliest, sent);
    }
  }
  Time cost = 0;
  Count executions = 0;
  for (const auto& [callback, count] : caused) {
    part.causes[callback].push_back(part.sources.size());
    cost = plus(cost, times(system_.callbacks[callback].execution, count));
    executions = plus(executions, count);
  }
  part.costs.push_back(times(cost, source.messages));
  part.counts.push_back(times(executions, source.messages));
  part.sources.push_back(std::move(source));
}

void Solver::make_paths(Part& part) {
  const std::size_t before = paths_.size();
  for (std::size_t source = 0; source < part.sources.size(); ++source) {
    extend({.path = {part, source, {part.sources[source].callback}}});
  }
  if (paths_.size() - before > kMostPaths) {
    throw TooManyPaths(static_cast<std::size_t>(&part - parts_.data()),
                       fmt::format("executor '{}' has more than {} paths of callbacks",
                                   part.executor.name, kMostPaths));
  }
}

void Solver::extend(AnalysedPath path) {
  if (paths_.size() > kMostPaths * parts_.size()) return;  // make_paths refuses it
  const std::size_t last = path.path.last();
  paths_.push_back(path);
  for (const Output& output : system_.callbacks[last].outputs) {
    if (!is_inside(last, output)) continue;
    AnalysedPath longer = path;
    longer.path.callbacks.push_back(output.to);
    extend(std::move(longer));
  }
}

// What comes from other executors comes with the jitter that these cause. Senders first: a change
// reaches the end of every chain in one round, so a round that changes no bound is the last.
void Solver::update_curves() {
  for (const std::size_t to : ordered_) {
    Part& part = parts_[system_.callbacks[to].executor];
    for (std::size_t i = 0; i < part.sources.size(); ++i) {
      Source& source = part.sources[i];
      if (source.callback != to) continue;
      const Callback& receiver = system_.callbacks[to];
      if (!source.from && receiver.is_timer && receiver.longest_gap < kUnbounded) {
        // An execution serves all releases until it begins.
        const Time missed = std::max(Time{0}, part.spans[i].at(to).latest_end - 1);
        source.longest_gap = times(missed / receiver.longest_gap + 1, receiver.longest_gap);
      }
      if (!source.from) continue;
      const Callback& sender = system_.callbacks[source.from->callback];
      const Part& before = parts_[sender.executor];
      const Span& span = before.spans[source.from->source].at(source.from->callback);
      const Source& root = before.sources[source.from->source];
      Time held = 0, delay = 0, least_delay = kUnbounded;
      bool waits = false;
      source.longest_gap = 0;
      for (const Output& output : sender.outputs) {
        if (output.to != to) continue;
        waits = waits || output.waits;
        const Time waiting =
            output.waits ? wait_of_join(source.from->callback, root.longest_gap, output) : 0;
        held = std::max(held, plus(waiting, sent_after(source.from->callback, output)));
        delay = std::max(delay, output.delay);
        least_delay = std::min(least_delay, output.least_delay);
        source.longest_gap =
            std::max(source.longest_gap, longest_gap(source.from->callback, output));
      }
      const Time earliest = waits ? span.earliest_end : before.earliest_sent(span);
      // In the first round nothing has ended: what is unbounded must not become less by that.
      const Time jitter = between(earliest, plus(span.latest_end, held));
      ArrivalCurve sent = root.curve.with_jitter(jitter);
      if (!waits) sent = sent.with_least_distance(before.least_distance_of_outputs());
      source.curve = sent.with_jitter(plus(between(least_delay, delay), system_.overheads.wake));
    }
  }
}

void Solver::analyse(AnalysedPath& analysed) const {
  const Executor& executor = analysed.path.part.executor;
  analysed.answers.clear();
  Time least = kUnbounded;
  for (const auto& [name, method, traits] : methods_) {
    Answer answer;
    if (!executor.unknown.empty()) {
      answer = Answer::none(executor.unknown);
    } else if (executor.threads > 1 && (executor.reservation || executor.share)) {
      answer = Answer::none("its threads have no CPUs of their own");
    } else if (executor.threads > 1 && analysed.path.part.is_throttled) {
      answer = Answer::none("Linux may throttle its real-time threads (`machine: rt_runtime`)");
    } else if (traits.is_for_let != (executor.let_period > 0)) {
      answer = Answer::none(traits.is_for_let ? "it does not run by logical execution time"
                                              : "it runs by logical execution time");
    } else if (traits.is_for_preemption != (executor.levels > 0)) {
      answer = Answer::none(traits.is_for_preemption ? "its callbacks do not interrupt each other"
                                                     : "its callbacks interrupt each other");
    } else {
      answer = method->bound(analysed.path);
    }
    answer.bound = plus(answer.bound, system_.overheads.wake);
    if (analysed.path.part.explains && system_.overheads.wake > 0) {
      answer.terms.push_back({"until the thread is awake", system_.overheads.wake});
    }
    if (answer.bound > limit_) answer.bound = kUnbounded;
    if (answer.bound < least) analysed.terms = std::move(answer.terms);
    least = std::min(least, answer.bound);
    analysed.answers.push_back({name, answer.bound, std::move(answer.why_not)});
  }
  analysed.bound = std::max(analysed.bound, least);
}

// When a bound is lost for the first time. Later rounds know only of what that has led to.
void Solver::note_cause(AnalysedPath& analysed) {
  Part& part = parts_[system_.callbacks[analysed.path.last()].executor];
  analysed.why_not = reason(part.executor, analysed.answers);
  if (part.cause) return;
  part.cause = Cause{part.executor.name, analysed.why_not};
  if (analysed.why_not == part.why_overloaded()) part.cause = part.cause_of_overload();
}

// One round; false when nothing has changed.
bool Solver::improve(int round) {
  update_curves();
  find_throttled(parts_);
  find_busy(parts_);
  bool has_changed = false;
  std::uint64_t looks = 0;
  for (const Part& part : parts_) looks += part.looks;
  const bool takes_too_long = round >= kMostRounds || looks >= kMostLooks;
  for (AnalysedPath& analysed : paths_) {
    const Time before = analysed.bound;
    analyse(analysed);
    if (analysed.bound == before) continue;
    has_changed = true;
    if (takes_too_long) analysed.bound = kUnbounded;
    if (analysed.bound >= kUnbounded) note_cause(analysed);
  }
  for (AnalysedPath& analysed : paths_) {
    Part& part = parts_[system_.callbacks[analysed.path.last()].executor];
    auto& spans = part.spans[analysed.path.source];
    Time& end = spans[analysed.path.last()].latest_end;
    end = std::max(end, analysed.bound);
    const Time sent = plus(analysed.bound, part.sent_after(analysed.path.last()));
    for (const Output& output : system_.callbacks[analysed.path.last()].outputs) {
      if (!is_inside(analysed.path.last(), output)) continue;
      Time& release = spans[output.to].latest_release;
      release = std::max(release, sent);
    }
  }
  return has_changed;
}

// Whether it sends to the source, or to a join that does.
bool Solver::is_sender(const Source& source, std::size_t callback) const {
  const auto waits = [&](std::size_t from) {
    const auto& outputs = system_.callbacks[from].outputs;
    return std::any_of(outputs.begin(), outputs.end(), [&](const Output& output) {
      return output.to == source.callback && output.waits;
    });
  };
  return source.from->callback == callback || (waits(source.from->callback) && waits(callback));
}

// Of all paths of one executor that end with these callbacks; what begins before them makes the
// bound larger, not wrong. With a predecessor: those that it begins.
SegmentBound Solver::bound(const std::vector<std::size_t>& callbacks,
                           const std::size_t* predecessor) const {
  SegmentBound result{.executor = system_.callbacks[callbacks.front()].executor,
                      .callbacks = callbacks,
                      .bound = 0};
  bool is_reached = false;
  for (const AnalysedPath& analysed : paths_) {
    const auto& path = analysed.path.callbacks;
    if (path.size() < callbacks.size() ||
        !std::equal(callbacks.rbegin(), callbacks.rend(), path.rbegin())) {
      continue;
    }
    const Source& source = analysed.path.part.sources[analysed.path.source];
    if (predecessor != nullptr &&
        (path.size() != callbacks.size() || !source.from || !is_sender(source, *predecessor))) {
      continue;
    }
    result.longest_gap = std::max(result.longest_gap, source.longest_gap);
    if (!is_reached || analysed.bound > result.bound) {
      result.bound = analysed.bound;
      result.methods = analysed.answers;
      result.terms = analysed.terms;
      result.why_not = analysed.why_not;
    }
    is_reached = true;
  }
  if (!is_reached) {
    result.bound = kUnbounded;
    result.why_not = fmt::format("nothing is known that makes '{}' ready",
                                 system_.callbacks[callbacks.front()].name);
  }
  return result;
}

// The output that leads from one callback of a chain to the next.
const Output& Solver::link(const Chain& chain, std::size_t place) const {
  const Callback& sender = system_.callbacks[chain.callbacks[place - 1]];
  const Output* found = nullptr;
  for (const Output& output : sender.outputs) {
    if (output.to != chain.callbacks[place]) continue;
    if (found == nullptr || output.waits || output.delay > found->delay) found = &output;
  }
  if (found != nullptr) return *found;
  throw Error(fmt::format("chain '{}': '{}' sends nothing to '{}'", chain.name, sender.name,
                          system_.callbacks[chain.callbacks[place]].name));
}

ChainBound Solver::bound(const Chain& chain) const {
  ChainBound result{.bound = 0};
  for (std::size_t i = 0; i < chain.callbacks.size();) {
    const std::size_t* predecessor = nullptr;
    if (i > 0) {
      predecessor = &chain.callbacks[i - 1];
      const Output& output = link(chain, i);
      const Callback& sender = system_.callbacks[*predecessor];
      const Callback& receiver = system_.callbacks[chain.callbacks[i]];
      result.bound = plus(result.bound, plus(sent_after(*predecessor, output), output.delay));
      if (output.delay >= kUnbounded && result.why_not.empty()) {
        result.why_not = why_delayed(sender, receiver);
      }
      if (output.waits) {
        SegmentBound& before = result.segments.back();
        before.wait = wait_of_join(*predecessor, before.longest_gap, output);
        result.bound = plus(result.bound, before.wait);
        if (before.wait >= kUnbounded && result.why_not.empty()) {
          result.why_not = fmt::format(
              "it is not known how long '{}' waits for the other inputs of the join before '{}': "
              "nothing may be lost on its way there",
              sender.name, receiver.name);
        }
      }
    }
    std::vector<std::size_t> segment{chain.callbacks[i]};
    while (++i < chain.callbacks.size() && is_inside(segment.back(), link(chain, i))) {
      segment.push_back(chain.callbacks[i]);
    }
    result.segments.push_back(bound(segment, predecessor));
    const SegmentBound& found = result.segments.back();
    result.bound = plus(result.bound, found.bound);
    if (found.bound >= kUnbounded && result.why_not.empty()) {
      result.why_not = fmt::format("{}: {}", system_.executors[found.executor].name, found.why_not);
    }
  }
  if (result.bound >= kUnbounded && result.why_not.empty()) {
    result.why_not = "it is above the limit of the analysis";
  }
  return result;
}

CallbackBound Solver::bound(std::size_t callback) const {
  const SegmentBound found = bound({callback}, nullptr);
  CallbackBound result{.bound = found.bound};
  if (found.bound < kUnbounded) {
    const Part& part = parts_[system_.callbacks[callback].executor];
    result.backlog = part.backlog(callback);
  }
  result.why_not = found.why_not;
  for (const MethodBound& answer : found.methods) {
    if (answer.bound == found.bound && found.bound < kUnbounded) result.method = answer.method;
  }
  return result;
}

Bounds analyze(const System& given, const Options& options) {
  check(given);
  System system = given;
  const auto& [dispatch, wake, context_switch] = given.overheads;
  for (Callback& callback : system.callbacks) {
    // Where callbacks interrupt each other, a worker may look when it arrives, and the next one
    // when it begins: each comes and goes.
    const Executor& executor = system.executors[callback.executor];
    const bool interrupts = executor.levels > 0;
    const Time own = plus(dispatch, executor.more_dispatch);
    const Time each = interrupts ? times(3, plus(own, times(2, context_switch))) : own;
    callback.execution = plus(callback.execution, each);
  }
  const Solver solver(system, options);
  Bounds result;
  for (const Chain& chain : system.chains) result.chains.push_back(solver.bound(chain));
  for (std::size_t i = 0; i < system.callbacks.size(); ++i) {
    result.callbacks.push_back(solver.bound(i));
  }
  return result;
}

std::vector<bool> pays(const System& system, Time Overheads::*overhead, const Options& options) {
  constexpr Time kMore = 1000;
  System with = system;
  with.chains.clear();
  const Bounds before = analyze(with, options);
  with.overheads.*overhead += kMore;
  const Bounds after = analyze(with, options);
  std::vector<bool> result(system.executors.size());
  for (std::size_t i = 0; i < system.callbacks.size(); ++i) {
    if (after.callbacks[i].bound != before.callbacks[i].bound)
      result[system.callbacks[i].executor] = true;
  }
  return result;
}

}  // namespace takt::analysis
