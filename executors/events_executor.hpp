// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_EVENTS_EXECUTOR_HPP_
#define TAKT_EXECUTORS_EVENTS_EXECUTOR_HPP_

#include "takt/executors/engine/dispatching_executor.hpp"

namespace takt {

/// Every announcement goes straight to the scheduler, by default in order of arrival. Timers need
/// no thread of their own. One thread, or a pool.
/// Thread safety and real-time: as Executor.
class EventsExecutor final : public DispatchingExecutor {
 public:
  explicit EventsExecutor(const ExecutorOptions& options = {});
};

}  // namespace takt

#endif  // TAKT_EXECUTORS_EVENTS_EXECUTOR_HPP_
