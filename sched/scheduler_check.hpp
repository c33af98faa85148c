// Whether a scheduler keeps its side of the interface: for those that others write.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_SCHED_SCHEDULER_CHECK_HPP_
#define TAKT_SCHED_SCHEDULER_CHECK_HPP_

#include <string_view>

#include "takt/sched/scheduler.hpp"

namespace takt {

/// Makes a few of these schedulers and drives them as executors do: at random, and the same way
/// each time. Throws Error when one loses, repeats or invents callbacks, allocates after
/// `configure` (found only where allocations_are_counted()), or throws. `name` is for the errors.
/// What never returns, or ends the process, cannot be found.
/// Thread safety: may be called from any thread.
/// Real-time: no; it takes about a millisecond.
void check_scheduler(std::string_view name, const SchedulerRegistry::Factory& make);

}  // namespace takt

#endif  // TAKT_SCHED_SCHEDULER_CHECK_HPP_
