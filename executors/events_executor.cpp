// Every announcement goes straight to the scheduler, by default in order of arrival. Timers need no
// thread of their own. One thread, or a pool.
// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/executor.hpp"

namespace takt {

TAKT_REGISTER_EXECUTOR("events", "every event at once, in order of arrival",
                       .readiness = Readiness::events, .scheduler = "fifo", .max_threads = 64)

}  // namespace takt
