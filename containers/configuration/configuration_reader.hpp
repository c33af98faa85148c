// Reads and checks the configuration file.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_CONFIGURATION_CONFIGURATION_READER_HPP_
#define TAKT_CONTAINERS_CONFIGURATION_CONFIGURATION_READER_HPP_

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "takt/containers/configuration/file_threads.hpp"
#include "takt/containers/configuration/system_reader.hpp"
#include "takt/containers/set_callback_parameters.hpp"

namespace takt {

/// A list of CPUs: none is not the same as no key, which stands for all.
inline void check_is_some(const document::Value& list, document::Errors& errors) {
  const auto* const cpus = std::get_if<document::List>(&list.content);
  if (cpus == nullptr || !cpus->empty()) return;
  errors.add(list.line, "the list of CPUs is empty", "name at least one, or leave it out");
}

/// Each top-level key of the file has its own source file in `keys/`.
/// Thread safety: none.
/// Real-time: no.
class ConfigurationReader : private SystemReader {
 public:
  explicit ConfigurationReader(document::Errors& errors) : SystemReader(errors) {}

  std::map<std::string, CallbackParameterChanges> read_changes(const Value& root);
  ComponentDescription read_one(const Value& component, const std::vector<std::string>& executors,
                                const LoadPolicy& policy);
  std::vector<ReferenceSection> describe_file();
  SystemDescription read(const Value& root);
  std::optional<ParameterValue> parameter_value(const Value& value);

 private:
  void read_file(const Value& root);
  std::vector<Field> fields_of_what_runs();
  void read_memory(const Value& memory);
  Read noting(bool& is_sound, Read read);
  Read into_duration(Nanoseconds& duration, std::function<void()> check);
  Read into_accepted(Acceptances& accepted);

  // Threads
  void read_thread(const Value& value);
  bool passes(const Value& thread, std::string_view key, const std::function<void()>& check);
  Read into_policy(ThreadPolicy& policy);
  void read_cpu(const Value& value, std::vector<int>& cpus);
  Read into_priority(int& priority, int& highest);

  // DDS
  void read_dds(const Value& value);
  void read_security(const Value& value, DdsSecurity& security);
  struct PemFile {
    std::string_view mark, kind;
  };
  Read into_file(std::string& path, PemFile wanted);
  Read into_domain(int& domain);
  Read into_discovery(DiscoveryRange& discovery);

  // Topics
  void read_topic(const Value& value);
  Read into_delay(DelayDescription& delay);
  Read into_profile(std::optional<QoS>& profile);

  // Machine
  void read_machine(const Value& value);
  Read into_cpus(std::vector<int>& cpus);
  void read_overheads(const Value& value);
  void read_speed(const Value& value);
  void check_cpus_of_threads();
  /// `machine: cpus` need not be here: then threads are checked against these.
  bool names_cpus_ = false;
  Field waits_field(std::optional<Nanoseconds>& waits);
  Read into_rt_runtime(std::optional<Nanoseconds>& runtime);

  // Schedulers and wait back ends
  void read_scheduler(const Value& value);
  void read_wait_backend(const Value& value);

  // Executors
  void read_executor(const Value& value);
  using Threads = std::vector<ThreadAttributes>;  // one for each name in an executor's list
  std::vector<Field> executor_fields(ExecutorDescription& executor, Threads& threads,
                                     bool& is_sound);
  void read_executors_thread(const Value& thread, ExecutorDescription& executor, Threads& threads);
  Read into_trigger(TriggerOptions& trigger);
  void check_spinning_threads();
  Read into_executor(std::string& target);

  // Containers
  void read_containers(const Value& value);
  void check_number_of_containers(const Value& root);
  void check_file_of_program(const Value& root, const Value& nodes);
  void check_that_loading_can_be_asked_for(const Value& root);
  void check_that_one_process_runs(const Value& root, const Value& value);
  std::string read_container(const Value& value);
  Read into_load(LoadPolicy& load);
  void read_folder(const Value& value, LoadPolicy& load);
  Read into_restart(RestartOptions& restart);

  // Lifecycle
  void read_lifecycle(const Value& value);
  static LifecycleDescription::ManagedNode* find_managed(LifecycleDescription& lifecycle,
                                                         std::string_view name);
  std::string find_node(const Value& value);
  std::string find_node(int line, const std::string& name);
  void read_dependencies(const Value& value, LifecycleDescription& lifecycle);

  // Components
  void read_component(const Value& value);
  void read_node(const Value& value);
  std::vector<Field> serving_fields(ComponentDescription& node);
  void read_library(const Value& value, std::string& library);
  std::string beside(const std::string& path) const;
  void read_parameters(const Value& map, const std::string& prefix,
                       ComponentDescription& component);
  void read_remap(const Value& value, ComponentDescription& component);
  void read_group(const Value& value, ComponentDescription& component);
  void read_callback(const Value& value, ComponentDescription& component);
  Read into_execution(std::optional<ExecutionDescription>& execution);
  Read into_arrival(std::optional<ArrivalDescription>& arrival);
  Read into_distances(std::vector<Nanoseconds>& distances);
  void read_callback_map(const Value& value, std::string_view whose,
                         const std::vector<Field>& fields, const CallbackParameters& parameters);
  std::vector<Field> parameter_fields(CallbackParameters& parameters);
  void read_changes(const Value& value, CallbackParameterChanges& changes);

  // Chains
  void read_chains(const Value& value);
  void read_chain(const Value& value);
  void read_step(const Value& value, ChainDescription& chain,
                 std::set<std::pair<std::string, std::string>>& steps);

  // Modes
  void read_mode(const Value& value);
  std::optional<ModeDescription::Callback> mode_callback(const Value& value);
  void check_mode(const Value& value, const ModeDescription& mode);

  const LoadPolicy* policy_ = nullptr;  // applies to requests; nullptr: a file may load anything
  std::set<std::string> broken_;        // schedulers and wait back ends, which were reported
  FileThreads threads_{errors_};
  Threads executors_threads_;                   // of all executors
  std::set<std::string> executors_{"default"};  // exists in every system
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_CONFIGURATION_CONFIGURATION_READER_HPP_
