// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/watching/preemptions.hpp"

#include <algorithm>
#include <fstream>

#include <fmt/format.h>
#include <sched.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/containers/process_usage.hpp"
#include "takt/sched/threads/thread_attributes.hpp"

namespace takt {
namespace {

// Limit: threads of others that are told apart in a look. At it: the rest is one. Seen: "others".
constexpr std::size_t kMostPreemptors = 20;

// A thread of a component has the name of the thread that made it, unless it chooses one.
std::string name_of_process_thread(std::uint32_t process, std::uint32_t thread) {
  const bool is_own = process == static_cast<std::uint32_t>(getpid());
  std::string name;
  std::getline(std::ifstream(fmt::format("/proc/{}/task/{}/comm", process, thread)), name);
  if (name.empty())
    return is_own ? "a thread of this process that has ended" : "a thread that has ended";
  if (is_own) return fmt::format("the thread {} of this process, named '{}',", thread, name);
  return fmt::format("'{}' (process {})", name, process);
}

bool shares_cpu(const std::vector<int>& a, const std::vector<int>& b) {
  return std::find_first_of(a.begin(), a.end(), b.begin(), b.end()) != a.end();
}

/// The policy and the priority of a thread of any process.
struct Urgency {
  int policy = -1, priority = 0;

  static Urgency of(int thread) {
    sched_param parameters{};
    const int policy = sched_getscheduler(thread);
    if (policy < 0 || sched_getparam(thread, &parameters) != 0) return {};
    return {policy & ~SCHED_RESET_ON_FORK, parameters.sched_priority};
  }
  bool has_ended() const { return policy < 0; }
  bool is_realtime() const {
    return policy == SCHED_FIFO || policy == SCHED_RR || policy == SCHED_DEADLINE;
  }
};

/// Caches the urgency of threads during one look.
class Urgencies {
 public:
  Urgency of(std::uint32_t thread) {
    const auto [known, is_new] = known_.try_emplace(thread);
    if (is_new) known->second = Urgency::of(static_cast<int>(thread));
    return known->second;
  }
  /// A thread with a reservation yields to any other when its budget is used up: not a preemption.
  bool may_preempt(std::uint32_t thread, const ThreadState& waited) {
    return waited.policy != ThreadPolicy::deadline || of(thread).policy == SCHED_DEADLINE;
  }
  /// A thread that is as urgent, and goes to sleep when one of ours is switched in, has delayed it.
  bool was_before(std::uint32_t thread, const ThreadState& waited) {
    const Urgency other = of(thread);
    if (waited.policy == ThreadPolicy::deadline) return other.policy == SCHED_DEADLINE;
    return other.has_ended() || other.policy == SCHED_DEADLINE ||
           (other.is_realtime() && other.priority >= waited.priority);
  }

 private:
  std::map<std::uint32_t, Urgency> known_;
};

std::vector<ThreadState> realtime_ones(const std::vector<int>& threads) {
  std::vector<ThreadState> result;
  for (const int thread : threads) {
    ThreadState state = thread_state(thread);
    if (is_realtime(state.policy)) result.push_back(std::move(state));
  }
  return result;
}

}  // namespace

Preemptions::Preemptions() = default;
Preemptions::~Preemptions() = default;

void Preemptions::begin(const std::vector<int>& threads, const std::set<int>& cpus) {
  try {
    for (const int cpu : cpus) {
      records_.push_back(std::make_unique<SwitchRecords>(cpu, SwitchRecords::Full::loses));
    }
  } catch (const Error& error) {
    records_.clear();
    note_ = fmt::format("who ran before the threads of callbacks was checked coarsely: {}",
                        error.what());
  }
  look(threads);  // sets the baseline
}

std::vector<Preemptions::Found> Preemptions::look(const std::vector<int>& threads) {
  return records_.empty() ? by_counts(threads) : by_records(threads);
}

std::vector<Preemptions::Found> Preemptions::by_records(const std::vector<int>& threads) {
  const std::vector<ThreadState> ours = realtime_ones(threads);
  const auto own = static_cast<std::uint32_t>(getpid());
  const auto find = [&](std::uint32_t thread) {
    return std::find_if(ours.begin(), ours.end(), [&](const ThreadState& state) {
      return state.tid == static_cast<int>(thread);
    });
  };
  const auto is_ours = [&](std::uint32_t process, std::uint32_t thread) {
    return thread == 0 || (process == own && find(thread) != ours.end());  // 0: the idle thread
  };
  Urgencies others;
  std::map<std::pair<std::string, std::string>, Found> found;
  const auto add = [&](std::uint32_t process, std::uint32_t thread, const ThreadState& waited) {
    const std::string by =
        found.size() < kMostPreemptors ? name_of_process_thread(process, thread) : "others";
    Found& one = found[{by, waited.name}];
    if (!others.of(thread).is_realtime() && !others.of(thread).has_ended())
      one.id = "rt_runtime_as_here";
    one.by = by;
    one.thread = waited.name;
    ++one.count;
  };
  for (const auto& records : records_) {
    const bool is_complete = records->visit([&](const SwitchRecords::Switch& change) {
      const auto gone = find(change.thread);
      const auto come = find(change.next_thread);
      if (change.was_preempted && change.process == own && gone != ours.end()) {
        if (!is_ours(change.next_process, change.next_thread) &&
            others.may_preempt(change.next_thread, *gone))
          add(change.next_process, change.next_thread, *gone);
      } else if (!change.was_preempted && change.next_process == own && come != ours.end()) {
        if (!is_ours(change.process, change.thread) && others.was_before(change.thread, *come))
          add(change.process, change.thread, *come);
      }
    });
    if (!is_complete && note_.empty()) {
      note_ = "switches of threads were too many to be recorded: some were not seen";
    }
  }
  std::vector<Found> result;
  for (auto& [key, one] : found) result.push_back(std::move(one));
  return result;
}

// Counts of a thread that other threads of the file may preempt are inconclusive.
std::vector<Preemptions::Found> Preemptions::by_counts(const std::vector<int>& threads) {
  const std::vector<ThreadState> ours = realtime_ones(threads);
  std::vector<Found> result;
  for (const ThreadState& thread : ours) {
    const auto usage = thread_usage(thread.tid);
    if (!usage) continue;
    const auto [before, is_new] = counts_.try_emplace(thread.tid, usage->involuntary_switches);
    const std::uint64_t count = usage->involuntary_switches - before->second;
    before->second = usage->involuntary_switches;
    const bool has_rival = std::any_of(ours.begin(), ours.end(), [&](const ThreadState& other) {
      return other.tid != thread.tid && shares_cpu(other.affinity, thread.affinity) &&
             (other.policy == ThreadPolicy::deadline || other.priority >= thread.priority);
    });
    if (is_new || has_rival || count == 0 || thread.policy == ThreadPolicy::deadline) continue;
    result.push_back({.thread = thread.name, .count = count});
  }
  return result;
}

}  // namespace takt
