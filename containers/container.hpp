// Container: a process built from a system description.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_CONTAINER_HPP_
#define TAKT_CONTAINERS_CONTAINER_HPP_

#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/containers/component.hpp"
#include "takt/containers/component_manager.hpp"
#include "takt/containers/configuration/system_description.hpp"
#include "takt/containers/get_statistics.hpp"
#include "takt/containers/lifecycle_manager.hpp"
#include "takt/containers/loaded_component.hpp"
#include "takt/containers/model/system_model.hpp"
#include "takt/containers/one_sided_topics.hpp"
#include "takt/containers/planning/plan.hpp"
#include "takt/containers/result.hpp"
#include "takt/containers/trace_container.hpp"
#include "takt/executors/watchdog.hpp"
#include "takt/ros2/rosout.hpp"
#include "takt/ros2/time_source.hpp"
#include "takt/sched/threads/cpu_dma_latency.hpp"

namespace TAKT_PUBLIC takt {

class ExecutionModel;
// What a container is made of.
struct ContainerSetting;
class RunningExecutors;
class RunningTrace;
struct Loaded;
class ComponentList;
class ContainerExecutors;
class Guarantees;
class BoundWatch;
class ContainerWatch;
class TopicMatches;
class MeasuredUsage;
class ContainerLifecycle;
class ContainerServices;
class UnloadingThreads;

/// Where components run under an executor type that overrides the file's.
enum class Placement {
  file,    // each on its executor of the file, which keeps its name, threads and scheduler
  merged,  // all on one executor, with the threads of all executors of the file
};
/// The valid words for a Placement.
std::vector<std::string> placements();
/// Throws Error, which lists the valid words, for any other word. `where`: the place of the word.
Placement parse_placement(const std::string& word, const std::string& where = {});

/// Settings of the command line that override the file.
struct ContainerOverrides {
  std::string executor;  // the type of every executor of components; empty: as in the file
  Placement placement = Placement::file;  // if `executor` is given
  std::string scheduler;                  // of every executor; empty: as in the file
  StatisticsLevel statistics = StatisticsLevel::full;
  std::size_t trace_events = 0;           // see ExecutorOptions
  std::shared_ptr<LatencySlices> slices;  // of all executors; they begin with release()
  /// Checks at run time what the analysis assumes, as `analysis: {watch: true}` does.
  bool watches_bounds = false;
  Clock* clock = &Clock::steady();
  bool is_merged() const noexcept { return !executor.empty() && placement == Placement::merged; }
  /// Replaces the participant that `dds` of the description configures: `takt check` and `takt
  /// plan` must not appear on the network. If a program makes its nodes itself, `takt top` and
  /// `takt callback set` reach the program through this participant.
  std::shared_ptr<Participant> participant;
  /// Called on the constructing thread before a component's constructor, with the component's name
  /// in the file, and after it with an empty string.
  std::function<void(std::string_view component)> on_making;
  /// Returns the node that a program has made for a description without a class. nullptr: there is
  /// no such node yet, and the component is left out.
  std::function<std::shared_ptr<Node>(const ComponentDescription&)> find_node;
  /// Nothing is going to run: tracepoints are not loaded, and nodes know it.
  bool only_constructs = false;
  /// See ExecutorOptions. Set: the container is simulated, on a ManualClock with CPUs. It requests
  /// nothing from the operating system, and advances the clock itself when it stops.
  ExecutionModel* execution_model = nullptr;
  std::string mode;  // a mode of the file, in which it begins; empty: normal
  /// Components call this to end the container, see NodeOptions.
  std::function<void()> end;
};

/// Constructs the components of a description, adds them and their callback groups to executors,
/// and runs each executor on threads with the attributes given in the file. Some thread names are
/// reserved for the container's own threads:
/// - `main`: the main thread of the process
/// - `log`: writes log lines
/// - `watchdog`: reports a missed deadline at the moment it is missed
/// - `container`, and three `requests`: serve requests, see ComponentManager
/// - `lifecycle`: brings up and monitors lifecycle nodes, see LifecycleManager
/// - `loader`: brings down an unloaded component, and waits for its running callbacks
/// - `lttng`: LTTng's own threads, in a process that it sees
///
/// A component that is part of a chain and names no executor goes to the executor that Takt assigns
/// to the chain. A thread or an executor in the file with the name of a chain replaces the assigned
/// one. An executor begins to run with its first callback: at the start, or when one is created or
/// loaded later.
///
/// Phases: construct (throws ConfigurationError with file and line) → start → release → hold →
/// shut_down → stop → result. The containers of a system enter each phase together: all spin before
/// the first timer is released, and none stops while messages are in transit. Between start and
/// stop, components may be loaded and unloaded.
/// Thread safety: one control thread calls all functions, except where a function states otherwise.
/// Real-time: all set-up happens before the first callback.
class Container {
 public:
  explicit Container(const SystemDescription& description,
                     const ContainerOverrides& overrides = {});
  ~Container();
  Container(const Container&) = delete;
  Container& operator=(const Container&) = delete;

  /// Starts the executors that have callbacks, without releasing timers yet. If an exception ends
  /// an executor, it calls `on_failure` on the executor's thread. Throws Error if the system
  /// refuses privileges that the file requires.
  void start(std::function<void()> on_failure = {});
  /// Releases the timers, and starts the measurement that result() returns.
  void release();
  /// Checks for deviations from the analysis, and returns when to call this again; kNever: nothing
  /// is watched. Call it between release() and hold().
  TimePoint watch_bounds();
  /// Logs the topics of this process that have only publishers or only subscriptions, in this
  /// process and on the DDS domain. If the file requires a match (`must_match`), this is an error
  /// and a failure of the run. Call it once, after discovery had time to complete.
  void check_matches();
  /// Stops the timers; messages in transit are still served. Notes the topics that still lack
  /// publishers or subscriptions, and the lifecycle nodes that nobody has configured. Checks
  /// `must_match` unless check_matches() has done so.
  void hold();
  /// Number of callbacks that are ready or running.
  std::size_t pending() const noexcept;
  /// Shuts down the lifecycle nodes that this process manages, which may be in any process of the
  /// system: so call it before any container stops.
  void shut_down();
  /// Serves pending callbacks, brings down the lifecycle nodes that are not finalized, within 10 s,
  /// then stops the executors. Rethrows the exception of a callback.
  void stop();
  /// Replaces hold(), shut_down() and stop() for a program that keeps its nodes: executors end when
  /// the running callbacks have returned. Does not wait. Thread safety: from any thread.
  void cancel() noexcept;
  /// Waits until the executors have ended. Rethrows the exception of a callback.
  void join();

  /// Constructs a component and adds it to the executor that it names, else to `default`, else to
  /// the first one; its timers start. Throws Error, and changes nothing, if the class is unknown,
  /// the constructor throws, a name is taken or does not exist, an executor would be overloaded, or
  /// a chain whose deadline was guaranteed could now miss it (see make_system_model). Other
  /// components keep running, however long the constructor takes.
  /// Thread safety: from one thread at a time, not necessarily the control thread.
  LoadedComponent load(ComponentDescription component);
  /// Brings a lifecycle node down, removes the component from its executors, waits for its running
  /// callbacks and for other threads that read the list of components (see Looks), and destroys it.
  /// Throws Error if the id is unknown, or if a callback still runs after `limit`; then the
  /// component is destroyed when that callback returns. Thread safety: as load; not from one of the
  /// component's own callbacks.
  void unload(std::uint64_t id, Nanoseconds limit = std::chrono::seconds(5));
  /// The same on the calling thread, for a program that drops a node of its own: without a
  /// lifecycle transition, without a limit, and also in callbacks. It does not wait for a callback
  /// that waits for the calling thread.
  void unload_here(std::uint64_t id);
  /// Thread safety: from any thread.
  std::vector<LoadedComponent> components() const;
  /// The executors to which a component can be added.
  std::vector<std::string> executor_names() const;
  /// Applies the changes of a set_callback_parameters request. Checks all of them first, and throws
  /// Error without changing anything if one is invalid, or if a chain whose deadline was guaranteed
  /// could then miss it. Thread safety: from any thread.
  void change_parameters(const std::string& changes);

  /// Switches to a mode of the file's `modes:`, or back to "normal". The changes take effect at the
  /// next dispatch of each executor: a callback that is picked after this has returned is served as
  /// the new mode says. Throws Error if there is no such mode. Thread safety: from any thread but
  /// those that run components, which call NodeOptions::request_mode.
  void set_mode(const std::string& mode);
  /// The mode in force. Thread safety: from any thread.
  std::string mode() const;

  /// The publishers and subscriptions that other processes can discover; empty without DDS.
  std::vector<EndpointState> endpoints() const;

  /// The chains of this process, and the executors and priorities assigned to them.
  Plan plan() const;
  /// The description from the file, completed with the assigned executors and threads.
  const SystemDescription& description() const noexcept;
  /// The name of the executor that runs the group.
  std::string executor_of(const Node& node, const CallbackGroup& group) const;
  /// The description of this process for the analysis of response times.
  ModelledProcess modelled() const;
  /// Utilisation (1.0: one CPU) by the callbacks that have a budget and a period.
  double utilisation_of(const std::string& executor) const;

  /// The statistics since the start. Thread safety: from any thread.
  GetStatistics::Response statistics() const;
  /// Starts or ends recording what the executors do, or returns the recording: see TraceContainer.
  /// Thread safety: from any thread.
  TraceContainer::Response trace(const TraceContainer::Request& request);
  /// The measurements of the run. Call it after stop().
  ProcessResult result() const;

 private:
  void admit(const std::shared_ptr<Loaded>& loaded);
  std::shared_ptr<Loaded> begin_to_unload(std::uint64_t id);
  void remove(const std::shared_ptr<Loaded>& loaded);
  void end_components() noexcept;
  std::exception_ptr end_executors() noexcept;

  const std::unique_ptr<ContainerSetting> setting_;
  const std::unique_ptr<RunningExecutors> running_;
  const std::unique_ptr<RunningTrace> trace_;
  const std::unique_ptr<ComponentList> components_;
  std::unique_ptr<ContainerExecutors> executors_;
  const std::unique_ptr<Guarantees> guarantees_;
  std::vector<std::shared_ptr<Chain>> chains_;
  const std::unique_ptr<ContainerWatch> watch_;
  const std::unique_ptr<TopicMatches> matches_;
  const std::unique_ptr<MeasuredUsage> usage_;
  const std::unique_ptr<ContainerLifecycle> lifecycle_;
  const std::unique_ptr<ContainerServices> services_;
  std::unique_ptr<UnloadingThreads> unloading_threads_;
  std::optional<CpuDmaLatency> dma_latency_;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_CONTAINER_HPP_
