// Reads and checks the configuration file.
// SPDX-License-Identifier: Apache-2.0
#include <map>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/containers/configuration/keys/readers.hpp"
#include "takt/messages/entries.hpp"

namespace takt {
namespace {

/// Reads the top level of the file. The values of its keys have readers in `keys/`.
/// Thread safety: none. Real-time: no.
class ConfigurationReader : private KeyReader {
 public:
  using KeyReader::KeyReader;
  SystemDescription read(const Value& root);
  std::vector<ReferenceSection> describe_file() {
    return describe([this](const Value& root) { read_file(root); });
  }

 private:
  void read_file(const Value& root);
  std::vector<Field> fields_of_what_runs();
  void read_memory(const Value& memory);
};

SystemDescription ConfigurationReader::read(const Value& root) {
  const Value* const machine = document::find(root, "machine");
  file_.names_cpus = machine != nullptr && document::find(*machine, "cpus") != nullptr;
  read_file(root);
  ContainerReader(file_).check(root);
  MachineReader(file_).check_cpus_of_threads();
  file_.threads.check_bands();
  for (const char* const key : {"executors", "threads"}) {
    const Value* const where = document::find(root, key);
    if (where == nullptr) continue;
    ExecutorReader(file_).check_threads(*where);
    break;
  }
  return std::move(system_);
}

std::vector<ConfigurationReader::Field> ConfigurationReader::fields_of_what_runs() {
  return {
      {"realtime",
       "What to do if the system refuses real-time privileges. `require`: fail. `prefer`: "
       "continue, and report it in the notes. `off`: request only thread names and CPUs, and do "
       "not lock memory.",
       into(
           system_.realtime,
           {{"require", Realtime::require}, {"prefer", Realtime::prefer}, {"off", Realtime::off}})},
      {"memory", "Memory settings.", [this](const Value& memory) { read_memory(memory); }},
      {"cpu_dma_latency_us",
       "Keeps `/dev/cpu_dma_latency` open with this value while the container lives, which limits "
       "CPU idle states. By default, the device is not used.",
       into(system_.cpu_dma_latency_us, 0)},
      {"threads", "Thread attributes by name, for executors and DDS.",
       each_in_map([this](const Value& thread) { ThreadReader(file_).read(thread); })},
      {"dds", "Joins a DDS domain.", [this](const Value& dds) { DdsReader(file_).read(dds); }},
      {"topics",
       "What holds for a topic's publishers and subscriptions instead of what the code says, by "
       "its full name.",
       each_in_map([this](const Value& topic) { TopicReader(file_).read(topic); })},
      {"schedulers", "External schedulers, by the name that their library registers.",
       each_in_map(
           [this](const Value& scheduler) { ExecutorReader(file_).read_scheduler(scheduler); })},
      {"wait_backends", "External wait back ends, by the name that their library registers.",
       each_in_map(
           [this](const Value& backend) { ExecutorReader(file_).read_wait_backend(backend); })},
      {"executors", "Executors by name.", each_in_map([this](const Value& executor) {
         ExecutorReader(file_).read_executor(executor);
       })},
      {"nodes",
       "Instead of containers, the nodes of a program for rclcpp by full name. It makes them "
       "itself, and is started with [`TAKT_CONFIG`](rclcpp.md#the-environment) set to this file.",
       each_in_map([this](const Value& node) { ComponentReader(file_).read_node(node); })},
      {"container", "The only container. Either this key, `containers` or `nodes` is required.",
       [this](const Value& container) {
         system_.name = ContainerReader(file_).read_container(container);
       }},
      {"containers", "Several containers, each a separate process with a unique `name`.",
       [this](const Value& containers) { ContainerReader(file_).read_containers(containers); }},
      {"lifecycle", "Lifecycle nodes that Takt brings up and monitors.",
       [this](const Value& lifecycle) { LifecycleReader(file_).read(lifecycle); }}};
}

void ConfigurationReader::read_file(const Value& root) {
  std::vector<Field> fields = fields_of_what_runs();
  const std::vector<Field> of_its_analysis{
      {"machine", "The machine for which `takt analyze` computes bounds; by default, this one.",
       [this](const Value& machine) { MachineReader(file_).read(machine); }},
      {"model",
       "A file of `takt model`, with measured execution times and arrivals, for `takt analyze`. "
       "A relative path counts from this file.",
       [this](const Value& model) {
         into(system_.model)(model);
         if (!system_.model.empty()) system_.model = beside(system_.model);
       }},
      {"analysis", "What `takt run` does of `takt analyze`.",
       [this](const Value& analysis) {
         read_map(analysis, "an analysis",
                  {{"watch",
                    "As `takt run --watch-bounds`: compares what runs with what the bounds of its "
                    "chains rest on.",
                    into(system_.watches_bounds)}});
       }},
      {"accept",
       "Assumptions of `takt analyze` that hold for another reason, by id: see "
       "[assumptions](guarantees.md#assumptions). The reason is a text, and stands beside the "
       "verdict.",
       into_accepted(system_.accepted)},
      {"priorities",
       "How callbacks get a priority that this file does not give. `picas`: from their chains. "
       "`rate_monotonic`: the more often one runs, the more urgent it is; a subscription runs as "
       "often as the fastest timer whose messages reach it. See `takt plan`. By default `picas`, "
       "where the code gives no priority either.",
       into(system_.priorities,
            Words<PriorityMethod>{{"picas", PriorityMethod::picas},
                                  {"rate_monotonic", PriorityMethod::rate_monotonic}})},
      {"chains",
       "Sequences of callbacks whose end-to-end latency is measured. `auto`: every path from a "
       "timer to its last callback is a chain; a shorter period means a higher criticality.",
       [this](const Value& chains) { ChainReader(file_).read(chains); }},
      {"modes",
       "What is left out when not all can be done, by name. `normal` is the mode without changes, "
       "in which a container begins.",
       each_in_map([this](const Value& mode) { ModeReader(file_).read(mode); })}};
  fields.insert(fields.end(), of_its_analysis.begin(), of_its_analysis.end());
  read_root(root, "the file", fields);
}

void ConfigurationReader::read_memory(const Value& memory) {
  read_map(
      memory, "memory",
      {{"lock",
        "Locks all present and future pages (mlockall), and keeps malloc from returning memory.",
        into(system_.lock_memory)}});
}

}  // namespace

std::map<std::string, CallbackParameterChanges> read_parameter_changes(const std::string& text) {
  document::Errors errors("request");
  const document::Value root = document::parse_yaml(text, errors);
  if (const std::size_t values = document::count(root); values > kMostEntries) {
    throw Error(
        fmt::format("a text with {} values is refused; send {} at most", values, kMostEntries));
  }
  ConfigurationReading request(errors);
  auto changes = CallbackReader(request).read_changes(root);
  errors.throw_if_any();
  return changes;
}

ComponentDescription read_component(const document::Value& component,
                                    const std::vector<std::string>& executors,
                                    const LoadPolicy& policy, document::Errors& errors) {
  ConfigurationReading request(errors);
  request.executors = {executors.begin(), executors.end()};
  request.policy = &policy;
  ComponentReader(request).read_component(component);
  auto& read = request.system.components;
  return read.empty() ? ComponentDescription{} : std::move(read.front());
}

std::optional<ParameterValue> read_parameter(const document::Value& value,
                                             document::Errors& errors) {
  ConfigurationReading one(errors);
  return ComponentReader(one).parameter_value(value);
}

std::vector<ReferenceSection> describe_configuration() {
  document::Errors none("");
  ConfigurationReading file(none);
  return ConfigurationReader(file).describe_file();
}

SystemDescription read_configuration(const document::Value& root, document::Errors& errors) {
  ConfigurationReading file(errors);
  return ConfigurationReader(file).read(root);
}

}  // namespace takt
