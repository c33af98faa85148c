// A process assembled from a description: components under executors, executors on threads.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_CONTAINER_HPP_
#define TAKT_CONTAINERS_CONTAINER_HPP_

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "takt/base/pi_mutex.hpp"
#include "takt/base/simulated_clock.hpp"
#include "takt/containers/component.hpp"
#include "takt/containers/component_manager.hpp"
#include "takt/containers/configuration/system_description.hpp"
#include "takt/containers/lifecycle_manager.hpp"
#include "takt/containers/loaded_component.hpp"
#include "takt/containers/one_sided_topics.hpp"
#include "takt/containers/planning/plan.hpp"
#include "takt/containers/result.hpp"
#include "takt/executors/engine/watchdog.hpp"
#include "takt/ros2/rosout.hpp"
#include "takt/ros2/time_source.hpp"
#include "takt/sched/threads/cpu_dma_latency.hpp"

namespace takt {

class Loaders;

/// What the command line says over the file.
struct ContainerOverrides {
  std::string executor;   // all components under one executor of this type; empty: as the file says
  std::string scheduler;  // of every executor; empty: as the file says
  StatisticsLevel statistics = StatisticsLevel::full;
  std::size_t trace_events = 0;  // see ExecutorOptions
  Clock* clock = &Clock::steady();
  /// Stands in for the one that `dds` of the description asks for; for those who only look.
  std::shared_ptr<Participant> participant;
  /// Called before a component's constructor, with what the file calls it, and after it, with an
  /// empty text; on the thread that makes it.
  std::function<void(std::string_view component)> on_making;
};

/// Makes the components of a description, gives them and their callback groups to executors, and
/// runs each executor on threads with the attributes of the file. Thread entries called `main`,
/// `log`, `watchdog`, `container`, `lifecycle` and `loader` are for the process's own thread, for
/// the one that writes log lines, for one that tells of missed deadlines when they are missed, for
/// the one that answers services (see ComponentManager), for one that watches lifecycle nodes and
/// brings them up (see LifecycleManager), and for one that waits for an unloaded component.
///
/// Components that lie on chains and name no executor are given to those that Takt assigns; thread
/// entries and executors that are called like a chain take the place of the assigned ones.
///
/// Life: construct (throws ConfigurationError with file and line) → start → release → hold →
/// shut_down → stop → result. Several containers go through it together: so all of them spin before
/// the first timer is released, and none ends while messages are under way. Between start and stop
/// components may be loaded and unloaded. Thread safety: for one control thread, but for loading
/// and what is said there. Real-time: all set-up happens before the first callback.
class Container {
 public:
  explicit Container(const SystemDescription& description,
                     const ContainerOverrides& overrides = {});
  ~Container();
  Container(const Container&) = delete;
  Container& operator=(const Container&) = delete;

  /// Starts the executors; no timer is released yet. `on_failure` is called, on an executor's
  /// thread, when one of them ends by an exception. Throws Error when rights are refused that the
  /// file requires.
  void start(std::function<void()> on_failure = {});
  /// Timers begin, and with them the time that the result is about.
  void release();
  /// Logs which topics only one side is known of, here and on the domain: one that the file says
  /// must match as an error, which is a failure of the run. To be called once, when all have had
  /// the time to find each other. Without it, `hold` looks at those that must match.
  void check_matches();
  /// Timers are released no more; messages on their way are served.
  void hold();
  /// How many callbacks are ready or running; 0 when everything that has arrived is done.
  std::size_t pending() const noexcept;
  /// Takes the lifecycle nodes down that this process manages, in whatever process they are; so it
  /// comes before the stop of any. Without a call of it, stop ends them as they are.
  void shut_down();
  /// Serves what is pending, then ends the executors. Rethrows what a callback threw.
  void stop();

  /// Makes a component and gives it to the executor that it names, else to `default`, else to the
  /// first; its timers begin. Throws Error, and all is as before, when that cannot be: no such
  /// class, a constructor that throws, a name that is taken or does not exist, an executor that
  /// would be given more than it can do, a chain that could miss its deadline because of it (see
  /// chain_bounds) and could not before. Other components run on, however long a constructor takes.
  /// Thread safety: from one thread at a time, which need not be the control thread.
  LoadedComponent load(ComponentDescription component);
  /// Takes a component from its executors, waits for its running callbacks, and destroys it. Throws
  /// Error when there is none of that number, or when a callback still runs after `limit`: then it
  /// goes when that callback returns.
  /// Thread safety: as load; not from one of the component's own callbacks.
  void unload(std::uint64_t id, Nanoseconds limit = std::chrono::seconds(5));
  /// Thread safety: from any thread.
  std::vector<LoadedComponent> components() const;
  /// The executors that a component can be given to.
  std::vector<std::string> executor_names() const;
  /// As a text of the service set_callback_parameters says. Whatever is wrong is found before
  /// anything is changed, and thrown as Error. Thread safety: from any thread.
  void change_parameters(const std::string& changes);

  /// The ends of topics that other processes can see; empty without DDS.
  std::vector<EndpointState> endpoints() const;

  /// The chains of this process, and what was assigned to them.
  const Plan& plan() const noexcept { return plan_; }
  /// As the file says, completed by what was assigned.
  const SystemDescription& description() const noexcept { return description_; }
  /// The name of the executor that has the group.
  std::string executor_of(const Node& node, const CallbackGroup& group) const;
  /// What callbacks with a budget and a period need of one CPU.
  double utilisation_of(const std::string& executor) const;

  /// What the run has shown. After stop.
  ProcessResult result() const;

 private:
  struct RunningExecutor;
  struct Loaded;
  using Errors = std::vector<std::string>;

  void make_components();
  std::unique_ptr<Component> construct(const ComponentDescription& component,
                                       const NodeOptions& options) const;
  std::shared_ptr<Loaded> make(const ComponentDescription& component, Errors& errors) const;
  void choose_executors(ComponentDescription& component) const;
  void admit(const std::shared_ptr<Loaded>& loaded);
  void check_topics();
  void require_matches(const std::vector<OneSidedTopic>& topics);
  void make_chains();
  void assign();
  void make_executors();
  void make_executor(const ExecutorDescription& executor);
  bool needs_default_executor() const;
  void place_components();
  void make_manager();
  void make_lifecycle();
  void make_own_executor(const char* name, const std::shared_ptr<Node>& node);
  std::string own_name(const char* ending) const;
  void serve(Loaded& loaded);
  Errors too_much_for_executors() const;
  std::vector<ChainBound> bounds() const;
  void check_listed_callbacks();
  void place(const Loaded& loaded);
  void displace(Loaded& loaded);
  std::shared_ptr<Loaded> find(std::string_view name) const;
  void forget(const Loaded& loaded);
  void complete(Loaded& loaded);
  void displace_failed();
  RunningExecutor& add(const std::string& name, std::unique_ptr<Executor> executor);
  Executor& executor_for(const std::string& name);
  bool has_thread(const std::string& name) const;
  ThreadAttributes thread(const std::string& name) const;
  double capacity_of(const ExecutorDescription& executor) const;
  bool handle(const FailedCallback& failed);
  bool drain();
  void begin_counting();
  void end_counting();

  SystemDescription description_;  // completed by what is assigned
  const ContainerOverrides overrides_;
  Errors errors_;  // of what is made before the start
  std::vector<std::string> notes_;
  std::vector<std::string> failures_;  // guarded by mutex_
  bool has_checked_matches_ = false;
  std::shared_ptr<Participant> participant_;
  mutable SimulatedClock simulated_clock_;  // of components with `use_sim_time`
  std::vector<ThreadStatistics> dds_threads_;
  std::shared_ptr<Watchdog> watchdog_;
  std::vector<std::unique_ptr<RunningExecutor>> executors_;
  mutable PiMutex mutex_;  // guards the next three after start
  std::vector<std::shared_ptr<Loaded>> components_;
  Plan plan_;
  std::uint64_t last_id_ = 0;
  std::unique_ptr<Loaders> loaders_;  // made by the first unload
  std::shared_ptr<Node> service_node_;
  std::unique_ptr<ComponentManager> manager_;
  std::unique_ptr<Rosout> rosout_;
  std::unique_ptr<TimeSource> time_source_;  // when somebody needs it
  std::shared_ptr<Node> lifecycle_node_;
  std::unique_ptr<HeartbeatSender> heartbeats_;
  std::unique_ptr<LifecycleManager> lifecycle_;  // in one process of the system
  std::shared_ptr<GuardCondition> failed_;       // a component has to be taken from its executors
  std::vector<std::shared_ptr<Chain>> chains_;
  std::optional<CpuDmaLatency> dma_latency_;
  TimePoint released_{}, held_{};
  Nanoseconds cpu_time_{0};
  std::uint64_t pss_kb_ = 0;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_CONTAINER_HPP_
