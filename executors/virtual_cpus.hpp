// Threads on the virtual CPUs of a manual clock.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_VIRTUAL_CPUS_HPP_
#define TAKT_EXECUTORS_VIRTUAL_CPUS_HPP_

#include <algorithm>
#include <cstddef>
#include <thread>

#include "takt/base/manual_clock.hpp"

namespace takt {

/// Whether the clock simulates CPUs: then the attributes of threads apply there, and this system
/// gives them nothing but a name.
/// Thread safety: from any thread. Real-time: no.
inline bool has_virtual_cpus(Clock& clock) {
  const ManualClock* const manual = clock.as_manual();
  return manual != nullptr && manual->has_cpus();
}

/// How many threads a pool has, unless its options say.
inline std::size_t threads_of_pool(Clock& clock) {
  const ManualClock* const manual = clock.as_manual();
  const std::size_t cpus = manual != nullptr && manual->has_cpus()
                               ? manual->cpus()
                               : std::thread::hardware_concurrency();
  return std::max<std::size_t>(2, cpus);
}

}  // namespace takt

#endif  // TAKT_EXECUTORS_VIRTUAL_CPUS_HPP_
