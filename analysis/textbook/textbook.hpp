// Analyses of textbooks and papers on bare task sets, as published: for research and teaching. What
// they say holds for the systems that they were written for; few of these are Takt's executors.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ANALYSIS_TEXTBOOK_TEXTBOOK_HPP_
#define TAKT_ANALYSIS_TEXTBOOK_TEXTBOOK_HPP_

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "takt/analysis/supply.hpp"
#include "takt/base/registry.hpp"
#include "takt/base/visibility.hpp"

namespace takt::analysis {
namespace TAKT_INTERNAL textbook {

/// A task, or a chain of callbacks that a task begins. Each analysis reads some of it.
struct Task {
  std::string name;
  Time execution = 0;        // C; of a chain: the sum
  Time last = 0;             // C of the last callback of a chain; without a chain: the same
  Time shortest = 0;         // C_min
  Time period = kUnbounded;  // of a single job
  Time offset = 0, jitter = 0;
  std::optional<Time> deadline;  // from the release; if the analysis needs one, it is given
  Time point = 0;                // Y: what is added to the release, and then the least goes first
  std::int64_t priority = 0;     // a larger one is more urgent
  bool is_timer = false;         // otherwise a subscription, which waits for a polling point
  std::optional<std::int64_t> place;  // in the order of registration
  /// A callback of a chain that has several executors.
  struct Part {
    Time execution = 0;
    std::size_t executor = 0;
    std::int64_t priority = 0;
  };
  std::vector<Part> parts;

  /// Its deadline, or else its period.
  Time due() const { return deadline.value_or(period); }
  ArrivalCurve arrivals() const { return ArrivalCurve::periodic(period, jitter); }
  /// The instants of releases, a million at most: task sets are given in any unit of time.
  std::vector<Time> steps(Time limit, Time from = 0) const {
    return arrivals().steps(limit, from, 1'000'000);
  }
  /// What the executions that are released in a window take at most.
  Time work(Time window) const { return times(execution, arrivals().most(window)); }
};

struct TaskSet {
  std::vector<Task> tasks;
  std::optional<Reservation> reservation;  // none: a processor of its own
  std::optional<Time> blocking;            // none: as the analysis finds it
  Count processors = 1;
  struct Executor {
    int cpu = 0;
    std::int64_t priority = 0;  // a larger one is more urgent
  };
  std::vector<Executor> executors;
  Time until = 0;               // the last window of a table
  Time limit = 60'000'000'000;  // larger results count as none

  Supply supply() const { return reservation ? Supply(*reservation, nullptr) : Supply(); }
};

/// Of one task.
struct Response {
  Time bound = kUnbounded;          // from the release to the end
  std::optional<Time> busy_window;  // in which it was found
  std::string why_not;              // if the analysis says nothing of this task
};

struct Result {
  std::vector<Response> responses;            // by task; or else:
  std::vector<std::pair<Time, Time>> points;  // a window, and what is supplied or wanted in it
  std::optional<bool> is_schedulable;
};

/// One analysis. Registered with the macro below, one file for a family.
/// Thread safety: a pure function. Real-time: no.
struct Analysis {
  Result (*analyse)(const TaskSet&);
};

struct AnalysisTraits {
  std::string assumes, source;  // for people
  std::string keys;             // of a task; those in brackets may be left out
  std::string settings;         // of the set, beside its tasks and its limit, likewise
  std::string example;          // a set in JSON, with what is published if anything is
  /// A task is delayed by what is as urgent only, or has a processor of its own: so it may have a
  /// bound though all together want more than there is.
  bool bounds_some = false;
  bool applies_to_takt = false;
  std::string takt;  // to which of its executors, or why to none
};
using AnalysisRegistry = Registry<Analysis, AnalysisTraits>;
/// All textbook analyses of this process by name.
AnalysisRegistry& analyses();

/// The result of an analysis. Throws Error for an unknown name, and for tasks that want more than
/// there is, unless some of them have bounds nevertheless.
/// Thread safety: a pure function. Real-time: no.
Result analyse(const std::string& name, const TaskSet& set);

// ---- What several of them need ----

/// Responses by task, each of a function of the task's index.
template <class Function>
Result for_each_task(const TaskSet& set, Function&& response) {
  Result result;
  for (std::size_t i = 0; i < set.tasks.size(); ++i) result.responses.push_back(response(i));
  return result;
}

/// The longest of `response(offset)` over the instants in a busy window at which the task may be
/// released; the window is the least in which `work(window)` can be done.
template <class Work, class ByOffset>
Response longest_response(const TaskSet& set, const Task& task, Work&& work, ByOffset&& response) {
  const Supply supply = set.supply();
  const Time busy = least_fixed_point(
      [&](Time window) { return supply.time_for(work(window), set.limit); }, set.limit);
  if (busy >= kUnbounded) return {};
  Response result{.bound = 0, .busy_window = busy};
  for (const Time offset : task.steps(busy)) {
    result.bound = std::max(result.bound, response(offset));
  }
  if (result.bound > set.limit) result.bound = kUnbounded;
  return result;
}

/// At namespace scope in a .cpp file, with a function. Behind it stand the traits.
#define TAKT_REGISTER_TEXTBOOK(name, description, function, ...)                 \
  namespace {                                                                    \
  [[maybe_unused]] const bool TAKT_UNIQUE(takt_textbook_) =                      \
      (::takt::analysis::textbook::analyses().add(                               \
           name, {description,                                                   \
                  [] { return std::make_unique<Analysis>(Analysis{function}); }, \
                  {__VA_ARGS__}}),                                               \
       true);                                                                    \
  }

}  // namespace textbook
}  // namespace takt::analysis

#endif  // TAKT_ANALYSIS_TEXTBOOK_TEXTBOOK_HPP_
