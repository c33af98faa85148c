// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/model/places.hpp"

#include <algorithm>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/base/cpu_model.hpp"

namespace takt {
namespace {

/// A thread with its CPUs, sorted, and its priority: 0 for all that are not real-time threads.
struct Thread {
  std::size_t executor;
  const ThreadAttributes* attributes;
  analysis::Executor::Share share;
  int highest;  // priority of a band, on one CPU

  bool has_inside(const Thread& other) const {
    return highest != 0 && &other != this && share.meets(other.share) &&
           other.share.priority >= share.priority && other.share.priority <= highest;
  }

  bool is_reserved() const { return attributes->policy == ThreadPolicy::deadline; }
};

/// The threads that preempt this one, or may make it wait; like analysis::rivals, before executors
/// have places.
std::vector<const Thread*> rivals(const Thread& of, const std::vector<Thread>& all) {
  std::vector<const Thread*> found;
  for (const Thread& other : all) {
    const bool preempts = other.is_reserved() || of.share.yields_to(other.share);
    if (&other != &of && preempts) found.push_back(&other);
  }
  return found;
}

std::string names(const Thread& first, const std::vector<const Thread*>& threads) {
  std::vector<std::string> names{"'" + first.attributes->name + "'"};
  for (const Thread* thread : threads) names.push_back("'" + thread->attributes->name + "'");
  return fmt::format("{}", fmt::join(names, ", "));
}

std::vector<std::size_t> executors_of(const std::vector<const Thread*>& threads) {
  std::set<std::size_t> found;
  for (const Thread* thread : threads) found.insert(thread->executor);
  return {found.begin(), found.end()};
}

/// Linux runs these threads by global EDF: each gets its runtime in each period if the sum of their
/// shares is at most m - (m - 1) × the greatest (Goossens, Funk, Baruah: "Priority-driven
/// scheduling of periodic task systems on multiprocessors", 2003). The kernel admits more.
bool get_their_runtimes(const std::vector<Thread>& all, std::size_t cpus) {
  double sum = 0, greatest = 0;
  for (const Thread& thread : all) {
    if (!thread.is_reserved()) continue;
    const double share = static_cast<double>(thread.attributes->runtime.count()) /
                         static_cast<double>(thread.attributes->period.count());
    sum += share;
    greatest = std::max(greatest, share);
  }
  const auto m = static_cast<double>(cpus);
  return sum <= m - (m - 1) * greatest + 1e-9;  // rounding errors
}

Place place_of_reserved(const ThreadAttributes& thread, const std::vector<Thread>& all,
                        std::size_t cpus) {
  if (thread.deadline != Nanoseconds::zero() && thread.deadline != thread.period) {
    return {.unknown = fmt::format("the deadline of thread '{}' is shorter than its period, for "
                                   "which no supply is known",
                                   thread.name)};
  }
  if (!get_their_runtimes(all, cpus)) {
    return {.unknown = fmt::format(
                "the SCHED_DEADLINE threads reserve so much that '{}' may get its runtime after "
                "its period, on {} CPUs (Dhall's effect); reserve less",
                thread.name, cpus)};
  }
  return {.reservation = analysis::Reservation{.budget = thread.runtime.count(),
                                               .period = thread.period.count()}};
}

Place place_of(const Thread& thread, const std::vector<Thread>& all, std::size_t cpus,
               bool is_exclusive) {
  const std::string& name = thread.attributes->name;
  for (const Thread& other : all) {
    if (!thread.has_inside(other) && !other.has_inside(thread)) continue;
    return {.unknown = fmt::format("thread '{}' may run on the CPU of thread '{}', and one of them "
                                   "has a priority inside the other's band",
                                   name, other.attributes->name)};
  }
  if (thread.is_reserved()) return place_of_reserved(*thread.attributes, all, cpus);
  const std::vector<int>& own_cpus = thread.share.cpus;
  const int priority = thread.share.priority;
  if (priority == 0 && !is_exclusive) {
    return {.unknown = fmt::format("thread '{}' is {}, so whatever runs on the machine delays it; "
                                   "give it SCHED_FIFO, or promise `machine: {{exclusive: true}}`",
                                   name, to_string(thread.attributes->policy))};
  }
  const std::vector<const Thread*> found = rivals(thread, all);
  const bool is_bound = own_cpus.size() == 1;
  // There is always a free CPU for the thread, and Linux migrates a real-time thread there at once.
  if (found.size() < own_cpus.size() && (priority != 0 || found.empty())) {
    return {.share = priority != 0 || is_bound ? std::optional(thread.share) : std::nullopt,
            .cpu = is_bound ? own_cpus.front() : -1,
            .movers = executors_of(found)};
  }
  const auto is_bound_too = [](const Thread* other) {
    return !other->is_reserved() && other->share.cpus.size() == 1;
  };
  const bool are_all_bound = is_bound && std::all_of(found.begin(), found.end(), is_bound_too);
  const auto equal = std::find_if(found.begin(), found.end(), [&](const Thread* other) {
    return !other->is_reserved() && other->share.priority == thread.share.priority;
  });
  // Linux migrates SCHED_OTHER threads to a free CPU, but not at once.
  if (priority == 0 && (equal != found.end() || !is_bound)) {
    return {.unknown = fmt::format("the threads {} share CPU {} without real-time priorities",
                                   names(thread, found), fmt::join(own_cpus, ", "))};
  }
  if (equal != found.end() && !are_all_bound) {
    return {.unknown = fmt::format("threads '{}' and '{}' have the same priority, and more threads "
                                   "may run on their CPUs than there are; give each its own "
                                   "priority, or bind each to one CPU (`affinity`)",
                                   name, (*equal)->attributes->name)};
  }
  return {.share = thread.share, .cpu = is_bound ? own_cpus.front() : -1};
}

// All threads of a pool need a CPU each, of their own.
Place place_of_pool(const std::vector<const Thread*>& pool, const std::vector<Thread>& all,
                    std::size_t cpus, bool is_exclusive) {
  std::vector<const Thread*> movers;
  for (const Thread* thread : pool) {
    const Place place = place_of(*thread, all, cpus, is_exclusive);
    if (!place.unknown.empty()) return place;
    const std::vector<const Thread*> found = rivals(*thread, all);
    std::copy_if(found.begin(), found.end(), std::back_inserter(movers),
                 [&](const Thread* other) { return other->executor != thread->executor; });
    if (!place.reservation && found.size() < thread->share.cpus.size()) continue;
    std::vector<const Thread*> others;
    for (const Thread* other : pool) {
      if (other != pool.front()) others.push_back(other);
    }
    return {.unknown = fmt::format("the threads {} of a pool share CPUs or have reservations",
                                   names(*pool.front(), others))};
  }
  return {.movers = executors_of(movers)};
}

}  // namespace

std::vector<Place> find_places(std::span<const ModelledThread> threads, std::size_t executors,
                               const std::vector<int>& cpus, bool is_exclusive) {
  std::vector<Thread> all;
  for (const ModelledThread& thread : threads) {
    const ThreadAttributes& attributes = thread.attributes;
    std::vector<int> own = attributes.affinity.empty() ? cpus : attributes.affinity;
    std::sort(own.begin(), own.end());
    const bool is_realtime =
        attributes.policy == ThreadPolicy::fifo || attributes.policy == ThreadPolicy::rr;
    all.push_back({thread.executor,
                   &attributes,
                   {.cpus = std::move(own),
                    .priority = is_realtime ? attributes.priority : 0,
                    .slice = attributes.policy == ThreadPolicy::rr ? CpuModel::kTurn.count() : 0},
                   is_realtime ? thread.highest : 0});
  }
  std::vector<Place> result(executors);
  for (std::size_t executor = 0; executor < executors; ++executor) {
    std::vector<const Thread*> mine;
    for (const Thread& thread : all) {
      if (thread.executor == executor) mine.push_back(&thread);
    }
    if (mine.size() == 1)
      result[executor] = place_of(*mine.front(), all, cpus.size(), is_exclusive);
    if (mine.size() > 1) result[executor] = place_of_pool(mine, all, cpus.size(), is_exclusive);
  }
  // A pool that may run on the only CPU of a thread delays that thread by an unknown time.
  for (const Thread& thread : all) {
    Place& place = result[thread.executor];
    const std::vector<const Thread*> found = rivals(thread, all);
    if (!place.share || found.size() < thread.share.cpus.size()) continue;
    for (const Thread* other : found) {
      const Place& its = result[other->executor];
      if (other->executor == thread.executor || its.share || its.reservation) continue;
      place = {.unknown =
                   fmt::format("thread '{}', of an executor with several threads, may run on "
                               "its CPU",
                               other->attributes->name)};
      break;
    }
  }
  return result;
}

}  // namespace takt
