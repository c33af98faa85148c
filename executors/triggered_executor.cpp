// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/triggered_executor.hpp"

namespace takt {

TriggeredExecutor::TriggeredExecutor(const ExecutorOptions& options)
    : DispatchingExecutor(options, {.readiness = Readiness::wait_set,
                                    .scheduler = "listed",
                                    .max_threads = 1,
                                    .triggered = true}) {
}

TAKT_REGISTER_EXECUTOR("triggered", "in the user's order when a trigger says so, or by LET (rclc)",
                       TriggeredExecutor)

}  // namespace takt
