// What stands in for the bodies of callbacks in a simulation.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_EXECUTION_MODEL_HPP_
#define TAKT_EXECUTORS_EXECUTION_MODEL_HPP_

#include "takt/base/visibility.hpp"
#include "takt/entities/entity.hpp"

namespace TAKT_INTERNAL takt {

/// See ExecutorOptions::execution_model. The executor itself does all that is around a body: it
/// takes the message, times the execution, and counts.
/// Thread safety: called by the worker that runs the callback; under a manual clock one at a time.
/// Real-time: no; for simulations.
class ExecutionModel {
 public:
  virtual ~ExecutionModel() = default;
  /// Before the execution begins: the overhead of the executor.
  virtual void dispatch() noexcept = 0;
  /// Replaces `entity.execute(slot)`. It must call either that or `entity.discard(slot)`.
  virtual void execute(Entity& entity, Slot& slot) = 0;
};

}  // namespace takt

#endif  // TAKT_EXECUTORS_EXECUTION_MODEL_HPP_
