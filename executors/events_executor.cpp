// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/events_executor.hpp"

namespace takt {

EventsExecutor::EventsExecutor(const ExecutorOptions& options)
    : DispatchingExecutor(
          options, {.readiness = Readiness::events, .scheduler = "fifo", .max_threads = 64}) {
}

TAKT_REGISTER_EXECUTOR("events", "every event at once, in order of arrival", EventsExecutor)

}  // namespace takt
