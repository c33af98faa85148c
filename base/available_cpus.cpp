// SPDX-License-Identifier: Apache-2.0
#include "takt/base/available_cpus.hpp"

#include <algorithm>
#include <cstddef>
#include <thread>

#include <sched.h>
#include <unistd.h>

namespace takt {

const std::vector<int>& available_cpus() {
  static const std::vector<int> cpus = [] {
    cpu_set_t set;
    CPU_ZERO(&set);
    sched_getaffinity(0, sizeof set, &set);
    std::vector<int> result;
    for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
      if (CPU_ISSET(cpu, &set)) result.push_back(cpu);
    }
    return result;
  }();
  return cpus;
}
namespace {

std::vector<int> cpus_to_move_to() {
  std::vector<int> result;
  const long configured = std::min<long>(sysconf(_SC_NPROCESSORS_CONF), CPU_SETSIZE);
  const std::vector<int>& given = available_cpus();
  for (int cpu = 0; cpu < configured || cpu <= given.back(); ++cpu) {
    cpu_set_t wanted, has;
    CPU_ZERO(&wanted);
    CPU_ZERO(&has);
    CPU_SET(static_cast<unsigned>(cpu), &wanted);
    const bool is_given = std::binary_search(given.begin(), given.end(), cpu);
    const bool may_move =
        is_given || (sched_setaffinity(0, sizeof wanted, &wanted) == 0 &&
                     sched_getaffinity(0, sizeof has, &has) == 0 && CPU_EQUAL(&wanted, &has));
    if (may_move) result.push_back(cpu);
  }
  return result;
}

}  // namespace

const std::vector<int>& usable_cpus() {
  static const std::vector<int> cpus = [] {
    std::vector<int> result;
    std::thread([&] { result = cpus_to_move_to(); }).join();
    return result;
  }();
  return cpus;
}
// Reads the CPUs when the library is loaded, before a thread narrows its own affinity.
[[maybe_unused]] static const std::size_t kAskedEarly = available_cpus().size();

bool use_available_cpus() {
  cpu_set_t set;
  CPU_ZERO(&set);
  for (const int cpu : available_cpus()) CPU_SET(static_cast<unsigned>(cpu), &set);
  return sched_setaffinity(0, sizeof set, &set) == 0;
}

}  // namespace takt
