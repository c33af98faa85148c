// Helpers for main(): spin a node, and stop on Ctrl-C.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_SPIN_HPP_
#define TAKT_EXECUTORS_SPIN_HPP_

#include <memory>

#include "takt/base/visibility.hpp"
#include "takt/executors/executor.hpp"

namespace TAKT_PUBLIC takt {

/// While this object lives, SIGINT and SIGTERM cancel the executor instead of ending the process. A
/// second signal ends the process, so pressing Ctrl-C twice always works. Two equal signals within
/// half a second are one: `timeout -s INT` sends it to the process and to its group. Several
/// objects may exist at a time, for several executors; the destructor of the last one restores the
/// signals' previous actions.
///
/// Thread safety: construct and destroy it on any thread, while the executor exists.
/// Real-time: it uses none of the executor's threads. A thread `takt_signals`, with default
/// attributes, sleeps until a signal arrives.
/// Errors: throws Error if the process cannot open another file descriptor.
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
