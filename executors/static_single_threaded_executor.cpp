// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/static_single_threaded_executor.hpp"

namespace takt {

StaticSingleThreadedExecutor::StaticSingleThreadedExecutor(const ExecutorOptions& options)
    : DispatchingExecutor(options, {.readiness = Readiness::wait_set,
                                    .scheduler = "ros",
                                    .max_threads = 1,
                                    .frozen = true}) {
}

TAKT_REGISTER_EXECUTOR(
    "static_single_threaded",
    "as single_threaded, over a set of callbacks that is fixed at the first spin",
    StaticSingleThreadedExecutor)

}  // namespace takt
