// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_MULTI_THREADED_EXECUTOR_HPP_
#define TAKT_EXECUTORS_MULTI_THREADED_EXECUTOR_HPP_

#include "takt/executors/engine/dispatching_executor.hpp"

namespace takt {

/// A pool of threads that share one wait set. Callbacks that a busy group keeps from running are
/// parked and keep their place, so none starves and no wake-up is spent on them.
/// Thread safety and real-time: as Executor.
class MultiThreadedExecutor final : public DispatchingExecutor {
 public:
  explicit MultiThreadedExecutor(const ExecutorOptions& options = {});
};

}  // namespace takt

#endif  // TAKT_EXECUTORS_MULTI_THREADED_EXECUTOR_HPP_
