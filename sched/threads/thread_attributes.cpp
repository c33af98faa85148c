// SPDX-License-Identifier: Apache-2.0
#include "takt/sched/threads/thread_attributes.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <pthread.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/utsname.h>
#include <unistd.h>

#include "takt/base/error.hpp"

namespace takt {
namespace {

struct PolicyName {
  ThreadPolicy policy;
  int number;
  std::string_view name;
};
constexpr std::array<PolicyName, 6> kPolicies{
    {{ThreadPolicy::other, SCHED_OTHER, "SCHED_OTHER"},
     {ThreadPolicy::fifo, SCHED_FIFO, "SCHED_FIFO"},
     {ThreadPolicy::rr, SCHED_RR, "SCHED_RR"},
     {ThreadPolicy::batch, SCHED_BATCH, "SCHED_BATCH"},
     {ThreadPolicy::idle, SCHED_IDLE, "SCHED_IDLE"},
     {ThreadPolicy::deadline, SCHED_DEADLINE, "SCHED_DEADLINE"}}};

/// The kernel's `struct sched_attr`, first version. glibc has the type and its functions since
/// 2.41.
struct KernelAttributes {
  std::uint32_t size = sizeof(KernelAttributes);
  std::uint32_t policy = 0;
  std::uint64_t flags = 0;
  std::int32_t nice = 0;
  std::uint32_t priority = 0;
  std::uint64_t runtime = 0, deadline = 0, period = 0;
};
/// Without this flag, a SCHED_DEADLINE thread cannot start threads, as they would inherit its
/// reservation.
constexpr std::uint64_t kResetOnFork = 1;
/// The kernel refuses a shorter runtime.
constexpr Nanoseconds kLeastRuntime{1024};

int number_of(ThreadPolicy policy) {
  return kPolicies[static_cast<std::size_t>(policy)].number;
}

std::vector<int> affinity_of(int tid) {
  cpu_set_t set;
  CPU_ZERO(&set);
  sched_getaffinity(tid, sizeof set, &set);
  std::vector<int> cpus;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(cpu, &set)) cpus.push_back(cpu);
  }
  return cpus;
}

bool has_priority(ThreadPolicy policy) {
  return policy == ThreadPolicy::fifo || policy == ThreadPolicy::rr;
}

std::string milliseconds(Nanoseconds duration) {
  return fmt::format("{}ms", static_cast<double>(duration.count()) / 1e6);
}

Nanoseconds deadline_of(const ThreadAttributes& attributes) {
  return attributes.deadline == Nanoseconds::zero() ? attributes.period : attributes.deadline;
}

// The requested policy with its parameters, as text.
std::string asked_text(const ThreadAttributes& asked) {
  if (asked.policy != ThreadPolicy::deadline) {
    return fmt::format("{} {}", to_string(asked.policy), asked.priority);
  }
  return fmt::format("{} {}/{}", to_string(asked.policy), milliseconds(asked.runtime),
                     milliseconds(asked.period));
}

// Returns the error number, or 0.
int set_policy(const ThreadAttributes& attributes) {
  const int policy = number_of(attributes.policy);
  if (attributes.policy == ThreadPolicy::deadline) {
    const KernelAttributes reservation{
        .policy = static_cast<std::uint32_t>(policy),
        .flags = kResetOnFork,
        .runtime = static_cast<std::uint64_t>(attributes.runtime.count()),
        .deadline = static_cast<std::uint64_t>(deadline_of(attributes).count()),
        .period = static_cast<std::uint64_t>(attributes.period.count())};
    return syscall(SYS_sched_setattr, 0, &reservation, 0) == 0 ? 0 : errno;
  }
  sched_param parameters{};
  parameters.sched_priority = attributes.priority;
  return sched_setscheduler(0, policy, &parameters) == 0 ? 0 : errno;
}

// Returns the error number, or 0. An empty list means all CPUs, not those of the creating thread.
int set_affinity(const std::vector<int>& affinity) {
  if (affinity.empty()) {
    return affinity_of(0) == available_cpus() || use_available_cpus() ? 0 : errno;
  }
  cpu_set_t set;
  CPU_ZERO(&set);
  for (const int cpu : affinity) CPU_SET(static_cast<unsigned>(cpu), &set);
  return sched_setaffinity(0, sizeof set, &set) == 0 ? 0 : errno;
}

// Applies one more limit to the grant; a runtime of -1 is no limit.
void limit(RealtimeGrant& grant, double runtime_us, double period_us) {
  if (runtime_us < 0 || period_us <= 0 || runtime_us >= period_us) return;
  const auto nanoseconds = [](double us) { return Nanoseconds(std::llround(1e3 * us)); };
  const double share = std::min(grant.share(), runtime_us / period_us);
  const Nanoseconds period =
      std::max(grant.is_limited() ? grant.period : Nanoseconds::zero(), nanoseconds(period_us));
  grant = {.runtime = nanoseconds(share * static_cast<double>(period.count()) / 1e3),
           .period = period};
}

// Applies the limit of this process's control group; only cgroup v1 has one.
void limit_by_group(RealtimeGrant& grant) {
  std::ifstream groups("/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {  // "4:cpu,cpuacct:/robot"
    const std::size_t names = line.find(':'), path = line.find(':', names + 1);
    if (path == line.npos) continue;
    const std::string controllers = line.substr(names, path - names) + ",";
    if (controllers.find(":cpu,") == line.npos && controllers.find(",cpu,") == line.npos) continue;
    const std::string own = line.substr(path + 1);
    for (const std::string& group : {own, std::string("/")}) {  // then a container's root
      double runtime_us = -1, period_us = 1;
      std::ifstream(fmt::format("/sys/fs/cgroup/cpu{}/cpu.rt_runtime_us", group)) >> runtime_us;
      std::ifstream(fmt::format("/sys/fs/cgroup/cpu{}/cpu.rt_period_us", group)) >> period_us;
      limit(grant, runtime_us, period_us);
    }
    return;
  }
}

// The limit for all real-time threads of the machine, without control groups.
RealtimeGrant grant_of_kernel() {
  double runtime_us = -1, period_us = 1;
  std::ifstream("/proc/sys/kernel/sched_rt_runtime_us") >> runtime_us;
  std::ifstream("/proc/sys/kernel/sched_rt_period_us") >> period_us;
  RealtimeGrant result;
  limit(result, runtime_us, period_us);
  return result;
}

// The shortest and the longest period that the kernel admits; older ones have no such settings.
std::pair<Nanoseconds, Nanoseconds> periods_to_reserve() {
  std::int64_t least_us = 100, most_us = std::int64_t{1} << 22;
  std::ifstream("/proc/sys/kernel/sched_deadline_period_min_us") >> least_us;
  std::ifstream("/proc/sys/kernel/sched_deadline_period_max_us") >> most_us;
  return {std::chrono::microseconds(least_us), std::chrono::microseconds(most_us)};
}

// How many CPUs SCHED_DEADLINE threads may reserve in all.
double cpus_to_reserve() {
  return static_cast<double>(available_cpus().size()) * grant_of_kernel().share();
}

std::string why_not_reserved(int error_number) {
  std::string reason = errno_message(error_number);
  if (error_number == EPERM) {
    reason += " (it takes CAP_SYS_NICE, no rtprio is enough";
    const std::vector<int> cpus = affinity_of(0);
    if (const long all = sysconf(_SC_NPROCESSORS_ONLN); static_cast<long>(cpus.size()) < all) {
      reason += fmt::format(
          "; and this thread may use CPU {} only, of {}: start the process on all, or in an "
          "exclusive cpuset",
          fmt::join(cpus, ", "), all);
    }
    reason += ")";
  } else if (error_number == EBUSY) {
    reason += fmt::format(
        " (with what other threads and processes have, and newer kernels keep for SCHED_OTHER, it "
        "is more than the {:.4g} CPUs that kernel.sched_rt_runtime_us leaves)",
        cpus_to_reserve());
  } else if (error_number == EINVAL) {
    reason +=
        " (the period must lie between kernel.sched_deadline_period_min_us and "
        "kernel.sched_deadline_period_max_us)";
  }
  return reason;
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

/// Why the kernel would end a process with real-time threads; empty: it would not.
std::string why_it_would_end(ThreadPolicy policy) {
  rlimit limit{};
  getrlimit(RLIMIT_RTTIME, &limit);
  if (limit.rlim_cur == RLIM_INFINITY || !has_priority(policy)) return {};
  return fmt::format(
      "RLIMIT_RTTIME is {} us, and Linux ends a process of which a real-time thread runs for "
      "longer without sleeping; `ulimit -R unlimited` lifts that",
      limit.rlim_cur);
}

}  // namespace

bool is_realtime(ThreadPolicy policy) noexcept {
  return has_priority(policy) || policy == ThreadPolicy::deadline;
}

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

void ThreadAttributes::check() const {
  check_priority();
  check_nice();
  check_reservation();
  check_affinity();
}

void ThreadAttributes::check_priority() const {
  if (has_priority(policy)) {
    const int lowest = sched_get_priority_min(number_of(policy));
    const int highest = sched_get_priority_max(number_of(policy));
    if (priority < lowest || priority > highest) {
      throw Error(fmt::format("priority {} does not exist for {}", priority, to_string(policy)),
                  fmt::format("choose {} to {}", lowest, highest));
    }
  } else if (priority != 0) {
    throw Error(fmt::format("priority {} means nothing for {}", priority, to_string(policy)),
                "leave it out, or choose SCHED_FIFO or SCHED_RR");
  }
}

void ThreadAttributes::check_nice() const {
  if (nice != 0 && is_realtime(policy)) {
    throw Error(fmt::format("nice {} means nothing for {}", nice, to_string(policy)),
                "leave it out, or choose SCHED_OTHER or SCHED_BATCH");
  }
  if (nice < -20 || nice > 19) {
    throw Error(fmt::format("nice {} does not exist", nice), "choose -20 to 19");
  }
}

void ThreadAttributes::check_reservation() const {
  constexpr Nanoseconds kNone{0};
  if (policy != ThreadPolicy::deadline) {
    if (runtime == kNone && deadline == kNone && period == kNone) return;
    throw Error(fmt::format("runtime, deadline and period mean nothing for {}", to_string(policy)),
                "leave them out, or choose SCHED_DEADLINE");
  }
  if (runtime == kNone || period == kNone) {
    throw Error("SCHED_DEADLINE needs a runtime and a period", "give both, such as 2ms and 10ms");
  }
  if (runtime < kLeastRuntime) {
    throw Error(fmt::format("runtime {} is too short", milliseconds(runtime)),
                "give at least " + to_string(kLeastRuntime));
  }
  if (const auto [least, most] = periods_to_reserve(); period < least || period > most) {
    throw Error(
        fmt::format("Linux refuses a period of {}", milliseconds(period)),
        fmt::format("give one from {} to {}, or set kernel.sched_deadline_period_{}_us",
                    milliseconds(least), milliseconds(most), period < least ? "min" : "max"));
  }
  if (deadline_of(*this) > period) {
    throw Error(fmt::format("deadline {} is longer than period {}", milliseconds(deadline),
                            milliseconds(period)),
                "shorten the deadline, or leave it out: it is the period then");
  }
  if (runtime > deadline_of(*this)) {
    throw Error(
        fmt::format("runtime {} is longer than {} {}", milliseconds(runtime),
                    deadline == kNone ? "period" : "deadline", milliseconds(deadline_of(*this))),
        "shorten the runtime");
  }
}

void ThreadAttributes::check_affinity() const {
  if (!affinity.empty() && policy == ThreadPolicy::deadline) {
    throw Error("the kernel refuses SCHED_DEADLINE to a thread with an affinity",
                "leave it out, or run the process in an exclusive cpuset of these CPUs");
  }
  const auto has = [](const std::vector<int>& cpus, int cpu) {
    return std::find(cpus.begin(), cpus.end(), cpu) != cpus.end();
  };
  for (const int cpu : affinity) {
    if (has(available_cpus(), cpu)) continue;
    if (const std::vector<int>& cpus = usable_cpus(); !has(cpus, cpu)) {
      throw Error(fmt::format("there is no CPU {} here", cpu),
                  fmt::format("choose from {}", fmt::join(cpus, ", ")));
    }
  }
}

void check_admission(std::span<const ThreadAttributes> threads) {
  check_admission(threads, cpus_to_reserve());
}

void check_admission(std::span<const ThreadAttributes> threads, double most_cpus) {
  double sum = 0;
  for (const ThreadAttributes& thread : threads) {
    if (thread.policy != ThreadPolicy::deadline) continue;
    sum += static_cast<double>(thread.runtime.count()) / static_cast<double>(thread.period.count());
  }
  constexpr double kRounding = 1e-9;  // 19 times 0.1 is a little more than 1.9
  if (sum <= most_cpus + kRounding) return;
  throw Error(
      fmt::format("SCHED_DEADLINE threads reserve {:.4g} CPUs, of {:.4g} that there are for them",
                  sum, most_cpus),
      "shorten runtimes, lengthen periods, or raise kernel.sched_rt_runtime_us");
}

std::string to_string(const RealtimeGrant& grant) {
  const std::string period =
      grant.period == std::chrono::seconds(1) ? "second" : to_string(grant.period);
  return fmt::format("{} of each {}", to_string(grant.runtime), period);
}

RealtimeGrant realtime_grant() {
  RealtimeGrant result = grant_of_kernel();
  limit_by_group(result);
  limit(result, 1e6 - std::chrono::duration<double, std::micro>(fair_server()).count(), 1e6);
  return result;
}

Nanoseconds turn_of_round_robin() {
  std::int64_t length_ms = 100;
  std::ifstream("/proc/sys/kernel/sched_rr_timeslice_ms") >> length_ms;
  return std::chrono::milliseconds(length_ms);
}

// The kernel's fair server takes 50 ms of each second of each CPU from real-time threads, unless
// configured otherwise.
Nanoseconds fair_server() {
  utsname kernel{};
  uname(&kernel);
  int major = 0, minor = 0;
  if (std::sscanf(kernel.release, "%d.%d", &major, &minor) != 2) return {};
  if (std::pair(major, minor) < std::pair(6, 12)) return {};
  double share = 0;
  for (const int cpu : available_cpus()) {
    double runtime = 50, period = 1000;
    std::ifstream(fmt::format("/sys/kernel/debug/sched/fair_server/cpu{}/runtime", cpu)) >> runtime;
    std::ifstream(fmt::format("/sys/kernel/debug/sched/fair_server/cpu{}/period", cpu)) >> period;
    share = std::max(share, period > 0 ? runtime / period : 1);
  }
  return std::chrono::microseconds(std::llround(1e6 * share));
}

// The resolution of the coarse clock is one tick.
Nanoseconds scheduler_tick() {
  timespec tick{};
  clock_getres(CLOCK_MONOTONIC_COARSE, &tick);
  return std::chrono::seconds(tick.tv_sec) + std::chrono::nanoseconds(tick.tv_nsec);
}

std::string cpus_outside(const ThreadState& state) {
  std::vector<int> others;
  const std::vector<int>& given = available_cpus();
  std::set_difference(state.affinity.begin(), state.affinity.end(), given.begin(), given.end(),
                      std::back_inserter(others));
  if (others.empty()) return "";
  return fmt::format(
      "thread '{}' runs on CPU {}, as its affinity says; this process was started on CPU {}",
      state.name, fmt::join(others, ", "), fmt::join(given, ", "));
}

ThreadState this_thread_state() {
  return thread_state(static_cast<int>(syscall(SYS_gettid)));
}

ThreadState thread_state(int tid) {
  ThreadState state;
  std::getline(std::ifstream(fmt::format("/proc/self/task/{}/comm", tid)), state.name);
  state.tid = tid;
  KernelAttributes attributes;
  syscall(SYS_sched_getattr, tid, &attributes, sizeof attributes, 0);
  for (const PolicyName& known : kPolicies) {
    if (known.number == static_cast<int>(attributes.policy)) state.policy = known.policy;
  }
  state.priority = static_cast<int>(attributes.priority);
  if (state.policy == ThreadPolicy::deadline) {  // else it may hold the time slice
    state.runtime = Nanoseconds(attributes.runtime);
    state.deadline = Nanoseconds(attributes.deadline);
    state.period = Nanoseconds(attributes.period);
  }
  // The system call, not getpriority(): the kernel's nice value belongs to the thread.
  state.nice = getpriority(PRIO_PROCESS, static_cast<id_t>(tid));
  state.affinity = affinity_of(tid);
  return state;
}

void wake_up_on_time() noexcept {
  thread_local constinit bool is_set = false;
  if (!std::exchange(is_set, true)) prctl(PR_SET_TIMERSLACK, 1);
}

ThreadState apply(const ThreadAttributes& attributes, Realtime realtime) {
  attributes.check();
  std::string refused;
  const auto refuse = [&](const std::string& what, const std::string& reason) {
    refused += (refused.empty() ? "" : ", ") + what + ": " + reason;
  };
  if (!attributes.name.empty()) {
    pthread_setname_np(pthread_self(), attributes.name.substr(0, 15).c_str());
  }
  if (const int error = set_affinity(attributes.affinity); error != 0) {
    refuse("affinity", why(error));
  }
  wake_up_on_time();
  if (realtime != Realtime::off) {
    const std::string end = why_it_would_end(attributes.policy);
    if (!end.empty()) {
      refuse(asked_text(attributes), end);
    } else if (const int error = set_policy(attributes); error != 0) {
      refuse(asked_text(attributes),
             attributes.policy == ThreadPolicy::deadline ? why_not_reserved(error) : why(error));
    }
    if (!is_realtime(attributes.policy) && attributes.policy != ThreadPolicy::idle &&
        getpriority(PRIO_PROCESS, 0) != attributes.nice &&
        setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), attributes.nice) != 0) {
      refuse(fmt::format("nice {}", attributes.nice), why(errno));
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
