// Read the keys of the configuration file, one class for each source file beside this one.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_CONFIGURATION_KEYS_READERS_HPP_
#define TAKT_CONTAINERS_CONFIGURATION_KEYS_READERS_HPP_

#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "takt/containers/configuration/key_reader.hpp"
#include "takt/containers/set_callback_parameters.hpp"

namespace takt {

class ThreadReader : private KeyReader {
 public:
  using KeyReader::KeyReader;
  void read(const Value& thread);

 private:
  Read into_policy(ThreadPolicy& policy);
  void read_cpu(const Value& value, std::vector<int>& cpus);
  Read into_priority(int& priority, int& highest);
};

class DdsReader : private KeyReader {
 public:
  using KeyReader::KeyReader;
  void read(const Value& dds);

 private:
  struct PemFile {
    std::string_view mark, kind;
  };
  void read_security(const Value& value, DdsSecurity& security);
  Read into_file(std::string& path, PemFile wanted);
  Read into_domain(int& domain);
  Read into_discovery(DiscoveryRange& discovery);
};

class TopicReader : private KeyReader {
 public:
  using KeyReader::KeyReader;
  void read(const Value& topic);

 private:
  Read into_delay(DelayDescription& delay);
  Read into_profile(std::optional<QoS>& profile);
};

class MachineReader : private KeyReader {
 public:
  using KeyReader::KeyReader;
  void read(const Value& machine);
  void check_cpus_of_threads();

 private:
  Read into_cpus(std::vector<int>& cpus);
  void read_overheads(const Value& value);
  void read_speed(const Value& value);
  Read into_rt_runtime(std::optional<Nanoseconds>& runtime);
};

/// Reads `executors`, `schedulers` and `wait_backends`.
class ExecutorReader : private KeyReader {
 public:
  using KeyReader::KeyReader;
  void read_scheduler(const Value& scheduler);
  void read_wait_backend(const Value& backend);
  void read_executor(const Value& executor);
  void check_threads(const Value& where);

 private:
  using Threads = std::vector<ThreadAttributes>;  // one for each name in an executor's list
  std::vector<Field> executor_fields(ExecutorDescription& executor, Threads& threads,
                                     bool& is_sound);
  void read_executors_thread(const Value& thread, ExecutorDescription& executor, Threads& threads);
  void read_place(const Value& callback, std::vector<std::string>& order);
  Read into_trigger(TriggerOptions& trigger);
  void check_spinning_threads();
};

class ContainerReader : private KeyReader {
 public:
  using KeyReader::KeyReader;
  void read_containers(const Value& containers);
  /// Returns the container's name.
  std::string read_container(const Value& container);
  /// Checks the keys of the file that concern its processes together.
  void check(const Value& root);

 private:
  void check_number_of_containers(const Value& root);
  void check_file_of_program(const Value& root, const Value& nodes);
  void check_that_loading_can_be_asked_for(const Value& root);
  void check_that_one_process_runs(const Value& root, const Value& value);
  Read into_load(LoadPolicy& load);
  void read_folder(const Value& value, LoadPolicy& load);
  Read into_restart(RestartOptions& restart);
};

class LifecycleReader : private KeyReader {
 public:
  using KeyReader::KeyReader;
  void read(const Value& lifecycle);

 private:
  static LifecycleDescription::ManagedNode* find_managed(LifecycleDescription& lifecycle,
                                                         std::string_view name);
  std::string find_node(const Value& value);
  std::string find_node(int line, const std::string& name);
  void read_dependencies(const Value& value, LifecycleDescription& lifecycle);
};

class ComponentReader : private KeyReader {
 public:
  using KeyReader::KeyReader;
  void read_component(const Value& component);
  void read_node(const Value& node);
  std::optional<ParameterValue> parameter_value(const Value& value);

 private:
  std::vector<Field> serving_fields(ComponentDescription& node);
  void read_parameters(const Value& map, const std::string& prefix,
                       ComponentDescription& component);
  void read_remap(const Value& value, ComponentDescription& component);
};

/// Reads the callbacks and callback groups of components.
class CallbackReader : private KeyReader {
 public:
  using KeyReader::KeyReader;
  void read_group(const Value& value, ComponentDescription& component);
  void read_callback(const Value& value, ComponentDescription& component);
  /// The changes of a request, by node.
  std::map<std::string, CallbackParameterChanges> read_changes(const Value& root);

 private:
  void read_changes(const Value& value, CallbackParameterChanges& changes);
  Read into_execution(std::optional<ExecutionDescription>& execution);
  Read into_arrival(std::optional<ArrivalDescription>& arrival);
  Read into_distances(std::vector<Nanoseconds>& distances);
  Field waits_field(std::optional<Nanoseconds>& waits);
  std::vector<Field> parameter_fields(CallbackParameters& parameters);
  void read_callback_map(const Value& value, std::string_view whose,
                         const std::vector<Field>& fields, const CallbackParameters& parameters);
};

class ChainReader : private KeyReader {
 public:
  using KeyReader::KeyReader;
  void read(const Value& chains);

 private:
  void read_chain(const Value& value);
  void read_step(const Value& value, ChainDescription& chain,
                 std::set<std::pair<std::string, std::string>>& steps);
};

class ModeReader : private KeyReader {
 public:
  using KeyReader::KeyReader;
  void read(const Value& mode);

 private:
  std::optional<ModeDescription::Callback> mode_callback(const Value& value);
  void check_mode(const Value& value, const ModeDescription& mode);
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_CONFIGURATION_KEYS_READERS_HPP_
