// A pool of threads that share one wait set. Callbacks that a busy group keeps from running are
// parked and keep their place, so none starves and no wake-up is spent on them.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/executor.hpp"

namespace takt {

TAKT_REGISTER_EXECUTOR("multi_threaded", "a pool of threads that share one wait set",
                       .readiness = Readiness::wait_set, .scheduler = "ros", .max_threads = 64,
                       .pool = true)

}  // namespace takt
