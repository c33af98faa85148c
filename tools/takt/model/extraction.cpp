// SPDX-License-Identifier: Apache-2.0
#include "model/extraction.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "takt/measuring/row_json.hpp"

namespace takt::tools {
namespace {

using nlohmann::json;
using Times = std::vector<Nanoseconds>;

/// A callback's periods are measured over so many arrivals; fewer tell too little.
constexpr std::size_t kLeastArrivals = 10;
/// An overhead is this percentile of so many executions.
constexpr double kOverheads = 0.999;
constexpr std::size_t kLeastOverheads = 100;
constexpr std::size_t kFirst = 10;

/// Of sorted times; zero if there are none.
Nanoseconds percentile(const Times& sorted, double share) {
  if (sorted.empty()) return Nanoseconds::zero();
  const auto place = static_cast<std::size_t>(share * static_cast<double>(sorted.size()));
  return sorted[std::min(place, sorted.size() - 1)];
}

// From the end of an execution to the start of another thread on its CPU.
constexpr Nanoseconds kSwitchesWithin = std::chrono::microseconds(100);

MeasuredTimes overhead_of(Times& times) {
  if (times.size() < kLeastOverheads) return {};
  std::sort(times.begin(), times.end());
  return {times.front(),          percentile(times, 0.1),  percentile(times, 0.5),
          percentile(times, 0.9), percentile(times, 0.99), percentile(times, kOverheads)};
}

/// What is seen of one callback, in all traces.
struct Seen {
  Times executions, first;
  std::vector<Times> arrivals, uncaused;  // without a hole in each
  std::uint64_t dropped = 0;
  Nanoseconds longest_wait{0};
  std::map<std::string, std::uint64_t> causes;
};

/// A callback of a trace as a chain names it: that of the topic "/scan" is "/planner/scan".
std::string named_as_in_chains(const std::string& callback) {
  const std::size_t slashes = callback.find("//", 1);
  return slashes == std::string::npos ? callback
                                      : callback.substr(0, slashes) + callback.substr(slashes + 1);
}

/// From each begin on, the trace has all executions of a process.
std::map<std::string, Nanoseconds> complete_from(const Trace& trace) {
  std::map<std::string, Nanoseconds> result;
  std::vector<char> is_known(trace.threads.size());
  for (const TracedExecution& execution : trace.executions) {
    const TracedThread& thread = trace.threads[execution.thread];
    if (std::exchange(is_known[execution.thread], 1) != 0 || thread.overwritten == 0) continue;
    Nanoseconds& begin = result[thread.process];
    begin = std::max(begin, execution.start);
  }
  return result;
}

/// Collects from the traces.
class Extraction {
 public:
  MeasuredModel model;

  void add(const Trace& trace) {
    const auto begins = complete_from(trace);
    std::vector<bool> counts(trace.executions.size());
    for (std::size_t i = 0; i < counts.size(); ++i) {
      const TracedExecution& execution = trace.executions[i];
      const auto begin = begins.find(trace.threads[execution.thread].process);
      counts[i] = begin == begins.end() || execution.ready >= begin->second;
      if (!counts[i]) ++model.lost_executions;
    }
    for (const TracedThread& thread : trace.threads) model.lost_executions += thread.overwritten;
    for (const json& name : trace.about.at("callbacks")) seen_[named_as_in_chains(name)];
    add_executions(trace, counts, !begins.empty());
    add_arrivals(trace, counts);
    add_causes(trace, counts);
    add_overheads(trace);
    add_chains(trace.about.at("chains"));
    for (const std::string node : trace.about.value("active_nodes", json::array()))
      model.active_nodes.insert(node);
    const Nanoseconds duration(std::llround(trace.about.at("duration_s").get<double>() * 1e9));
    durations_.push_back(duration);
    if (model.duration == Nanoseconds::zero() || duration < model.duration) {
      model.duration = duration;
    }
  }

  void finish() {
    model.dispatch_overhead = overhead_of(dispatches_);
    model.wake_overhead = overhead_of(wakes_);
    if (durations_.size() > 1)
      model.total_duration =
          std::accumulate(durations_.begin(), durations_.end(), Nanoseconds::zero());
    seen_.erase(kRemovedCallbacks);
    for (auto& [name, seen] : seen_) {
      seen.causes.erase(kRemovedCallbacks);
      model.callbacks.push_back(measured(name, seen));
    }
  }

 private:
  // What comes from another process is read between the pick and the callback.
  static Nanoseconds taking(const Trace& trace, const TracedExecution& execution) {
    const bool is_timer = execution.kind == "timer";
    const bool is_of_process = execution.cause && trace.threads[execution.thread].process ==
                                                      process_of(trace, *execution.cause);
    return is_timer || is_of_process ? Nanoseconds::zero() : execution.start - execution.picked;
  }
  static const std::string& process_of(const Trace& trace, std::size_t execution) {
    return trace.threads[trace.executions[execution].thread].process;
  }

  void add_executions(const Trace& trace, const std::vector<bool>& counts, bool has_lost_begin) {
    std::map<std::string, std::size_t> so_far;
    for (std::size_t i = 0; i < counts.size(); ++i) {
      const TracedExecution& execution = trace.executions[i];
      if (!counts[i]) continue;
      Seen& seen = seen_[named_as_in_chains(execution.callback)];
      const Nanoseconds time = execution.cpu_time + taking(trace, execution);
      seen.executions.push_back(time);
      seen.dropped += execution.lost;
      if (execution.has_waited) {
        const Nanoseconds wait = execution.end - execution.start - execution.cpu_time;
        seen.longest_wait = std::max(seen.longest_wait, wait);
      }
      if (!has_lost_begin && so_far[execution.callback]++ < kFirst) {
        seen.first.push_back(time);
      }
    }
  }

  static bool has_cause(const Trace& trace, const TracedExecution& execution) {
    if (!execution.cause) return execution.kind == "timer";
    return trace.executions[*execution.cause].callback != kRemovedCallbacks;
  }

  // A pool may start executions in another order than they became ready.
  void add_arrivals(const Trace& trace, const std::vector<bool>& counts) {
    struct Arrival {
      Nanoseconds time;
      std::uint64_t lost;
      bool is_caused;
    };
    std::map<std::string, std::vector<Arrival>> arrivals;
    for (std::size_t i = 0; i < counts.size(); ++i) {
      const TracedExecution& execution = trace.executions[i];
      if (!counts[i]) continue;
      arrivals[execution.callback].push_back(
          {execution.ready, execution.lost, has_cause(trace, execution)});
    }
    for (auto& [name, of_callback] : arrivals) {
      std::stable_sort(of_callback.begin(), of_callback.end(),
                       [](const Arrival& a, const Arrival& b) {
                         return std::pair(a.time, a.lost) < std::pair(b.time, b.lost);
                       });
      Seen& seen = seen_[named_as_in_chains(name)];
      seen.arrivals.emplace_back();
      seen.uncaused.emplace_back();
      for (const auto& [time, lost, is_caused] : of_callback) {
        if (lost != 0) {
          seen.arrivals.emplace_back();
          seen.uncaused.emplace_back();
        }
        seen.arrivals.back().push_back(time);
        if (!is_caused) seen.uncaused.back().push_back(time);
      }
    }
  }

  void add_causes(const Trace& trace, const std::vector<bool>& counts) {
    std::map<std::pair<std::size_t, std::string>, std::uint64_t> caused;
    for (const TracedExecution& execution : trace.executions) {
      if (!execution.cause || !counts[*execution.cause]) continue;
      const std::uint64_t count = ++caused[{*execution.cause, execution.callback}];
      const std::string& from = trace.executions[*execution.cause].callback;
      std::uint64_t& most =
          seen_[named_as_in_chains(from)].causes[named_as_in_chains(execution.callback)];
      most = std::max(most, count);
    }
  }

  void add_overheads(const Trace& trace) {
    std::vector<std::array<std::optional<Nanoseconds>, 2>> ends(trace.threads.size());  // the last
    for (const TracedExecution& execution : trace.executions) {
      const TracedThread& thread = trace.threads[execution.thread];
      auto& own = ends[execution.thread];
      const auto before = own[0];
      own = {execution.end, before};
      if (!before || !thread.is_prompt) continue;
      // What ends on another thread right before it starts has had the CPU: that is interference,
      // and no overhead. What ends earlier may be on another CPU, and a long wake-up would not
      // count.
      const auto ends_meanwhile = [&](const std::optional<Nanoseconds>& end) {
        return end && *end > execution.ready && *end <= execution.start &&
               execution.start - *end <= kSwitchesWithin;
      };
      if (execution.ready <= *before) {
        dispatches_.push_back(execution.start - *before);
      } else if (execution.kind == "timer" &&
                 std::none_of(ends.begin(), ends.end(), [&](const auto& of_thread) {
                   return std::any_of(of_thread.begin(), of_thread.end(), ends_meanwhile);
                 })) {
        wakes_.push_back(execution.start - execution.ready);
      }
    }
  }

  // A chain through several processes has a piece in each: no more come through than through all.
  void add_chains(const json& chains) {
    std::map<std::string, std::uint64_t> came_through;
    for (const json& chain : chains) {
      const json& latency = chain.at("latency_us");
      if (latency.at("count") == 0) continue;
      const std::string name = chain.at("name");
      const auto known = std::find_if(model.chains.begin(), model.chains.end(),
                                      [&](const auto& other) { return other.name == name; });
      MeasuredChain& measured =
          known != model.chains.end() ? *known : model.chains.emplace_back(MeasuredChain{name});
      const auto count = latency.at("count").get<std::uint64_t>();
      std::uint64_t& all = came_through.try_emplace(name, count).first->second;
      all = std::min(all, count);
      for (const auto& [key, time] : {std::pair{"p50", &MeasuredChain::median},
                                      {"p99", &MeasuredChain::p99},
                                      {"p999", &MeasuredChain::p999},
                                      {"max", &MeasuredChain::longest}}) {
        measured.*time = std::max(measured.*time, rt::from_us(latency.at(key)));
      }
    }
    for (MeasuredChain& measured : model.chains) measured.instances += came_through[measured.name];
  }

  static MeasuredCallback measured(const std::string& name, Seen& seen) {
    MeasuredCallback callback{.name = name, .executions = seen.executions.size()};
    callback.dropped = seen.dropped;
    callback.causes = std::move(seen.causes);
    if (seen.executions.empty()) return callback;
    std::sort(seen.executions.begin(), seen.executions.end());
    callback.least_execution = seen.executions.front();
    callback.median_execution = percentile(seen.executions, 0.5);
    callback.p99_execution = percentile(seen.executions, 0.99);
    callback.longest_execution = seen.executions.back();
    if (!seen.first.empty()) {
      callback.longest_first_execution = *std::max_element(seen.first.begin(), seen.first.end());
    }
    callback.longest_wait = seen.longest_wait;
    set_arrivals(callback, seen.arrivals);
    for (const Times& piece : seen.uncaused) callback.uncaused += piece.size();
    Nanoseconds farthest{0};
    callback.uncaused_distances = least_distances(seen.uncaused, farthest);
    return callback;
  }

  static const Times& longest_of(const std::vector<Times>& pieces) {
    return *std::max_element(pieces.begin(), pieces.end(),
                             [](const auto& a, const auto& b) { return a.size() < b.size(); });
  }

  // δ⁻(2), δ⁻(3), …; and the greatest distance of as many as the last of these is for.
  static Times least_distances(const std::vector<Times>& pieces, Nanoseconds& farthest) {
    Times result;
    const Times& longest = longest_of(pieces);
    for (std::size_t steps = 1; steps < longest.size(); ++steps) {
      if (steps > MeasuredCallback::kMostDistances) break;
      Nanoseconds least = Nanoseconds::max();
      farthest = Nanoseconds::zero();
      for (const Times& piece : pieces) {
        for (std::size_t i = steps; i < piece.size(); ++i) {
          const Nanoseconds distance = piece[i] - piece[i - steps];
          least = std::min(least, distance);
          farthest = std::max(farthest, distance);
        }
      }
      result.push_back(least);
    }
    // Any number at once: no statement for the file.
    if (!result.empty() && result.back() == Nanoseconds::zero()) result.clear();
    return result;
  }

  // And a period, if the closest and the farthest arrivals agree on it.
  static void set_arrivals(MeasuredCallback& callback, const std::vector<Times>& pieces) {
    Nanoseconds farthest{0};
    callback.least_distances = least_distances(pieces, farthest);
    const Times& longest = longest_of(pieces);
    if (longest.size() < kLeastArrivals || callback.least_distances.empty()) return;
    const Nanoseconds closest = callback.least_distances.back();
    if (100 * (farthest - closest) > farthest) return;
    set_period(callback, pieces, longest);
  }

  static void set_period(MeasuredCallback& callback, const std::vector<Times>& pieces,
                         const Times& longest) {
    callback.period =
        (longest.back() - longest.front()) / static_cast<std::int64_t>(longest.size() - 1);
    for (const Times& piece : pieces) {
      Nanoseconds earliest{0}, latest{0}, due = piece.empty() ? Nanoseconds{0} : piece.front();
      for (const Nanoseconds arrival : piece) {
        earliest = std::min(earliest, arrival - due);
        latest = std::max(latest, arrival - due);
        due += callback.period;
      }
      callback.jitter = std::max(callback.jitter, latest - earliest);
    }
  }

  std::map<std::string, Seen> seen_;
  Times dispatches_, wakes_, durations_;
};

// A callback that was made late may be in some runs only.
void add_executor(MeasuredModel& model, const std::string& name, const json& of) {
  const auto known = std::find_if(model.executors.begin(), model.executors.end(),
                                  [&](const auto& other) { return other.name == name; });
  MeasuredExecutor& executor =
      known != model.executors.end()
          ? *known
          : model.executors.emplace_back(MeasuredExecutor{
                .name = name, .type = of.at("type"), .scheduler = of.at("scheduler")});
  for (const json& callback : of.at("callbacks")) {
    if (callback == kRemovedCallbacks) continue;
    const std::string named = named_as_in_chains(callback);
    auto& callbacks = executor.callbacks;
    if (std::find(callbacks.begin(), callbacks.end(), named) == callbacks.end())
      callbacks.push_back(named);
  }
}

}  // namespace

MeasuredModel extract_model(std::span<const Trace> traces) {
  Extraction extraction;
  for (const Trace& trace : traces) extraction.add(trace);
  extraction.finish();
  MeasuredModel& model = extraction.model;
  if (!traces.empty()) {
    model.file = traces.front().about.at("file");
    model.machine = traces.front().about.at("machine");
    using Texts = std::map<std::string, std::string>;
    model.settings = traces.front().about.value("settings", Texts());
    const auto components = traces.front().about.value("components", Texts());
    for (const auto& [node, digest] : components)
      model.components.push_back({.node = node, .digest = digest});
  }
  for (const Trace& trace : traces) {
    for (const auto& [name, of] : trace.about.at("executors").items())
      add_executor(model, name, of);
  }
  return std::move(model);
}

}  // namespace takt::tools
