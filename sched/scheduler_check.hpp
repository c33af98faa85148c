// Checks that an external scheduler satisfies the interface.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_SCHED_SCHEDULER_CHECK_HPP_
#define TAKT_SCHED_SCHEDULER_CHECK_HPP_

#include <string_view>

#include "takt/base/visibility.hpp"
#include "takt/sched/scheduler.hpp"

namespace TAKT_INTERNAL takt {

/// Creates a few of these schedulers and uses them as executors do, with a fixed random sequence.
/// Throws Error if one loses, repeats or invents callbacks, allocates after configure() (detected
/// only if allocations_are_counted()), throws, or has not returned at the limit; then a thread
/// stays in it. `name` is used in errors. It cannot detect a scheduler that ends the process.
/// Thread safety: may be called from any thread.
/// Real-time: no; it takes about a millisecond.
void check_scheduler(std::string_view name, const std::function<std::unique_ptr<Scheduler>()>& make,
                     Nanoseconds limit = std::chrono::seconds(10));

}  // namespace takt

#endif  // TAKT_SCHED_SCHEDULER_CHECK_HPP_
