// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_TRIGGERED_EXECUTOR_HPP_
#define TAKT_EXECUTORS_TRIGGERED_EXECUTOR_HPP_

#include "takt/executors/engine/dispatching_executor.hpp"

namespace takt {

/// Serves a snapshot of what is ready when a trigger says so, in the order that the user lists: any
/// callback is ready, all are, one certain is, or the user's own function of them. With a period,
/// by logical execution time (Giotto; rclc's LET): inputs are taken together at its beginning, and
/// outputs are sent together at its end, however long the callbacks took. One thread.
/// Thread safety and real-time: as Executor.
class TriggeredExecutor final : public DispatchingExecutor {
 public:
  explicit TriggeredExecutor(const ExecutorOptions& options = {});
};

}  // namespace takt

#endif  // TAKT_EXECUTORS_TRIGGERED_EXECUTOR_HPP_
