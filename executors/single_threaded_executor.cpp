// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/single_threaded_executor.hpp"

namespace takt {

SingleThreadedExecutor::SingleThreadedExecutor(const ExecutorOptions& options)
    : DispatchingExecutor(
          options, {.readiness = Readiness::wait_set, .scheduler = "ros", .max_threads = 1}) {
}

TAKT_REGISTER_EXECUTOR("single_threaded",
                       "a snapshot of what is ready at each polling point, in rclcpp's order",
                       SingleThreadedExecutor)

}  // namespace takt
