// What a configuration file says, after it was read and checked.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_CONFIGURATION_SYSTEM_DESCRIPTION_HPP_
#define TAKT_CONTAINERS_CONFIGURATION_SYSTEM_DESCRIPTION_HPP_

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "takt/base/logger.hpp"
#include "takt/callback_groups/callback_group.hpp"
#include "takt/containers/load_policy.hpp"
#include "takt/executors/executor.hpp"
#include "takt/nodes/chain.hpp"
#include "takt/nodes/parameter.hpp"
#include "takt/sched/threads/thread_attributes.hpp"
#include "takt/transport/dds/participant.hpp"

namespace takt {

/// Where something stands: "robot.yaml:12".
using SourceLine = std::string;

/// One entry of `threads:`.
struct ThreadDescription {
  ThreadAttributes attributes;  // its name is the entry's key
  SourceLine where;
};

/// One entry of `executors:`.
struct ExecutorDescription {
  std::string name;
  std::string type = "single_threaded";
  std::string scheduler;             // empty: the executor's own
  std::vector<std::string> threads;  // names in `threads:`; empty: none given
  std::string wait = "auto";         // or a wait back end
  Nanoseconds early_wake{0};         // see ExecutorOptions
  Isolation per = Isolation::node;
  TriggerOptions trigger;
  std::vector<std::string> order;
  SourceLine where;
};

/// One entry of a component's `callback_groups:`.
struct CallbackGroupDescription {
  std::string executor;  // empty: the component's
  CallbackParameters parameters;
  SourceLine where;
};

/// One entry of a component's `callbacks:`.
struct CallbackDescription {
  CallbackParameters parameters;
  SourceLine where;
};

/// One entry of `chains:`.
struct ChainDescription {
  ChainOptions options;
  /// Its callbacks by the full names of their nodes and their own; steps may be left out where
  /// there is only one way.
  std::vector<std::pair<std::string, std::string>> path;
  SourceLine where;
};

/// What an exception that leaves a callback of a component does.
enum class OnException {
  terminate,    // ends the container
  remove_node,  // takes the component's node from its executors
  ignore,       // is told, and nothing else
};

/// One component of a container.
struct ComponentDescription {
  std::string container = "takt";  // the container's name
  std::string type;                // the registered class: "demo::Lidar"
  std::string library;             // that registers it; empty: the index, or the program, has it
  std::string name;                // empty: the one the class gives itself
  std::string name_space;
  std::string executor;  // a name in `executors:`; empty: "default"
  Parameters parameters;
  std::map<std::string, std::string, std::less<>> remap;
  std::map<std::string, CallbackGroupDescription, std::less<>> callback_groups;
  std::map<std::string, CallbackDescription, std::less<>> callbacks;
  OnException on_exception = OnException::terminate;
  std::optional<LogLevel> log_level;  // of its node; nullopt: the process's
  SourceLine where;
  // For errors about names that only the constructor makes: parameters, remaps by key.
  std::map<std::string, SourceLine, std::less<>> parameter_lines, remap_lines;
};

/// With its namespace: "/front/lidar"; empty when the class names itself.
std::string full_name(const ComponentDescription& component);

/// When the process of a container is started again after its end.
struct RestartOptions {
  enum class Policy { never, on_failure, always };
  Policy policy = Policy::never;
  Nanoseconds delay = std::chrono::seconds(1);
  int most = 5;  // how often in one run
};

/// The lifecycle nodes of a system that are brought up together.
struct LifecycleDescription {
  struct ManagedNode {
    std::string name;                     // with its namespace: "/map_server"
    std::vector<std::string> depends_on;  // nodes that are active while it is
  };
  enum class OnLoss {
    deactivate_dependents,  // until the lost one is back, and active
    shutdown,               // of all managed nodes
    report,                 // and nothing else
  };
  std::vector<ManagedNode> bring_up;  // in this order
  /// A process that has told nothing for so long is lost.
  Nanoseconds heartbeat = std::chrono::seconds(2);
  OnLoss on_loss = OnLoss::deactivate_dependents;
  std::string manager;  // the name of the process that manages: see split
  SourceLine where;
};

/// A whole file, or the part of it that one process runs. Components that name no executor are
/// under the one that Takt assigns to their chain, else under one called "default" (single_threaded
/// unless the file describes it).
struct SystemDescription {
  std::string file;
  std::string name = "takt";  // of the first container, or of the process
  Realtime realtime = Realtime::prefer;
  bool lock_memory = false;
  bool is_split_off =
      false;  // to be measured or compared: it answers no services but a lifecycle's
  std::optional<int> cpu_dma_latency_us;  // held while running; nullopt: left alone
  std::optional<DdsOptions> dds;          // nullopt: not asked for
  TopicQos topics;
  std::map<std::string, SourceLine, std::less<>> topic_lines;  // in a whole file only
  std::map<std::string, SourceLine, std::less<>> must_match;   // the topics that need both sides
  std::vector<ThreadDescription> threads;
  std::vector<ExecutorDescription> executors;
  std::vector<ComponentDescription> components;
  std::map<std::string, RestartOptions, std::less<>> restarts;  // by the container's name
  std::map<std::string, LoadPolicy, std::less<>> loads;         // by the container's name
  std::vector<std::string> libraries;                           // named by the file, see LoadPolicy
  std::optional<LifecycleDescription> lifecycle;
  std::vector<ChainDescription> chains;
  bool finds_chains = false;  // `chains: auto`: every way from a timer to where nothing follows
  SourceLine chains_where;
  std::vector<std::string> notes;  // what the reader wants the user to know
};

/// What the process of this description loads on request: as its first container, which it is
/// called after.
LoadPolicy load_policy(const SystemDescription& process);

/// All errors of a file, each as `FILE:LINE: what; what to do`.
class ConfigurationError : public Error {
 public:
  explicit ConfigurationError(std::vector<std::string> errors);
  const std::vector<std::string>& errors() const noexcept { return errors_; }

 private:
  std::vector<std::string> errors_;
};

/// Reads a configuration file (YAML), or a workload in the iRobot JSON format (a name that ends in
/// .json), which becomes a configuration of workload components. Constructs nothing. Throws
/// ConfigurationError with everything that is wrong.
SystemDescription read_system(const std::string& path);

/// Which components share a process.
enum class Composition {
  file,      // those of one container, as the file says
  single,    // all
  per_node,  // none
};
/// The system as one description for each process, each with the executors that it uses. A process
/// is called like its container, or its node. Several processes are on DDS, whether or not the file
/// says so.
std::vector<SystemDescription> split(const SystemDescription& system, Composition composition);

}  // namespace takt

#endif  // TAKT_CONTAINERS_CONFIGURATION_SYSTEM_DESCRIPTION_HPP_
