// Checks `spin` and `early_wake`, and that threads with `spin: always` have CPUs of their own.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_SPIN_ALWAYS_HPP_
#define TAKT_EXECUTORS_SPIN_ALWAYS_HPP_

#include <cstddef>
#include <span>

#include "takt/base/visibility.hpp"
#include "takt/executors/executor.hpp"
#include "takt/sched/threads/thread_attributes.hpp"

namespace TAKT_INTERNAL takt {

/// Throws Error if `spin` or `early_wake` is out of its limits, or if these threads, instead of
/// those of the options, cannot spin always.
void check_spin(const ExecutorOptions& options, std::span<const ThreadAttributes> threads);

/// Checks the threads that never sleep (`spinning`); `others` are those that do sleep. A thread
/// that never sleeps may not have SCHED_DEADLINE, whose runtime it would use up. With SCHED_FIFO or
/// SCHED_RR it would starve all others on its CPU: so it needs an affinity of one CPU, on which no
/// other thread may run, but of SCHED_DEADLINE. Together they must leave a CPU to the rest of the
/// system.
/// Throws Error with what to do. Set-up only.
void check_spin_always(std::span<const ThreadAttributes> spinning,
                       std::span<const ThreadAttributes> others = {});
/// The same on a machine with so many CPUs.
void check_spin_always(std::span<const ThreadAttributes> spinning,
                       std::span<const ThreadAttributes> others, std::size_t cpus);

}  // namespace takt

#endif  // TAKT_EXECUTORS_SPIN_ALWAYS_HPP_
