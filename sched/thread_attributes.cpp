// SPDX-License-Identifier: Apache-2.0
#include "takt/sched/thread_attributes.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <pthread.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>

#include "takt/base/error.hpp"

namespace takt {
namespace {

struct PolicyName {
  ThreadPolicy policy;
  int number;
  std::string_view name;
};
constexpr std::array<PolicyName, 5> kPolicies{{{ThreadPolicy::other, SCHED_OTHER, "SCHED_OTHER"},
                                               {ThreadPolicy::fifo, SCHED_FIFO, "SCHED_FIFO"},
                                               {ThreadPolicy::rr, SCHED_RR, "SCHED_RR"},
                                               {ThreadPolicy::batch, SCHED_BATCH, "SCHED_BATCH"},
                                               {ThreadPolicy::idle, SCHED_IDLE, "SCHED_IDLE"}}};

int number_of(ThreadPolicy policy) { return kPolicies[static_cast<std::size_t>(policy)].number; }

std::vector<int> affinity_of_this_thread() {
  cpu_set_t set;
  CPU_ZERO(&set);
  sched_getaffinity(0, sizeof set, &set);
  std::vector<int> cpus;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(cpu, &set)) cpus.push_back(cpu);
  }
  return cpus;
}

bool has_priority(ThreadPolicy policy) {
  return policy == ThreadPolicy::fifo || policy == ThreadPolicy::rr;
}

std::string why(int error_number) {
  if (error_number != EPERM) return errno_message(error_number);
  rlimit limit{};
  getrlimit(RLIMIT_RTPRIO, &limit);
  return fmt::format(
      "{} (RLIMIT_RTPRIO is {}; give the user rtprio in /etc/security/limits.conf, or the program "
      "CAP_SYS_NICE; a cgroup without cpu.rt_runtime_us refuses even root)",
      errno_message(error_number), limit.rlim_cur);
}

}  // namespace

std::string_view to_string(ThreadPolicy policy) noexcept {
  return kPolicies[static_cast<std::size_t>(policy)].name;
}

ThreadPolicy thread_policy(std::string_view name) {
  std::vector<std::string> valid;
  for (const PolicyName& known : kPolicies) {
    if (known.name == name) return known.policy;
    valid.emplace_back(known.name);
  }
  throw Error(fmt::format("there is no thread policy '{}'", name), suggest(name, valid));
}

const std::vector<int>& available_cpus() {
  static const std::vector<int> cpus = affinity_of_this_thread();
  return cpus;
}
// Asked when the library is loaded, before any thread has narrowed its own affinity.
[[maybe_unused]] static const std::size_t kAskedEarly = available_cpus().size();

void ThreadAttributes::check() const {
  if (has_priority(policy)) {
    const int lowest = sched_get_priority_min(number_of(policy));
    const int highest = sched_get_priority_max(number_of(policy));
    if (priority < lowest || priority > highest) {
      throw Error(fmt::format("priority {} does not exist for {}", priority, to_string(policy)),
                  fmt::format("choose {} to {}", lowest, highest));
    }
    if (nice != 0) {
      throw Error(fmt::format("nice {} means nothing for {}", nice, to_string(policy)),
                  "leave it out, or choose SCHED_OTHER or SCHED_BATCH");
    }
  } else if (priority != 0) {
    throw Error(fmt::format("priority {} means nothing for {}", priority, to_string(policy)),
                "leave it out, or choose SCHED_FIFO or SCHED_RR");
  }
  if (nice < -20 || nice > 19) {
    throw Error(fmt::format("nice {} does not exist", nice), "choose -20 to 19");
  }
  const std::vector<int> cpus = available_cpus();
  for (const int cpu : affinity) {
    if (std::find(cpus.begin(), cpus.end(), cpu) == cpus.end()) {
      throw Error(fmt::format("there is no CPU {} here", cpu),
                  fmt::format("choose from {}", fmt::join(cpus, ", ")));
    }
  }
}

ThreadState this_thread_state() {
  ThreadState state;
  std::array<char, 16> name{};
  pthread_getname_np(pthread_self(), name.data(), name.size());
  state.name = name.data();
  state.tid = static_cast<int>(syscall(SYS_gettid));
  const int policy = sched_getscheduler(0) & ~SCHED_RESET_ON_FORK;
  for (const PolicyName& known : kPolicies) {
    if (known.number == policy) state.policy = known.policy;
  }
  sched_param parameters{};
  sched_getparam(0, &parameters);
  state.priority = parameters.sched_priority;
  // The system call, not getpriority(): the kernel's nice value belongs to the thread.
  state.nice = getpriority(PRIO_PROCESS, static_cast<id_t>(state.tid));
  state.affinity = affinity_of_this_thread();
  return state;
}

ThreadState apply(const ThreadAttributes& attributes, Realtime realtime) {
  attributes.check();
  std::string refused;
  const auto refuse = [&](const std::string& what, int error_number) {
    refused += (refused.empty() ? "" : ", ") + what + ": " + why(error_number);
  };
  if (!attributes.name.empty()) {
    pthread_setname_np(pthread_self(), attributes.name.substr(0, 15).c_str());
  }
  if (!attributes.affinity.empty()) {
    cpu_set_t set;
    CPU_ZERO(&set);
    for (const int cpu : attributes.affinity) CPU_SET(static_cast<unsigned>(cpu), &set);
    if (sched_setaffinity(0, sizeof set, &set) != 0) refuse("affinity", errno);
  }
  if (realtime != Realtime::off) {
    sched_param parameters{};
    parameters.sched_priority = attributes.priority;
    if (sched_setscheduler(0, number_of(attributes.policy), &parameters) != 0) {
      refuse(fmt::format("{} {}", to_string(attributes.policy), attributes.priority), errno);
    }
    if (!has_priority(attributes.policy) && attributes.policy != ThreadPolicy::idle &&
        getpriority(PRIO_PROCESS, 0) != attributes.nice &&
        setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), attributes.nice) != 0) {
      refuse(fmt::format("nice {}", attributes.nice), errno);
    }
  }
  if (!refused.empty() && realtime == Realtime::require) {
    throw Error(fmt::format("thread '{}' was refused {}", attributes.name, refused),
                "grant it, or write `realtime: prefer` to go on without");
  }
  ThreadState state = this_thread_state();
  state.refused = refused;
  return state;
}

}  // namespace takt
