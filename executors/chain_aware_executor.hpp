// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_CHAIN_AWARE_EXECUTOR_HPP_
#define TAKT_EXECUTORS_CHAIN_AWARE_EXECUTOR_HPP_

#include "takt/executors/engine/dispatching_executor.hpp"

namespace takt {

/// At every dispatch the most urgent callback of all that are ready then, as in PiCAS (RTAS 2021):
/// no snapshot stands between a critical callback and its start. One thread; several chains are
/// several executors.
/// Thread safety and real-time: as Executor.
class ChainAwareExecutor final : public DispatchingExecutor {
 public:
  explicit ChainAwareExecutor(const ExecutorOptions& options = {});
};

}  // namespace takt

#endif  // TAKT_EXECUTORS_CHAIN_AWARE_EXECUTOR_HPP_
