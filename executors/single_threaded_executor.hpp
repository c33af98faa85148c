// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_SINGLE_THREADED_EXECUTOR_HPP_
#define TAKT_EXECUTORS_SINGLE_THREADED_EXECUTOR_HPP_

#include "takt/executors/engine/dispatching_executor.hpp"

namespace takt {

/// rclcpp's single-threaded executor: a wait set, one snapshot at each polling point, served in
/// the order of the scheduler `ros` unless told otherwise. The model of Casini et al. (ECRTS 2019).
/// Thread safety and real-time: as Executor.
class SingleThreadedExecutor final : public DispatchingExecutor {
 public:
  explicit SingleThreadedExecutor(const ExecutorOptions& options = {});
};

}  // namespace takt

#endif  // TAKT_EXECUTORS_SINGLE_THREADED_EXECUTOR_HPP_
