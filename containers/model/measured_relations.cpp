// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/model/measured_relations.hpp"

#include <algorithm>
#include <chrono>
#include <initializer_list>
#include <iterator>
#include <map>
#include <set>
#include <string_view>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "takt/base/counted.hpp"

namespace takt {
namespace {

using Times = std::vector<Nanoseconds>;

// A file has seconds as decimal numbers.
constexpr Nanoseconds kRounding{10};

/// How long the measured runs were, together.
struct RunLength {
  std::size_t runs = 1;
  Nanoseconds most{0};  // 0: not known

  explicit RunLength(const MeasuredModel& model) {
    const Nanoseconds total = std::max(model.duration, model.total_duration);
    if (model.duration == Nanoseconds::zero()) return;
    runs = static_cast<std::size_t>(total / model.duration);
    // What began before its end may end later, and clocks differ.
    most = total + total / 10 + std::chrono::seconds(static_cast<std::int64_t>(runs));
  }
  bool is_exceeded_by(Nanoseconds time) const { return most != Nanoseconds::zero() && time > most; }
};

/// Describes times that are not ascending; empty: they are. Those that are zero were left out.
std::string not_ascending(std::initializer_list<std::pair<const char*, Nanoseconds>> times) {
  std::pair<const char*, Nanoseconds> shorter{"", Nanoseconds::zero()};
  for (const auto& [name, time] : times) {
    if (time == Nanoseconds::zero()) continue;
    if (shorter.second > time) return fmt::format("'{}' is longer than '{}'", shorter.first, name);
    shorter = {name, time};
  }
  return {};
}

std::string too_long(const RunLength& run,
                     std::initializer_list<std::pair<const char*, Nanoseconds>> times) {
  for (const auto& [name, time] : times) {
    if (run.is_exceeded_by(time)) return fmt::format("'{}' is longer than the run", name);
  }
  return {};
}

// ---- Distances of arrivals ----

/// Each of n arrivals more is at least as far away, and a row of them is made of shorter ones.
std::string not_of_a_row(const Times& distances) {
  if (!std::is_sorted(distances.begin(), distances.end()))
    return "'distances' get shorter: each is for one arrival more than the one before";
  if (!distances.empty() && distances.back() == Nanoseconds::zero())
    return "'distances' are all zero: that is any number of arrivals at once";
  for (std::size_t whole = 1; whole < distances.size(); ++whole) {
    for (std::size_t part = 0; 2 * part < whole; ++part) {
      const Nanoseconds parts = distances[part] + distances[whole - 1 - part];
      if (distances[whole] + kRounding >= parts) continue;
      return fmt::format(
          "distances[{}] is {}, but it is made of distances[{}] and distances[{}], {}", whole,
          to_string(distances[whole]), part, whole - 1 - part, to_string(parts));
    }
  }
  return {};
}

std::string too_many(const Times& distances, std::uint64_t arrivals) {
  if (distances.empty() || distances.size() < arrivals) return {};
  return fmt::format("there are {} between {}", counted(distances.size(), "distance"),
                     counted(arrivals, "arrival"));
}

/// Whether arrivals at these distances fit into the run.
std::string too_slow(const Times& distances, std::uint64_t arrivals, const RunLength& run) {
  if (run.most == Nanoseconds::zero()) return {};
  for (std::size_t i = 0; i < distances.size(); ++i) {
    if (run.is_exceeded_by(distances[i]))
      return fmt::format("distances[{}] is {}, longer than the run", i, to_string(distances[i]));
    if (distances[i] == Nanoseconds::zero()) continue;
    const auto rows = static_cast<std::uint64_t>(run.most / distances[i]) + run.runs;
    const std::uint64_t most = run.runs + (i + 1) * rows;
    if (arrivals <= most) continue;
    return fmt::format("{} arrivals with distances[{}] of {} take longer than the run", arrivals, i,
                       to_string(distances[i]));
  }
  return {};
}

std::string not_of_period(const MeasuredCallback& callback, const RunLength& /*unused*/) {
  const auto& [distances, period, jitter] =
      std::tie(callback.least_distances, callback.period, callback.jitter);
  if (period == Nanoseconds::zero())
    return jitter == Nanoseconds::zero() ? "" : "a 'jitter' needs a 'period'";
  for (std::size_t i = 0; i < distances.size(); ++i) {
    const Nanoseconds periods = static_cast<std::int64_t>(i + 1) * period;
    const bool is_less = distances[i] < periods - jitter;
    if (!is_less && distances[i] <= periods + jitter) continue;
    return fmt::format("distances[{}] is {}, but 'period' and 'jitter' allow no {} than {}", i,
                       to_string(distances[i]), is_less ? "less" : "more",
                       to_string(is_less ? periods - jitter : periods + jitter));
  }
  return {};
}

// ---- One callback ----

struct CallbackRelation {
  const char* key;  // of the callback
  /// Why it does not hold; empty: it does.
  std::string (*broken)(const MeasuredCallback&, const RunLength&);
};
constexpr CallbackRelation kOfCallbacks[] = {
    {"executions",
     [](const MeasuredCallback& callback, const RunLength&) {
       const bool has_times = callback.longest_execution != Nanoseconds::zero();
       return callback.executions == 0 || has_times
                  ? std::string()
                  : fmt::format("there are {}, and no 'execution' says how long they took",
                                callback.executions);
     }},
    {"execution",
     [](const MeasuredCallback& callback, const RunLength&) {
       return not_ascending({{"min", callback.least_execution},
                             {"p50", callback.median_execution},
                             {"p99", callback.p99_execution},
                             {"max", callback.longest_execution}});
     }},
    {"execution",
     [](const MeasuredCallback& callback, const RunLength&) {
       const Nanoseconds first = callback.longest_first_execution;
       if (first == Nanoseconds::zero()) return std::string();
       return not_ascending({{"min", callback.least_execution},
                             {"first_ten", first},
                             {"max", callback.longest_execution}});
     }},
    {"execution",
     [](const MeasuredCallback& callback, const RunLength& run) {
       return too_long(run, {{"max", callback.longest_execution},
                             {"waits", callback.longest_wait.value_or(Nanoseconds::zero())}});
     }},
    {"arrival", [](const MeasuredCallback& callback,
                   const RunLength&) { return not_of_a_row(callback.least_distances); }},
    {"arrival", not_of_period},
    {"arrival",
     [](const MeasuredCallback& callback, const RunLength&) {
       // Without 'executions', a person states how often it runs.
       return callback.executions == 0 ? std::string()
                                       : too_many(callback.least_distances, callback.executions);
     }},
    {"arrival",
     [](const MeasuredCallback& callback, const RunLength& run) {
       // Between what is lost there are no distances.
       return too_slow(callback.least_distances, callback.dropped == 0 ? callback.executions : 0,
                       run);
     }},
    {"uncaused",
     [](const MeasuredCallback& callback, const RunLength&) -> std::string {
       return callback.uncaused > callback.executions ? "it has more executions than the callback"
                                                      : "";
     }},
    {"uncaused", [](const MeasuredCallback& callback,
                    const RunLength&) { return not_of_a_row(callback.uncaused_distances); }},
    {"uncaused",
     [](const MeasuredCallback& callback, const RunLength&) {
       return too_many(callback.uncaused_distances, callback.uncaused);
     }},
    {"uncaused",
     [](const MeasuredCallback& callback, const RunLength&) -> std::string {
       const auto& [some, all] = std::tie(callback.uncaused_distances, callback.least_distances);
       for (std::size_t i = 0; i < std::min(some.size(), all.size()); ++i) {
         if (some[i] >= all[i]) continue;
         return fmt::format("distances[{}] is {}, but of all arrivals it is {}", i,
                            to_string(some[i]), to_string(all[i]));
       }
       return {};
     }},
};

// ---- The model ----

using Report = std::vector<Contradiction>;

void check_overheads(const MeasuredModel& model, const RunLength& run, Report& report) {
  for (const auto& [key, times] :
       {std::pair{"dispatch", &model.dispatch_overhead}, std::pair{"wake", &model.wake_overhead}}) {
    report.push_back({{"overheads", key},
                      not_ascending({{"min", times->least},
                                     {"p10", times->p10},
                                     {"p50", times->median},
                                     {"p90", times->p90},
                                     {"p99", times->p99},
                                     {"p99.9", times->longest}})});
    report.push_back({{"overheads", key}, too_long(run, {{"p99.9", times->longest}})});
  }
}

// If each callback that was executed has a period, its executions say how long it was active.
void check_activity(const MeasuredModel& model, Report& report) {
  constexpr double kLeastShare = 0.1;  // of the run; nodes may become active late, or end early
  constexpr std::chrono::duration<double> kStart = std::chrono::seconds(10);
  std::chrono::duration<double> longest{0};
  for (const MeasuredCallback& callback : model.callbacks) {
    if (callback.executions == 0) continue;
    if (callback.period == Nanoseconds::zero()) return;
    const auto arrivals = static_cast<double>(callback.executions + callback.dropped);
    longest = std::max(longest, std::chrono::duration<double>(callback.period) * arrivals);
  }
  const std::chrono::duration<double> length = std::max(model.duration, model.total_duration);
  if (longest.count() == 0 || kLeastShare * length <= longest + kStart) return;
  report.push_back({{model.total_duration > model.duration ? "total_duration" : "duration"},
                    fmt::format("it is {:g} s, and by its 'period' and 'executions' no callback "
                                "was active for longer than {:g} s",
                                length.count(), longest.count())});
}

void check_runs(const MeasuredModel& model, const RunLength& run, Report& report) {
  if (model.total_duration != Nanoseconds::zero())
    report.push_back(
        {{"total_duration"},
         not_ascending({{"duration", model.duration}, {"total_duration", model.total_duration}})});
  check_activity(model, report);
  // Each execution takes a nanosecond, and those of a callback come one after the other.
  std::uint64_t executions = model.lost_executions;
  for (const MeasuredCallback& callback : model.callbacks) executions += callback.executions;
  const auto time = static_cast<std::uint64_t>(run.most.count());
  if (run.most == Nanoseconds::zero() || executions / (model.callbacks.size() + 1) <= time) return;
  report.push_back({{model.lost_executions != 0 ? "lost_executions" : "duration"},
                    fmt::format("{} executions do not fit into the run", executions)});
}

// An execution that the trace has lost may have been caused, or end an instance.
void check_causes(const MeasuredModel& model, Report& report) {
  std::map<std::string_view, double> causes;  // executions, at most
  for (const MeasuredCallback& from : model.callbacks) {
    for (const auto& [name, most] : from.causes) {
      if (most == 0) report.push_back({{"callbacks", from.name, "causes", name}, "it causes none"});
      causes[name] += static_cast<double>(from.executions) * static_cast<double>(most);
    }
  }
  if (model.lost_executions != 0) return;
  for (const MeasuredCallback& to : model.callbacks) {
    const auto most = causes.find(to.name);  // without one, it may be a timer
    if (most == causes.end() || most->second == 0 || to.executions <= to.uncaused) continue;
    if (static_cast<double>(to.executions - to.uncaused) <= most->second) continue;
    report.push_back({{"callbacks", to.name, "executions"},
                      fmt::format("others have caused {} of them, but by their 'causes' no more "
                                  "than {:.0f}",
                                  to.executions - to.uncaused, most->second)});
  }
  for (const MeasuredCallback& from : model.callbacks) {
    for (const auto& [name, most] : from.causes) {
      const auto to = std::find_if(model.callbacks.begin(), model.callbacks.end(),
                                   [&, &of = name](const auto& each) { return each.name == of; });
      if (to == model.callbacks.end() || to->executions == 0) continue;
      const std::uint64_t caused = to->executions - std::min(to->executions, to->uncaused);
      if (most <= caused) continue;
      report.push_back({{"callbacks", from.name, "causes", name},
                        fmt::format("one execution has caused {} of it, and of its {} there are {} "
                                    "that something has caused",
                                    most, to->executions, caused)});
    }
  }
}

void check_chains(const MeasuredModel& model, const RunLength& run, Report& report) {
  std::uint64_t most = 0;
  for (const MeasuredCallback& callback : model.callbacks)
    most = std::max(most, callback.executions);
  for (const MeasuredChain& chain : model.chains) {
    report.push_back({{"chains", chain.name},
                      not_ascending({{"p50", chain.median},
                                     {"p99", chain.p99},
                                     {"p99.9", chain.p999},
                                     {"max", chain.longest}})});
    report.push_back({{"chains", chain.name}, too_long(run, {{"max", chain.longest}})});
    if (most == 0 || model.lost_executions != 0 || chain.instances <= most) continue;
    report.push_back({{"chains", chain.name},
                      fmt::format("{} instances came through, and no callback was executed more "
                                  "than {} times",
                                  chain.instances, most)});
  }
}

void check_executors(const MeasuredModel& model, Report& report) {
  std::set<std::string> served;
  for (const MeasuredExecutor& executor : model.executors) {
    for (const std::string& callback : executor.callbacks) {
      if (served.insert(callback).second) continue;
      report.push_back(
          {{"executors", executor.name},
           fmt::format("'{}' is in the lists of two executors, or twice in one", callback)});
    }
  }
  if (model.executors.empty()) return;  // then they are those of the file
  for (const MeasuredCallback& callback : model.callbacks) {
    if (callback.executions == 0 || served.contains(callback.name)) continue;
    report.push_back({{"callbacks", callback.name},
                      "it was executed, and is in the list of no executor under 'executors'"});
  }
}

}  // namespace

std::vector<Contradiction> contradictions(const MeasuredModel& model) {
  const RunLength run(model);
  Report report;
  check_runs(model, run, report);
  check_overheads(model, run, report);
  check_executors(model, report);
  for (const MeasuredCallback& callback : model.callbacks) {
    for (const CallbackRelation& relation : kOfCallbacks)
      report.push_back(
          {{"callbacks", callback.name, relation.key}, relation.broken(callback, run)});
  }
  check_causes(model, report);
  check_chains(model, run, report);
  std::erase_if(report, [](const Contradiction& each) { return each.what.empty(); });
  return report;
}

}  // namespace takt
