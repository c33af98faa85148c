// All schedules of non-preemptive jobs on several processors, as a graph: Nasri, Nelissen,
// Brandenburg, "A Response-Time Analysis for Non-Preemptive Job Sets under Global Scheduling"
// (ECRTS 2018). A node is the jobs that were dispatched, and when each processor becomes free; an
// edge is a job that may be dispatched next. Nodes with the same jobs, whose times overlap, are
// one.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "takt/analysis/textbook/textbook.hpp"

namespace takt::analysis::textbook {
namespace {

// Limit: jobs of a task set until it repeats, in `takt rta sag_…`. At it: the set is refused.
// Seen: the error.
constexpr std::size_t kMostJobs = 10'000;
// Limit: nodes of a graph of schedules in `takt rta sag_…`. At it: the set has no bounds. Seen: the
// reason.
constexpr std::size_t kMostNodes = 300'000;

/// The earliest and the latest time.
struct Span {
  Time first = 0, last = 0;
};

struct Job {
  std::size_t task = 0;
  Span release;
  Time shortest = 0, longest = 0;
  Time deadline = kUnbounded;
  std::int64_t rank = 0;  // the least goes first; of the same, the one that stands first
};

/// When processors become free, in this order.
using Processors = std::vector<Span>;

struct Node {
  std::vector<bool> served;
  std::size_t first = 0;  // all jobs before it are served
  Processors free;
};

class ScheduleGraph {
 public:
  /// Jobs by their earliest releases.
  ScheduleGraph(std::vector<Job> jobs, std::size_t processors)
      : jobs_(std::move(jobs)), ends_(jobs_.size(), 0) {
    level_[std::vector<bool>(jobs_.size())] = Group{.all = {Processors(processors)}};
  }

  /// False: there are too many nodes.
  bool explore() {
    for (std::size_t served = 0; served < jobs_.size(); ++served) {
      for (const auto& [jobs, group] : std::exchange(level_, {})) {
        for (const Processors& free : group.all) follow({jobs, group.first, free});
      }
      if (nodes_ > kMostNodes) return false;
    }
    return true;
  }

  const std::vector<Job>& jobs() const { return jobs_; }
  /// Of each job, the latest end.
  const std::vector<Time>& ends() const { return ends_; }

 private:
  struct Group {
    std::size_t first = 0;
    std::vector<Processors> all;
  };

  /// The edges of a node.
  void follow(const Node& node) {
    // Until then a processor is free, a job is there, and one of these is dispatched.
    Time certain = kUnbounded;
    for (std::size_t i = node.first; i < jobs_.size(); ++i) {
      if (jobs_[i].release.first > certain) break;
      if (!node.served[i]) certain = std::min(certain, jobs_[i].release.last);
    }
    certain = std::max(certain, node.free.front().last);
    std::vector<std::size_t> waiting;
    for (std::size_t i = node.first; i < jobs_.size(); ++i) {
      if (jobs_[i].release.first > certain) break;
      if (!node.served[i]) waiting.push_back(i);
    }
    for (const std::size_t i : waiting) {
      Span start{std::max(jobs_[i].release.first, node.free.front().first), certain};
      for (const std::size_t other : waiting) {
        if (goes_before(other, i)) start.last = std::min(start.last, jobs_[other].release.last - 1);
      }
      if (start.first <= start.last) add(node, i, start);
    }
  }

  bool goes_before(std::size_t job, std::size_t other) const {
    return std::tie(jobs_[job].rank, job) < std::tie(jobs_[other].rank, other);
  }

  void add(const Node& from, std::size_t job, const Span& start) {
    const Span end{start.first + jobs_[job].shortest, start.last + jobs_[job].longest};
    ends_[job] = std::max(ends_[job], end.last);
    // The others become free as before, but not before the job begins.
    std::vector<Time> first{end.first}, last{end.last};
    for (std::size_t i = 1; i < from.free.size(); ++i) {
      first.push_back(std::max(start.first, from.free[i].first));
      last.push_back(std::max(start.first, from.free[i].last));
    }
    std::sort(first.begin(), first.end());
    std::sort(last.begin(), last.end());
    Processors free;
    for (std::size_t i = 0; i < first.size(); ++i) free.push_back({first[i], last[i]});
    std::vector<bool> served = from.served;
    served[job] = true;
    std::size_t begin = from.first;
    while (begin < served.size() && served[begin]) ++begin;
    Group& group = level_[std::move(served)];
    group.first = begin;
    merge(group.all, std::move(free));
  }

  void merge(std::vector<Processors>& all, Processors free) {
    for (Processors& other : all) {
      bool overlaps = true;
      for (std::size_t i = 0; i < free.size(); ++i) {
        overlaps &= free[i].first <= other[i].last && other[i].first <= free[i].last;
      }
      if (!overlaps) continue;
      for (std::size_t i = 0; i < free.size(); ++i) {
        other[i].first = std::min(other[i].first, free[i].first);
        other[i].last = std::max(other[i].last, free[i].last);
      }
      return;
    }
    all.push_back(std::move(free));
    ++nodes_;
  }

  const std::vector<Job> jobs_;
  std::vector<Time> ends_;
  std::map<std::vector<bool>, Group> level_;  // nodes of as many jobs, by these
  std::size_t nodes_ = 0;
};

bool repeats(const Task& task) {
  return task.period != kUnbounded;
}

/// After so long all tasks begin at the same time again.
Time until_it_repeats(const TaskSet& set) {
  Time result = 1;
  for (const Task& task : set.tasks) {
    if (!repeats(task)) continue;
    const Time factor = task.period / std::gcd(result, task.period);
    result = factor > kUnbounded / result ? kUnbounded : result * factor;
  }
  return result;
}

/// Of all tasks until they repeat, by their earliest releases.
std::vector<Job> jobs_of(const TaskSet& set, bool by_deadline) {
  const Time until = until_it_repeats(set);
  const bool are_single = !repeats(set.tasks.front());
  Count count = 0;
  for (const Task& task : set.tasks) {
    // A job after the tasks repeat would meet none of them.
    if (repeats(task) == are_single) {
      throw Error(
          fmt::format("'{}' is a single job, or others are, and the rest is periodic", task.name),
          "give each a period T, or none");
    }
    if (repeats(task) && (task.offset != 0 || task.due() > task.period)) {
      throw Error(
          fmt::format(
              "'{}' does not begin with the others, or its deadline D is beyond its period T",
              task.name),
          "leave O out, and give a deadline up to T");
    }
    if (by_deadline && task.due() == kUnbounded) {
      throw Error(fmt::format("'{}' has no deadline D", task.name), "give it");
    }
    count = plus(count, repeats(task) ? until / task.period : 1);
  }
  if (count > static_cast<Count>(kMostJobs)) {
    throw Error(fmt::format("the tasks have more than {} jobs until they repeat", kMostJobs),
                "take periods that have a smaller multiple in common");
  }
  std::vector<Job> jobs;
  for (std::size_t i = 0; i < set.tasks.size(); ++i) {
    const Task& task = set.tasks[i];
    Time release = task.offset;
    do {
      const Time deadline = plus(release, task.due());
      jobs.push_back({.task = i,
                      .release = {release, plus(release, task.jitter)},
                      .shortest = std::min(task.shortest, task.execution),
                      .longest = task.execution,
                      .deadline = deadline,
                      .rank = by_deadline ? deadline : -task.priority});
      release = plus(release, task.period);
    } while (repeats(task) && release < until);
  }
  std::stable_sort(jobs.begin(), jobs.end(),
                   [](const Job& a, const Job& b) { return a.release.first < b.release.first; });
  return jobs;
}

/// The longest time from the earliest release of a job to its end.
Result all_schedules(const TaskSet& set, bool by_deadline) {
  ScheduleGraph graph(jobs_of(set, by_deadline), static_cast<std::size_t>(set.processors));
  std::string why_not;
  if (!graph.explore()) why_not = fmt::format("the graph has more than {} nodes", kMostNodes);
  std::vector<Time> longest(set.tasks.size(), 0);
  for (std::size_t i = 0; i < graph.jobs().size(); ++i) {
    const Job& job = graph.jobs()[i];
    longest[job.task] = std::max(longest[job.task], graph.ends()[i] - job.release.first);
    // Then not all is over when they repeat, and the next time is not as the first one.
    if (repeats(set.tasks[job.task]) && graph.ends()[i] > job.deadline && why_not.empty()) {
      why_not = fmt::format("'{}' may be late", set.tasks[job.task].name);
    }
  }
  return for_each_task(set, [&](std::size_t i) {
    return why_not.empty() ? Response{.bound = longest[i]} : Response{.why_not = why_not};
  });
}

Result by_priorities(const TaskSet& set) {
  return all_schedules(set, false);
}
Result by_deadlines(const TaskSet& set) {
  return all_schedules(set, true);
}

constexpr const char* kAssumes =
    "known releases: all tasks begin together, or all are single jobs (without T) at O; D ≤ "
    "T, or T without it; of the same priority who stands first goes first; R counts from O, or "
    "the begin of the period";
constexpr const char* kSource =
    "Nasri, Nelissen, Brandenburg: A Response-Time Analysis for Non-Preemptive Job Sets "
    "under Global Scheduling, ECRTS 2018";
constexpr const char* kTakt = "no timer begins together with those of other nodes";

}  // namespace

TAKT_REGISTER_TEXTBOOK(
    "sag_fp", "Non-preemptive fixed priorities on several processors, by all schedules",
    by_priorities, .assumes = kAssumes, .source = kSource,
    .keys = "C [C_min] [T] [O] [J] [D] priority", .settings = "[m]",
    .example =
        R"({"m": 2, "tasks": [{"C": 2, "C_min": 1, "T": 10, "priority": 3}, {"C": 8, "C_min": 7, "T": 30, "priority": 2},
           {"C": 13, "C_min": 3, "T": 60, "priority": 1}]})",
    .takt = kTakt)

TAKT_REGISTER_TEXTBOOK(
    "sag_edf", "Non-preemptive earliest deadline first on several processors, by all schedules",
    by_deadlines, .assumes = kAssumes, .source = kSource, .keys = "C [C_min] [T] [O] [J] [D]",
    .settings = "[m]",
    .example = R"({"m": 2, "tasks": [{"C": 2, "C_min": 1, "T": 10}, {"C": 8, "C_min": 7, "T": 30},
           {"C": 13, "C_min": 3, "T": 60}]})",
    .takt = kTakt)

}  // namespace takt::analysis::textbook
