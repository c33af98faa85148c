// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/spin_always.hpp"

#include <algorithm>
#include <set>

#include <fmt/format.h>
#include <unistd.h>

#include "takt/base/error.hpp"

namespace takt {
namespace {

constexpr const char* kInstead = "or spin for a time, such as 50us";

std::string name_of(const ThreadAttributes& thread) {
  return thread.name.empty() ? "a thread" : fmt::format("thread '{}'", thread.name);
}

void check_alone(const ThreadAttributes& thread) {
  const std::string what = fmt::format("{} never sleeps (`spin: always`) and has {}",
                                       name_of(thread), to_string(thread.policy));
  if (thread.policy == ThreadPolicy::deadline) {
    throw Error(what + ", whose runtime it would use up",
                fmt::format("choose another policy, {}", kInstead));
  }
  if (is_realtime(thread.policy) && thread.affinity.size() != 1) {
    throw Error(what + " without a CPU of its own",
                fmt::format("give it an affinity of one CPU, {}", kInstead));
  }
}

void check_beside(const ThreadAttributes& thread, const ThreadAttributes& other) {
  if (!is_realtime(thread.policy) || other.policy == ThreadPolicy::deadline) return;
  const int cpu = thread.affinity.front();
  if (!other.affinity.empty() &&
      std::find(other.affinity.begin(), other.affinity.end(), cpu) == other.affinity.end()) {
    return;
  }
  throw Error(
      fmt::format("{} never sleeps (`spin: always`) and has {} on CPU {}, where {} may run, "
                  "too",
                  name_of(thread), to_string(thread.policy), cpu, name_of(other)),
      fmt::format("give that one an affinity without CPU {}, {}", cpu, kInstead));
}

}  // namespace

void check_spin(const ExecutorOptions& options, std::span<const ThreadAttributes> threads) {
  const auto check = [&](const char* option, Nanoseconds time) {
    if (time >= Nanoseconds::zero() && time <= kMostSpin) return;
    throw Error(fmt::format("executor '{}': {} is {}", options.name, option, to_string(time)),
                "write 0 to " + to_string(kMostSpin));
  };
  check("early_wake", options.early_wake);
  if (options.spin == kSpinAlways) return check_spin_always(threads);
  check("spin", options.spin);
}

void check_spin_always(std::span<const ThreadAttributes> spinning,
                       std::span<const ThreadAttributes> others) {
  check_spin_always(spinning, others, static_cast<std::size_t>(sysconf(_SC_NPROCESSORS_ONLN)));
}

void check_spin_always(std::span<const ThreadAttributes> spinning,
                       std::span<const ThreadAttributes> others, std::size_t cpus) {
  std::set<int> own;
  std::size_t anywhere = 0;
  for (const ThreadAttributes& thread : spinning) {
    check_alone(thread);
    for (const ThreadAttributes& other : spinning) {
      if (&other != &thread) check_beside(thread, other);
    }
    for (const ThreadAttributes& other : others) check_beside(thread, other);
    if (thread.affinity.size() == 1) {
      own.insert(thread.affinity.front());
    } else {
      ++anywhere;
    }
  }
  if (spinning.empty() || own.size() + anywhere < cpus) return;
  throw Error(
      fmt::format("threads that never sleep (`spin: always`) would take all {} CPUs", cpus),
      fmt::format("leave one to the rest of the system: spin with fewer threads, {}", kInstead));
}

}  // namespace takt
