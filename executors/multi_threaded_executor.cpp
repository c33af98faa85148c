// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/multi_threaded_executor.hpp"

namespace takt {

MultiThreadedExecutor::MultiThreadedExecutor(const ExecutorOptions& options)
    : DispatchingExecutor(
          options,
          {.readiness = Readiness::wait_set, .scheduler = "ros", .max_threads = 64, .pool = true}) {
}

TAKT_REGISTER_EXECUTOR("multi_threaded", "a pool of threads that share one wait set",
                       MultiThreadedExecutor)

}  // namespace takt
