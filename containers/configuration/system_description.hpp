// The description of a system: the content of a configuration file after reading and checking.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_CONFIGURATION_SYSTEM_DESCRIPTION_HPP_
#define TAKT_CONTAINERS_CONFIGURATION_SYSTEM_DESCRIPTION_HPP_

#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "takt/base/logger.hpp"
#include "takt/base/visibility.hpp"
#include "takt/callback_groups/callback_group.hpp"
#include "takt/containers/load_policy.hpp"
#include "takt/executors/executor.hpp"
#include "takt/nodes/chain.hpp"
#include "takt/nodes/parameter.hpp"
#include "takt/sched/threads/thread_attributes.hpp"
#include "takt/transport/dds/participant.hpp"

namespace TAKT_PUBLIC takt {

/// A position in a file: "robot.yaml:12".
using SourceLine = std::string;

/// A key that stands in a file.
struct WrittenKey {
  std::string map;    // the kind of its map, as the reference has it: "a topic"
  std::string entry;  // the key or the place of that map: "/scan"
  std::string key;
  SourceLine where;
  std::string value;  // "{}": a map
};

/// `accept:`, the reasons by the id of an assumption, see assumption_kinds().
using Acceptances = std::map<std::string, std::string, std::less<>>;

/// One entry of `threads:`.
struct ThreadDescription {
  ThreadAttributes attributes;  // its name is the entry's key
  SourceLine where;
};

/// One entry of `executors:`.
struct ExecutorDescription {
  std::string name;
  std::string type = "single_threaded";
  std::string library;                 // registers the type; empty: it is registered already
  std::string scheduler;               // empty: the executor's default
  std::vector<std::string> threads;    // names in `threads:`; empty: none given
  std::string wait = "auto";           // or a wait back end
  Nanoseconds spin{0}, early_wake{0};  // see ExecutorOptions
  Isolation per = Isolation::node;
  int reentrant_threads = 1;
  TriggerOptions trigger;
  OwnValues own;  // values of the keys that its type defines
  std::vector<std::string> order;
  SourceLine where;
};

/// The options of the executor. The caller adds its threads, which `threads:` describes, and the
/// values of its scheduler, see own_values_of().
ExecutorOptions options_of(const ExecutorDescription& executor);

/// One entry of a component's `callback_groups:`.
struct CallbackGroupDescription {
  std::string executor;              // empty: the component's
  std::optional<Nanoseconds> waits;  // of each callback, see CallbackDescription
  CallbackParameters parameters;
  SourceLine where;
};

/// How long one execution of a callback takes, in CPU time.
struct ExecutionDescription {
  Nanoseconds least{0}, longest{0};
};

/// Arrivals from outside the system: one every `period`, each up to `jitter` late, no two closer
/// than `least_distance`; or, by `distances`, the minimum distance from the first to the last of 2,
/// 3, … arrivals in a row.
struct ArrivalDescription {
  Nanoseconds period{0}, jitter{0}, least_distance{0};
  std::vector<Nanoseconds> distances;  // if not empty, instead of the others

  friend bool operator==(const ArrivalDescription&, const ArrivalDescription&) = default;
};

/// One entry of a component's `callbacks:`. All but the parameters is for `takt analyze`.
struct CallbackDescription {
  CallbackParameters parameters;
  std::optional<ExecutionDescription> execution;
  std::optional<ArrivalDescription> arrival;
  std::optional<Nanoseconds> waits;  // blocking time of an execution in all; nullopt: none
  bool publishes_at_end = true;      // false: at any time of an execution
  SourceLine where;
};

/// `delay:` of a topic: the time of a message between two processes, its receiving thread included.
struct DelayDescription {
  Nanoseconds least{0}, longest{0};
};

/// `machine:`, on which the system is analysed.
struct MachineDescription {
  std::vector<int> cpus;        // empty: those of this process
  std::map<int, double> speed;  // by CPU; execution times are divided by it
  /// Overheads, each nullopt if nobody says it: between two callbacks of a busy thread; to wake a
  /// thread; of a context switch.
  std::optional<Nanoseconds> dispatch, wake, change;
  /// The cost of sending a message to one receiver; added to it, of each megabyte of the message,
  /// and of each further receiver.
  std::optional<Nanoseconds> publish, publish_megabyte, publish_receiver;
  /// The CPU time in each second for the real-time threads of a CPU. nullopt: as on this machine; a
  /// second or more: unlimited.
  std::optional<Nanoseconds> rt_runtime;
  bool is_exclusive = false;  // promised: nothing else runs on these CPUs
};

/// One entry of `chains:`.
struct ChainDescription {
  ChainOptions options;
  bool allows_losses = false;    // its guarantee need not cover every instance
  bool from_activation = false;  // its guarantee need not cover the start
  Acceptances accepted;          // besides those of the file
  /// Its callbacks: full node name and callback name. Steps may be omitted if they are unambiguous.
  std::vector<std::pair<std::string, std::string>> path;
  SourceLine where;
};

/// Whether the executor is that of a chain, which a plan may give callbacks.
bool is_of_chain(const ExecutorDescription& executor, std::span<const ChainDescription> chains);

/// One entry of `modes:`. Callbacks are named as "node/callback", without a leading slash.
struct ModeDescription {
  struct Callback {
    std::string name;
    SourceLine where;
  };
  std::string name;
  std::vector<Callback> drop, demote;
  std::optional<Callback> on_overrun;  // its overrun switches to the mode
  SourceLine where;
};

/// The mode without changes, which each system has.
inline constexpr const char* kNormalMode = "normal";

/// The container's reaction to an exception from a component's callback.
enum class OnException {
  terminate,    // the container stops
  remove_node,  // the component's node is removed from its executors
  ignore,       // the exception is only logged
};

/// One component of a container.
struct ComponentDescription {
  std::string container = "takt";  // the container's name
  std::string type;                // the registered class; empty: `nodes:` of a program has it
  std::string library;             // registers the class; empty: see find_component()
  std::string name;                // empty: the class names its node
  std::string name_space;
  std::string executor;  // a name in `executors:`; empty: "default"
  Parameters parameters;
  std::map<std::string, std::string, std::less<>> remap;
  std::map<std::string, CallbackGroupDescription, std::less<>> callback_groups;
  std::map<std::string, CallbackDescription, std::less<>> callbacks;
  OnException on_exception = OnException::terminate;
  std::optional<LogLevel> log_level;  // of its node; nullopt: that of the process
  std::optional<Guest> guest;         // see NodeOptions; nullopt: the owner describes it
  SourceLine where;
  // Positions by key, for errors that are only found after construction.
  std::map<std::string, SourceLine, std::less<>> parameter_lines, remap_lines;
};

/// The node name with its namespace: "/front/lidar"; empty if the class names its node.
std::string full_name(const ComponentDescription& component);

/// Whether its node, or one of its groups, is for this executor.
bool uses(const ComponentDescription& component, const ExecutorDescription& executor);

/// For messages: "component 'demo::Lidar'", or "node '/front/lidar'" of a program.
std::string noun_of(const ComponentDescription& component);

/// When `takt run` restarts the process of a container.
struct RestartOptions {
  enum class Policy { never, on_failure, always };
  Policy policy = Policy::never;
  Nanoseconds delay = std::chrono::seconds(1);
  int most = 5;  // restarts per run
};

/// The lifecycle nodes of a system that a LifecycleManager manages.
struct LifecycleDescription {
  struct ManagedNode {
    std::string name;                     // with its namespace: "/map_server"
    std::vector<std::string> depends_on;  // nodes that must be active while this one is
  };
  enum class OnLoss {
    deactivate_dependents,  // until the lost node is active again
    shutdown,               // shut down all managed nodes
    report,                 // only log the loss
  };
  std::vector<ManagedNode> bring_up;  // in this order
  /// A node without heartbeats for this time is lost.
  Nanoseconds heartbeat = std::chrono::seconds(2);
  OnLoss on_loss = OnLoss::deactivate_dependents;
  std::string manager;  // the name of the process that runs the manager: see split()
  SourceLine where;
};

/// How Takt assigns priorities to callbacks that have none.
enum class PriorityMethod {
  picas,           // those of their chains: see sched/picas.hpp
  rate_monotonic,  // a shorter period is more urgent; see make_plan()
};

/// The content of a file, or the part of it that one process runs. A component that names no
/// executor goes to the one that Takt assigns to its chain, else to the executor "default", which
/// is a single_threaded one unless the file describes it.
struct SystemDescription {
  std::string file;
  std::string name = "takt";  // of the first container, or of the process
  Realtime realtime = Realtime::prefer;
  bool lock_memory = false;
  bool is_split_off = false;  // for measurements: serves no requests except lifecycle services
  std::optional<int> cpu_dma_latency_us;  // held while running; nullopt: unchanged
  std::optional<DdsOptions> dds;          // nullopt: no DDS
  MachineDescription machine;
  std::string model;  // a file with measured numbers; empty: none
  Acceptances accepted;
  bool watches_bounds = false;  // `analysis: {watch: true}`
  /// What-if factors of execution times, by the name of a callback, or of a node for all its
  /// callbacks.
  std::map<std::string, double, std::less<>> execution_scales;
  std::vector<WrittenKey> keys;  // all keys that a whole file has; empty after split()
  TopicQos topics;
  std::map<std::string, DelayDescription, std::less<>> delays;  // by topic
  std::map<std::string, SourceLine, std::less<>> topic_lines;   // in a whole file only
  std::map<std::string, SourceLine, std::less<>> must_match;    // need publisher and subscription
  std::vector<ThreadDescription> threads;
  std::map<std::string, OwnValues, std::less<>> schedulers;  // values of their own keys
  std::vector<ExecutorDescription> executors;
  std::vector<ComponentDescription> components;
  std::map<std::string, RestartOptions, std::less<>> restarts;  // by the container's name
  std::map<std::string, LoadPolicy, std::less<>> loads;         // by the container's name
  std::vector<std::string> libraries;                           // named by the file, see LoadPolicy
  std::vector<std::string> parameter_files;  // parameter files of ROS 2, named by the file
  std::optional<LifecycleDescription> lifecycle;
  std::vector<ChainDescription> chains;
  std::optional<PriorityMethod> priorities;  // nullopt: picas, unless the code sets priorities
  std::vector<ModeDescription> modes;        // besides kNormalMode
  bool finds_chains = false;  // `chains: auto`: every path from a timer to its last callback
  SourceLine chains_where;
  std::vector<std::string> notes;  // remarks of the reader, for the user
};

/// The values of the scheduler's own keys; empty: the file has none.
const OwnValues& own_values_of(const std::string& scheduler, const SystemDescription& system);

/// Whether some chain has a `concurrency`.
bool limits_chains(const SystemDescription& system);

/// The thread of this name; nullptr: the file has none.
const ThreadDescription* find_thread(const SystemDescription& system, std::string_view name);

/// The load policy of a process: that of its first container, which has the process's name.
LoadPolicy load_policy(const SystemDescription& process);

/// All errors of a file, each as `FILE:LINE: what; what to do`.
/// Thread safety: none.
/// Real-time: no.
class ConfigurationError : public Error {
 public:
  explicit ConfigurationError(std::vector<std::string> errors);
  const std::vector<std::string>& errors() const noexcept { return errors_; }

 private:
  std::vector<std::string> errors_;
};

/// A value to use instead of the one in a file: "threads.control.priority", "70". The path names
/// keys; in a list, the `name` of an entry, or its `component`, or its place from 0.
struct Setting {
  std::string path, value;
};
using Settings = std::vector<Setting>;

/// Reads a configuration file (YAML), or a workload in the iRobot JSON format (file name ends in
/// .json), which is converted to workload components. Constructs no component. Throws
/// ConfigurationError with all errors; a setting whose path leads nowhere is one.
SystemDescription read_system(const std::string& path, const Settings& settings = {});

/// Which components share a process.
enum class Composition {
  file,      // those of one container, as the file says
  single,    // all
  per_node,  // none
};
/// Splits a system into one description per process, each with the executors that it uses. A
/// process has the name of its container or its node. More than one process always use DDS, even if
/// the file does not configure it.
std::vector<SystemDescription> split(const SystemDescription& system, Composition composition);

}  // namespace takt

#endif  // TAKT_CONTAINERS_CONFIGURATION_SYSTEM_DESCRIPTION_HPP_
