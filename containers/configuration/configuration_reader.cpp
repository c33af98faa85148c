// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/configuration/configuration_reader.hpp"

#include <chrono>

#include <fmt/format.h>

#include "takt/base/error.hpp"
#include "takt/base/printable.hpp"
#include "takt/base/time.hpp"
#include "takt/containers/model/assumption.hpp"
#include "takt/messages/entries.hpp"

namespace takt {
namespace {

template <class T>
std::optional<T> item_of(const document::Value& value) {
  if (const T* content = std::get_if<T>(&value.content)) return *content;
  if constexpr (std::is_same_v<T, double>) {  // among other numbers, 1 is 1.0
    if (const auto integer = item_of<std::int64_t>(value)) return static_cast<double>(*integer);
  }
  return {};
}

// The list as an array of T, if all of it is.
template <class T>
std::optional<ParameterValue> array_of(const document::List& list) {
  std::vector<T> result;
  for (const document::Value& value : list) {
    const std::optional<T> item = item_of<T>(value);
    if (!item) return {};
    result.push_back(*item);
  }
  return result;
}

// Of all executors, on the CPUs that they are for.
void check_reservations(const std::vector<ThreadAttributes>& threads,
                        const MachineDescription& machine) {
  if (machine.cpus.empty()) return check_admission(threads);
  const Nanoseconds second = std::chrono::seconds(1);
  const std::chrono::duration<double> granted =
      machine.rt_runtime.value_or(second - throttled_realtime());
  check_admission(threads, static_cast<double>(machine.cpus.size()) * granted.count());
}

}  // namespace

std::map<std::string, CallbackParameterChanges> ConfigurationReader::read_changes(
    const Value& root) {
  std::map<std::string, CallbackParameterChanges> changes;
  each_in_map([&](const Value& node) { read_changes(node, changes[node.name]); })(root);
  return changes;
}

ComponentDescription ConfigurationReader::read_one(const Value& component,
                                                   const std::vector<std::string>& executors,
                                                   const LoadPolicy& policy) {
  executors_ = {executors.begin(), executors.end()};
  policy_ = &policy;
  read_component(component);
  return system_.components.empty() ? ComponentDescription{} : system_.components.front();
}

std::vector<ReferenceSection> ConfigurationReader::describe_file() {
  return describe([this](const Value& root) { read_file(root); });
}

SystemDescription ConfigurationReader::read(const Value& root) {
  const Value* const machine = document::find(root, "machine");
  names_cpus_ = machine != nullptr && document::find(*machine, "cpus") != nullptr;
  read_file(root);
  check_number_of_containers(root);
  check_that_loading_can_be_asked_for(root);
  if (system_.watches_bounds)
    check_that_one_process_runs(root, *document::find(*document::find(root, "analysis"), "watch"));
  if (!system_.modes.empty()) check_that_one_process_runs(root, *document::find(root, "modes"));
  check_cpus_of_threads();
  threads_.check_bands();
  if (const Value* executors = document::find(root, "executors"); executors != nullptr) {
    errors_.passes(executors->line,
                   [&] { check_reservations(executors_threads_, system_.machine); });
    if (errors_.size() == 0) errors_.passes(executors->line, [this] { check_spinning_threads(); });
  }
  return std::move(system_);
}

std::optional<ParameterValue> ConfigurationReader::parameter_value(const Value& value) {
  if (describes("`true` or `false`, integer, number, text, a list of one of these, or a map of "
                "them")) {
    return {};
  }
  const std::size_t errors = errors_.size();
  document::check_is_unambiguous(value, errors_);
  if (errors_.size() != errors) return {};
  if (const auto* list = std::get_if<document::List>(&value.content)) {
    std::optional<ParameterValue> array =
        array_of<std::string>(*list);  // an empty one is of any type
    if (!array) array = array_of<bool>(*list);
    if (!array) array = array_of<std::int64_t>(*list);
    if (!array) array = array_of<double>(*list);
    if (!array) refuse(value, "items of one type: numbers, texts, or true and false");
    return array;
  }
  const auto take = [](const auto& content) -> std::optional<ParameterValue> {
    using Content = std::decay_t<decltype(content)>;
    if constexpr (std::is_same_v<Content, std::monostate>)
      return {};
    else if constexpr (std::is_constructible_v<ParameterValue, Content>)
      return content;
    return {};
  };
  std::optional<ParameterValue> result = std::visit(take, value.content);
  if (!result) refuse(value, "a value, or leave it out");
  return result;
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
       each_in_map([this](const Value& thread) { read_thread(thread); })},
      {"dds", "Joins a DDS domain.", [this](const Value& dds) { read_dds(dds); }},
      {"topics",
       "What holds for a topic's publishers and subscriptions instead of what the code says, by "
       "its full name.",
       each_in_map([this](const Value& topic) { read_topic(topic); })},
      {"schedulers", "External schedulers, by the name that their library registers.",
       each_in_map([this](const Value& scheduler) { read_scheduler(scheduler); })},
      {"wait_backends", "External wait back ends, by the name that their library registers.",
       each_in_map([this](const Value& backend) { read_wait_backend(backend); })},
      {"executors", "Executors by name.",
       each_in_map([this](const Value& executor) { read_executor(executor); })},
      {"nodes",
       "Instead of containers, the nodes of a program for rclcpp by full name. It makes them "
       "itself, and is started with [`TAKT_CONFIG`](rclcpp.md#the-environment) set to this file.",
       each_in_map([this](const Value& node) { read_node(node); })},
      {"container", "The only container. Either this key, `containers` or `nodes` is required.",
       [this](const Value& container) { system_.name = read_container(container); }},
      {"containers", "Several containers, each a separate process with a unique `name`.",
       [this](const Value& containers) { read_containers(containers); }},
      {"lifecycle", "Lifecycle nodes that Takt brings up and monitors.",
       [this](const Value& lifecycle) { read_lifecycle(lifecycle); }}};
}

void ConfigurationReader::read_file(const Value& root) {
  std::vector<Field> fields = fields_of_what_runs();
  const std::vector<Field> of_its_analysis{
      {"machine", "The machine for which `takt analyze` computes bounds; by default, this one.",
       [this](const Value& machine) { read_machine(machine); }},
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
       [this](const Value& chains) { read_chains(chains); }},
      {"modes",
       "What is left out when not all can be done, by name. `normal` is the mode without changes, "
       "in which a container begins.",
       each_in_map([this](const Value& mode) { read_mode(mode); })}};
  fields.insert(fields.end(), of_its_analysis.begin(), of_its_analysis.end());
  read_root(root, "the file", fields);
}

// Each process would know only its own part of the system, and a program more than that.
void ConfigurationReader::check_that_one_process_runs(const Value& root, const Value& value) {
  const auto refuse = [&](const std::string& why) {
    errors_.add(value.line, fmt::format("`{}` is for a file with one process: {}", value.name, why),
                "leave it out");
  };
  if (document::find(root, "nodes") != nullptr) refuse("this one is for a program");
  std::set<std::string> containers;
  for (const ComponentDescription& component : system_.components) {
    containers.insert(component.container);
  }
  if (containers.size() > 1) refuse(fmt::format("there are {}", containers.size()));
}

void ConfigurationReader::read_memory(const Value& memory) {
  read_map(
      memory, "memory",
      {{"lock",
        "Locks all present and future pages (mlockall), and keeps malloc from returning memory.",
        into(system_.lock_memory)}});
}

// Clears `is_sound` if reading adds an error.
SystemReader::Read ConfigurationReader::noting(bool& is_sound, Read read) {
  return [this, &is_sound, read = std::move(read)](const Value& value) {
    const std::size_t before = errors_.size();
    read(value);
    is_sound &= errors_.size() == before;
  };
}

// Reads a duration. `check` throws Error if it is invalid.
SystemReader::Read ConfigurationReader::into_duration(Nanoseconds& duration,
                                                      std::function<void()> check) {
  return [this, &duration, check = std::move(check)](const Value& value) {
    const bool is_set = duration != Nanoseconds::zero();
    if (describes("duration", is_set ? fmt::format("`{}`", to_string(duration)) : "")) return;
    const auto* text = std::get_if<std::string>(&value.content);
    if (text == nullptr) {
      return refuse(value, "a number and one of ns, us, ms, s, m, h, such as 20ms");
    }
    errors_.passes(value.line, [&] {
      duration = parse_duration(*text);
      check();
    });
  };
}

SystemReader::Read ConfigurationReader::into_accepted(Acceptances& accepted) {
  return each_in_map([this, &accepted](const Value& value) {
    if (is_describing()) return void(describes("text"));
    if (assumption_kind(value.name) == nullptr) {
      std::vector<std::string> ids;
      for (const AssumptionKind& kind : assumption_kinds()) ids.emplace_back(kind.id);
      errors_.add(value.line, fmt::format("no assumption is called '{}'", value.name),
                  suggest(value.name, ids));
      return;
    }
    std::string& reason = accepted[value.name];
    into(reason)(value);
    if (printable(reason) != reason) {
      errors_.add(value.line, "the reason is no line of text", "write it in one line");
    }
  });
}

std::map<std::string, CallbackParameterChanges> read_parameter_changes(const std::string& text) {
  document::Errors errors("request");
  const document::Value root = document::parse_yaml(text, errors);
  if (const std::size_t values = document::count(root); values > kMostEntries) {
    throw Error(
        fmt::format("a text with {} values is refused; send {} at most", values, kMostEntries));
  }
  auto changes = ConfigurationReader(errors).read_changes(root);
  errors.throw_if_any();
  return changes;
}

ComponentDescription read_component(const document::Value& component,
                                    const std::vector<std::string>& executors,
                                    const LoadPolicy& policy, document::Errors& errors) {
  return ConfigurationReader(errors).read_one(component, executors, policy);
}

std::optional<ParameterValue> read_parameter(const document::Value& value,
                                             document::Errors& errors) {
  return ConfigurationReader(errors).parameter_value(value);
}

std::vector<ReferenceSection> describe_configuration() {
  document::Errors none("");
  return ConfigurationReader(none).describe_file();
}

SystemDescription read_configuration(const document::Value& root, document::Errors& errors) {
  return ConfigurationReader(errors).read(root);
}

}  // namespace takt
