// Priorities, executors and CPUs from chains, as PiCAS assigns them.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_SCHED_PICAS_HPP_
#define TAKT_SCHED_PICAS_HPP_

#include <cstddef>
#include <limits>
#include <vector>

#include "takt/base/visibility.hpp"

namespace takt {
namespace TAKT_PUBLIC picas {

/// The data of a callback. A unit is what an executor is given as a whole: a callback group.
struct Callback {
  std::size_t unit = 0;
  double utilisation = 0;  // of one CPU; 0: not known
  bool is_placed = false;  // its unit has an executor already
};
struct Chain {
  int priority = 0;                    // larger is more critical; equal ones: the first in the list
  std::vector<std::size_t> callbacks;  // its path
};

inline constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

struct Assignment {
  struct Executor {
    std::size_t chain;    // whose it is
    int thread_priority;  // for SCHED_FIFO
    int cpu;
    double utilisation;
  };
  std::vector<std::size_t> chain_of_callback;  // the most critical one; kNone outside chains
  std::vector<int> callback_priority;          // larger is more urgent; 0 outside chains
  std::vector<std::size_t> executor_of_unit;   // kNone: no chain needs it
  std::vector<Executor> executors;             // the most critical first
};

/// The rules of Choi, Xiang, Kim: "PiCAS: New Design of Priority-Driven Chain-Aware Scheduling for
/// ROS2" (RTAS 2021), section V:
/// I.   Inside a chain the later callback is more urgent than the earlier one.
/// II.  Every callback of a more critical chain is more urgent than every one of a less critical
///      chain. A callback of several chains belongs to the most critical.
/// III. Each chain has an executor of its own, which gets the units of the chain that no more
///      critical chain has. Units that are placed already are left out; a chain without others has
///      none.
/// IV.  The executor of the more critical chain has the larger thread priority.
/// V.   An executor stays on one CPU, for which the least used one is taken, the most critical
/// chain
///      first.
/// What PiCAS says about best-effort callbacks is left to the caller: their units are kNone.
/// Thread priorities are `highest` and downwards, but never less than 1; `cpus` is not empty.
Assignment assign(const std::vector<Callback>& callbacks, const std::vector<Chain>& chains,
                  const std::vector<int>& cpus, int highest);

}  // namespace picas
}  // namespace takt

#endif  // TAKT_SCHED_PICAS_HPP_
