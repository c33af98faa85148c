// The executors of a container, and the threads that spin them. Private to the container's files.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_RUNNING_EXECUTORS_HPP_
#define TAKT_CONTAINERS_RUNNING_EXECUTORS_HPP_

#include <atomic>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/containers/configuration/system_description.hpp"
#include "takt/executors/executor.hpp"

namespace TAKT_INTERNAL takt {

struct RunningExecutor {
  std::string name;
  ExecutorDescription description;  // what it was made from, with the overrides
  std::unique_ptr<Executor> executor;
  std::string differs;  // what an overriding type cannot use of the file
  bool is_own = false;  // serves the container itself: requests or lifecycle
  std::thread thread;
  std::atomic<bool> has_begun{false}, has_ended{false};
  std::exception_ptr exception;  // read when `has_ended`

  /// Says that `differs`; empty: it does not.
  std::string note() const;
};

/// The name of an executor's scheduler: from the file, or else the default of its type.
std::string scheduler_of(const ExecutorDescription& made);

/// Each executor begins to spin when it is first needed, so one that serves nobody has no thread.
/// Thread safety: executors are added before start(); then every method from any thread.
/// Real-time: no.
class RunningExecutors {
 public:
  RunningExecutor& add(std::string name, std::unique_ptr<Executor> executor);
  /// All of them. The first one was added first.
  auto begin() const noexcept { return all_.begin(); }
  auto end() const noexcept { return all_.end(); }
  /// The executor with this name, which must exist.
  RunningExecutor& named(const std::string& name) const;
  /// The next three functions leave out the container's own executors: heartbeats keep them busy.
  std::vector<std::string> names() const;
  /// Callbacks that are ready or running.
  std::size_t pending() const noexcept;
  std::vector<int> threads_of_callbacks() const;

  /// From now on, executors may start. The handler gets exceptions of callbacks; if an exception
  /// ends an executor, `on_failure` is called on its thread. If the clock has CPUs, each executor
  /// joins it before the next one starts, so that their order is deterministic.
  void start(Realtime realtime, Clock& clock, ExceptionHandler handler,
             std::function<void()> on_failure);
  /// Between start() and cancel(): starts the executor unless it has begun before, waits until it
  /// spins, and returns true. Throws std::system_error if no thread can be created; then the
  /// executor has not begun.
  bool spin(RunningExecutor& running);
  /// Ends all executors that spin, without waiting; no other one starts.
  void cancel() noexcept;
  /// Waits until all executors have ended; returns the first exception that ended one, or nullptr.
  std::exception_ptr join();

 private:
  std::vector<std::unique_ptr<RunningExecutor>> all_;
  std::mutex mutex_;              // guards all below, and `thread` of each
  std::size_t participants_ = 0;  // of a simulation's clock
  ManualClock* simulation_ = nullptr;
  bool may_begin_ = false;
  Realtime realtime_ = Realtime::prefer;
  ExceptionHandler handler_;
  std::function<void()> on_failure_;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_RUNNING_EXECUTORS_HPP_
