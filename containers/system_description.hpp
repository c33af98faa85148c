// What a configuration file says, after it was read and checked.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_SYSTEM_DESCRIPTION_HPP_
#define TAKT_CONTAINERS_SYSTEM_DESCRIPTION_HPP_

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "takt/callback_groups/callback_group.hpp"
#include "takt/entities/parameter.hpp"
#include "takt/sched/thread_attributes.hpp"

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
  SourceLine where;
};

/// One entry of a component's `callback_groups:`.
struct CallbackGroupDescription {
  std::string executor;  // empty: the component's
  CallbackParameters parameters;
  SourceLine where;
};

/// One component of the container.
struct ComponentDescription {
  std::string type;  // the registered class: "demo::Lidar"
  std::string name;  // empty: the one the class gives itself
  std::string name_space;
  std::string executor;  // a name in `executors:`; empty: "default"
  Parameters parameters;
  std::map<std::string, std::string, std::less<>> remap;
  std::map<std::string, CallbackGroupDescription, std::less<>> callback_groups;
  SourceLine where;
  // For errors about names that only the constructor makes: parameters, remaps by key.
  std::map<std::string, SourceLine, std::less<>> parameter_lines, remap_lines;
};

/// A whole file: one container. Components that name no executor are under one called "default"
/// (single_threaded unless the file describes it).
struct SystemDescription {
  std::string file;
  std::string name = "takt";  // of the container
  Realtime realtime = Realtime::prefer;
  bool lock_memory = false;
  std::optional<int> cpu_dma_latency_us;  // held while running; nullopt: left alone
  std::vector<ThreadDescription> threads;
  std::vector<ExecutorDescription> executors;
  std::vector<ComponentDescription> components;
  std::vector<std::string> notes;  // what the reader wants the user to know
};

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

}  // namespace takt

#endif  // TAKT_CONTAINERS_SYSTEM_DESCRIPTION_HPP_
