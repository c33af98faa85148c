// SPDX-License-Identifier: Apache-2.0
#include "doctor/rights.hpp"

#include <filesystem>
#include <thread>

#include <fmt/format.h>
#include <pwd.h>
#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include "takt/sched/threads/thread_attributes.hpp"

namespace takt::tools::doctor_command {
namespace {

namespace fs = std::filesystem;

std::string limit_text(rlim_t limit, rlim_t unit = 1) {
  return limit == RLIM_INFINITY ? "unlimited" : std::to_string(limit / unit);
}

/// Tries the policy instead of deriving the answer from privileges: only the kernel knows all
/// rules.
bool grants(int policy, int priority) {
  sched_param parameters{};
  parameters.sched_priority = priority;
  sched_param before{};
  sched_getparam(0, &before);
  const int old_policy = sched_getscheduler(0);
  if (sched_setscheduler(0, policy, &parameters) != 0) return false;
  sched_setscheduler(0, old_policy, &before);
  return true;
}

std::string user() {
  const passwd* entry = getpwuid(geteuid());
  return entry != nullptr ? entry->pw_name : std::to_string(geteuid());
}

const std::string& group_for_user() {
  static const std::string commands =
      fmt::format("groupadd -f realtime; usermod -aG realtime {}", user());
  return commands;
}

/// What root does, so that this user may: root itself needs no limit, but may lack a capability.
Fix limit_for_user(const char* limit, const char* capability) {
  if (geteuid() == 0) {
    return {"", fmt::format("start the container with the capability: docker run --cap-add={}",
                            capability)};
  }
  return {fmt::format("{}; echo '@realtime - {}' >> /etc/security/limits.conf", group_for_user(),
                      limit),
          "; log in again"};
}

}  // namespace

Finding realtime_policy() {
  rlimit limit{};
  getrlimit(RLIMIT_RTPRIO, &limit);
  const bool granted = grants(SCHED_FIFO, 80);
  return {"SCHED_FIFO 80",
          "sched_setscheduler(2)",
          granted ? "granted"
                  : fmt::format("refused (RLIMIT_RTPRIO is {})", limit_text(limit.rlim_cur)),
          granted ? Verdict::good : Verdict::bad,
          "without it, every other process can delay a callback",
          limit_for_user("rtprio 95", "sys_nice")};
}

Finding reservations() {
  std::string refused;
  std::thread([&] {
    refused = apply({.policy = ThreadPolicy::deadline,
                     .runtime = std::chrono::microseconds(100),
                     .period = std::chrono::milliseconds(10)},
                    Realtime::prefer)
                  .refused;
  }).join();
  return {"SCHED_DEADLINE 0.1ms/10ms",
          "sched_setattr(2)",
          refused.empty() ? "granted" : refused,
          refused.empty() ? Verdict::good : Verdict::note,
          "a thread with a reservation gets its CPU time whatever other threads do, and no more",
          {"", fmt::format("setpriv --reuid={0} --regid=$(id -g {0}) --init-groups "
                           "--inh-caps=+sys_nice --ambient-caps=+sys_nice takt run FILE; do not "
                           "restrict its CPUs (taskset, cpuset)",
                           user())}};
}

Finding locked_memory() {
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  const bool may = limit.rlim_cur == RLIM_INFINITY || geteuid() == 0;
  return {"locked memory",
          "getrlimit(2) RLIMIT_MEMLOCK",
          limit.rlim_cur == RLIM_INFINITY ? "unlimited" : limit_text(limit.rlim_cur, 1024) + " KiB",
          may ? Verdict::good : Verdict::bad,
          "a page fault on unlocked memory can read from disk in the middle of a callback",
          limit_for_user("memlock unlimited", "ipc_lock")};
}

Finding nice_limit() {
  rlimit limit{};
  getrlimit(RLIMIT_NICE, &limit);
  const bool may = limit.rlim_cur >= 40 || limit.rlim_cur == RLIM_INFINITY || geteuid() == 0;
  return {"negative nice values",
          "getrlimit(2) RLIMIT_NICE",
          may ? "granted" : fmt::format("down to {}", 20 - static_cast<long>(limit.rlim_cur)),
          may ? Verdict::good : Verdict::note,
          "SCHED_OTHER threads with nice below 0 need it",
          limit_for_user("nice -20", "sys_nice")};
}

Finding dma_latency() {
  const bool may = access("/dev/cpu_dma_latency", W_OK) == 0;
  const bool exists = fs::exists("/dev/cpu_dma_latency");
  return {"cpu_dma_latency",
          "/dev/cpu_dma_latency",
          may      ? "writable"
          : exists ? "not writable"
                   : "missing",
          may ? Verdict::good : Verdict::note,
          "with value 0 it keeps CPUs out of slow idle states while Takt runs",
          exists ? Fix{fmt::format("{}; chgrp realtime /dev/cpu_dma_latency; chmod g+w "
                                   "/dev/cpu_dma_latency",
                                   group_for_user()),
                       "; log in again"}
                 : Fix{"", "build the kernel with CONFIG_CPU_IDLE and CONFIG_PM"}};
}

}  // namespace takt::tools::doctor_command
