// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/process_usage.hpp"

#include <filesystem>
#include <fstream>
#include <string>

#include <fmt/format.h>
#include <sys/resource.h>

namespace takt {

Nanoseconds process_cpu_time(pid_t process) {
  if (process != 0) {
    Nanoseconds sum{0};
    std::error_code gone;
    for (const auto& task :
         std::filesystem::directory_iterator(fmt::format("/proc/{}/task", process), gone)) {
      std::int64_t cpu_time_ns = 0;
      std::ifstream(task.path() / "schedstat") >> cpu_time_ns;
      sum += Nanoseconds(cpu_time_ns);
    }
    return sum;
  }
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto time = [](const timeval& value) {
    return std::chrono::seconds(value.tv_sec) + std::chrono::microseconds(value.tv_usec);
  };
  return time(usage.ru_utime) + time(usage.ru_stime);
}

std::optional<ThreadUsage> thread_usage(int tid) {
  const std::string task = fmt::format("/proc/self/task/{}/", tid);
  ThreadUsage usage;
  std::int64_t cpu_time_ns = 0;
  if (!(std::ifstream(task + "schedstat") >> cpu_time_ns)) return {};
  usage.cpu_time = Nanoseconds(cpu_time_ns);
  std::ifstream status(task + "status");
  for (std::string word; status >> word;) {
    if (word == "voluntary_ctxt_switches:") status >> usage.voluntary_switches;
    if (word == "nonvoluntary_ctxt_switches:") status >> usage.involuntary_switches;
  }
  return usage;
}

std::uint64_t proportional_set_size_kb(pid_t process) {
  std::ifstream file(process == 0 ? "/proc/self/smaps_rollup"
                                  : fmt::format("/proc/{}/smaps_rollup", process));
  for (std::string word; file >> word;) {
    if (word == "Pss:") {
      std::uint64_t kb = 0;
      file >> kb;
      return kb;
    }
  }
  return 0;
}

}  // namespace takt
