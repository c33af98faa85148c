// SPDX-License-Identifier: Apache-2.0
#include "takt/base/available_cpus.hpp"

#include <cstddef>

#include <sched.h>

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
// Asked when the library is loaded, before any thread has narrowed its own affinity.
[[maybe_unused]] static const std::size_t kAskedEarly = available_cpus().size();

bool use_available_cpus() {
  cpu_set_t set;
  CPU_ZERO(&set);
  for (const int cpu : available_cpus()) CPU_SET(static_cast<unsigned>(cpu), &set);
  return sched_setaffinity(0, sizeof set, &set) == 0;
}

}  // namespace takt
