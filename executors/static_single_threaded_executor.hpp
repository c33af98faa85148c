// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_STATIC_SINGLE_THREADED_EXECUTOR_HPP_
#define TAKT_EXECUTORS_STATIC_SINGLE_THREADED_EXECUTOR_HPP_

#include "takt/executors/engine/dispatching_executor.hpp"

namespace takt {

/// As single_threaded, but the set of callbacks is fixed at the first spin: adding or removing
/// later is an Error (rclcpp's static executor of Humble).
/// Thread safety and real-time: as Executor.
class StaticSingleThreadedExecutor final : public DispatchingExecutor {
 public:
  explicit StaticSingleThreadedExecutor(const ExecutorOptions& options = {});
};

}  // namespace takt

#endif  // TAKT_EXECUTORS_STATIC_SINGLE_THREADED_EXECUTOR_HPP_
