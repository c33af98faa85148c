// The CPU time and memory of a process.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_PROCESS_USAGE_HPP_
#define TAKT_CONTAINERS_PROCESS_USAGE_HPP_

#include <cstdint>

#include <sys/types.h>

#include "takt/base/time.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_INTERNAL takt {

/// The CPU time of all threads of this process (0), also of those that have ended; or of those that
/// another process has now.
Nanoseconds process_cpu_time(pid_t process = 0);

/// The memory of a process (0: this one), of which shared pages count in proportion; 0 if the
/// kernel does not tell.
std::uint64_t proportional_set_size_kb(pid_t process = 0);

}  // namespace takt

#endif  // TAKT_CONTAINERS_PROCESS_USAGE_HPP_
