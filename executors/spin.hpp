// What a main writes in one line: spin a node, and end on Ctrl-C.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_SPIN_HPP_
#define TAKT_EXECUTORS_SPIN_HPP_

#include <memory>

#include "takt/executors/executor.hpp"

namespace takt {

/// As long as this lives, SIGINT and SIGTERM cancel the executor instead of ending the process. The
/// same signal a second time ends the process, so Ctrl-C twice always works. Several may live at a
/// time, for several executors; with the last one, the signals do again what they did before.
///
/// Thread safety: make and destroy it on any thread, while the executor exists.
/// Real-time: none of the executor's threads does anything for it. A thread `takt_signals`, with
/// default attributes, sleeps until a signal comes.
/// Errors: throws Error when the process cannot open one more file.
class CancelOnSignals {
 public:
  explicit CancelOnSignals(Executor& executor);
  ~CancelOnSignals();
  CancelOnSignals(const CancelOnSignals&) = delete;
  CancelOnSignals& operator=(const CancelOnSignals&) = delete;

 private:
  Executor& executor_;
};

/// `const auto signals = takt::cancel_on_signals(*executor);` before spin.
[[nodiscard]] inline CancelOnSignals cancel_on_signals(Executor& executor) {
  return CancelOnSignals(executor);
}

/// Runs the node on a `single_threaded` executor until SIGINT or SIGTERM, as rclcpp::spin does.
void spin(const std::shared_ptr<Node>& node);

}  // namespace takt

#endif  // TAKT_EXECUTORS_SPIN_HPP_
