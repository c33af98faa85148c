// The CPU time and memory of a process and its threads.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_PROCESS_USAGE_HPP_
#define TAKT_CONTAINERS_PROCESS_USAGE_HPP_

#include <cstdint>
#include <optional>

#include <sys/types.h>

#include "takt/base/time.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_INTERNAL takt {

/// The CPU time of all threads of this process (0), including ended ones; of another process, only
/// of the threads that it has now.
Nanoseconds process_cpu_time(pid_t process = 0);

/// What the kernel has counted of a thread of this process since its start.
struct ThreadUsage {
  Nanoseconds cpu_time{0};
  std::uint64_t voluntary_switches = 0, involuntary_switches = 0;
};
/// nullopt: the thread has ended.
std::optional<ThreadUsage> thread_usage(int tid);

/// The proportional set size of a process (0: this one): shared pages count in proportion. 0: the
/// kernel does not report it.
std::uint64_t proportional_set_size_kb(pid_t process = 0);

}  // namespace takt

#endif  // TAKT_CONTAINERS_PROCESS_USAGE_HPP_
