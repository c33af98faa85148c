// A process assembled from a description: components under executors, executors on threads.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_CONTAINER_HPP_
#define TAKT_CONTAINERS_CONTAINER_HPP_

#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "takt/containers/component.hpp"
#include "takt/containers/result.hpp"
#include "takt/containers/system_description.hpp"

namespace takt {

/// What the command line says over the file.
struct ContainerOverrides {
  std::string executor;   // all components under one executor of this type; empty: as the file says
  std::string scheduler;  // of every executor; empty: as the file says
  StatisticsLevel statistics = StatisticsLevel::full;
};

/// Makes the components of a description, gives them and their callback groups to executors, and
/// runs each executor on threads with the attributes of the file. Thread entries called `main` and
/// `log` are for the process's own thread and for the one that writes log lines.
///
/// Life: construct (throws ConfigurationError with file and line) → start → stop → result.
/// Thread safety: for one control thread.
/// Real-time: all set-up happens before the first callback.
class Container {
 public:
  explicit Container(const SystemDescription& description,
                     const ContainerOverrides& overrides = {});
  ~Container();
  Container(const Container&) = delete;
  Container& operator=(const Container&) = delete;

  /// Starts the executors. `on_failure` is called, on an executor's thread, when one of them ends
  /// by an exception. Throws Error when rights are refused that the file requires.
  void start(std::function<void()> on_failure = {});

  /// Brings the run to its end: timers are released no more, messages on their way are served,
  /// then the executors end. Rethrows what a callback threw.
  void stop();

  /// What the run has shown. After stop.
  ProcessResult result() const;

 private:
  struct RunningExecutor;

  void make_executors();
  void make_components();
  void place(const ComponentDescription& component, const std::shared_ptr<Node>& node);
  void check_names(const ComponentDescription& component, const Node& node);
  Executor& executor_for(const std::string& name);
  bool has_thread(const std::string& name) const;
  ThreadAttributes thread(const std::string& name) const;
  bool drain();

  const SystemDescription description_;
  const ContainerOverrides overrides_;
  std::vector<std::string> errors_;  // of make_components
  std::vector<std::string> notes_;
  std::vector<std::unique_ptr<RunningExecutor>> executors_;
  std::vector<std::unique_ptr<Component>> components_;
  int dma_latency_file_ = -1;
  TimePoint started_{}, stopped_{};
  Nanoseconds cpu_time_{0};
  std::uint64_t pss_kb_ = 0;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_CONTAINER_HPP_
