// The configuration file: its keys, and what is checked about them.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <set>

#include <fmt/format.h>

#include "takt/containers/component.hpp"
#include "takt/containers/duration.hpp"
#include "takt/containers/system_reader.hpp"
#include "takt/executors/executor.hpp"

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

class ConfigurationReader : private SystemReader {
 public:
  explicit ConfigurationReader(document::Errors& errors) : SystemReader(errors) {}

  SystemDescription read(const Value& root) {
    read_map(
        root, "the file",
        {{"realtime", into(system_.realtime, {{"require", Realtime::require},
                                              {"prefer", Realtime::prefer},
                                              {"off", Realtime::off}})},
         {"memory", [this](const Value& memory) { read_memory(memory); }},
         {"cpu_dma_latency_us",
          [this](const Value& value) { into(system_.cpu_dma_latency_us.emplace(), 0)(value); }},
         {"threads", each_in_map([this](const Value& thread) { read_thread(thread); })},
         {"executors", each_in_map([this](const Value& executor) { read_executor(executor); })},
         {"container", [this](const Value& container) { read_container(container); }},
         {"containers", [this](const Value& containers) { read_containers(containers); }}});
    check_number_of_containers(root);
    return std::move(system_);
  }

 private:
  void read_memory(const Value& memory) {
    read_map(memory, "memory", {{"lock", into(system_.lock_memory)}});
  }

  // Notes in `is_sound` when the reading adds an error.
  Read noting(bool& is_sound, Read read) {
    return [this, &is_sound, read = std::move(read)](const Value& value) {
      const std::size_t before = errors_.size();
      read(value);
      is_sound &= errors_.size() == before;
    };
  }

  // ---- Threads ----

  void read_thread(const Value& value) {
    ThreadAttributes asked{.name = value.name};
    bool is_sound = true;
    read_map(
        value, "a thread",
        {{"policy", noting(is_sound, into_policy(asked.policy))},
         {"priority", noting(is_sound, into(asked.priority))},
         {"nice", noting(is_sound, into(asked.nice))},
         {"affinity", each_in_list([&](const Value& cpu) { read_cpu(cpu, asked.affinity); })}});
    // Each by itself, so that each error has its own line and none hides another.
    const ThreadAttributes urgency{.policy = asked.policy, .priority = asked.priority};
    ThreadAttributes niceness = urgency;
    niceness.nice = asked.nice;
    if (!is_sound || !check(value, "priority", urgency) || !check(value, "nice", niceness)) {
      asked = {.name = asked.name};  // or its executors would complain again
    }
    threads_.try_emplace(asked.name, asked);
    system_.threads.push_back({std::move(asked), errors_.where(value.line)});
  }

  bool check(const Value& thread, std::string_view key, const ThreadAttributes& attributes) {
    const Value* place = document::find(thread, key);
    return errors_.passes((place != nullptr ? *place : thread).line, [&] { attributes.check(); });
  }

  Read into_policy(ThreadPolicy& policy) {
    return [this, &policy](const Value& value) {
      std::string name;
      into_checked(name, [&] { policy = thread_policy(name); })(value);
    };
  }

  void read_cpu(const Value& value, std::vector<int>& cpus) {
    int cpu = -1;
    into(cpu, 0)(value);
    if (cpu < 0) return;
    if (errors_.passes(value.line, [&] { ThreadAttributes{.affinity = {cpu}}.check(); })) {
      cpus.push_back(cpu);
    }
  }

  // ---- Executors ----

  void read_executor(const Value& value) {
    ExecutorDescription executor{.name = value.name, .where = errors_.where(value.line)};
    ExecutorOptions options{.name = value.name};
    bool is_sound = true;
    read_map(value, "an executor",
             {{"type", noting(is_sound, into_checked(executor.type,
                                                     [&] { executors().check(executor.type); }))},
              {"scheduler",
               noting(is_sound, into_checked(executor.scheduler,
                                             [&] { schedulers().check(executor.scheduler); }))},
              {"threads", each_in_list([&](const Value& thread) {
                 std::string name;
                 into(name)(thread);
                 if (name.empty()) return;
                 executor.threads.push_back(name);
                 options.threads.push_back(find_thread(thread.line, name));
               })}});
    options.scheduler = executor.scheduler;
    // Only the type itself knows how many threads it can take. Making it starts none.
    if (is_sound) errors_.passes(value.line, [&] { executors().make(executor.type, options); });
    executors_.insert(executor.name);
    system_.executors.push_back(std::move(executor));
  }

  // The attributes of what is called so; those of a plain thread, and an error, when nothing is.
  ThreadAttributes find_thread(int line, const std::string& name) {
    if (const auto found = threads_.find(name); found != threads_.end()) return found->second;
    std::vector<std::string> names;
    for (const auto& [known, attributes] : threads_) names.push_back(known);
    errors_.add(line, fmt::format("no thread is called '{}'", name),
                names.empty() ? "describe it under 'threads'" : suggest(name, names));
    return {};
  }

  Read into_executor(std::string& target) {
    return into_checked(target, [this, &target] {
      if (executors_.contains(target)) return;
      throw Error(fmt::format("no executor is called '{}'", target),
                  suggest(target, std::vector(executors_.begin(), executors_.end())));
    });
  }

  // ---- Containers ----

  void read_containers(const Value& value) {
    bool is_first = true;
    each_in_list([&](const Value& container) {
      if (is_first) {
        read_container(container);
      } else {
        errors_.add(container.line, "several containers in one file are not built yet",
                    "write a file for each");
      }
      is_first = false;
    })(value);
    if (is_first && std::holds_alternative<document::List>(value.content)) {
      errors_.add(value.line, "the list of containers is empty", "describe one");
    }
  }

  void check_number_of_containers(const Value& root) {
    if (!std::holds_alternative<document::Map>(root.content)) return;
    const Value* one = document::find(root, "container");
    const Value* several = document::find(root, "containers");
    if (one == nullptr && several == nullptr) {
      errors_.add(root.line, "the file describes no container",
                  "add the key 'containers' with a list of components");
    } else if (one != nullptr && several != nullptr) {
      errors_.add(std::max(one->line, several->line),
                  "the file has both 'container' and 'containers'", "leave out one of the two");
    }
  }

  void read_container(const Value& value) {
    const std::size_t before = system_.components.size();
    const Value* place = document::find(value, "components");
    read_map(
        value, "a container",
        {{"name", into(system_.name)},
         {"components", each_in_list([this](const Value& item) { read_component(item); }), true}});
    if (place != nullptr && std::holds_alternative<document::List>(place->content) &&
        system_.components.size() == before) {
      errors_.add(place->line, fmt::format("the container '{}' is empty", system_.name),
                  "list at least one component");
    }
  }

  // ---- Components ----

  void read_component(const Value& value) {
    ComponentDescription component{.where = errors_.where(value.line)};
    read_map(value, "a component",
             {{"component",
               into_checked(component.type, [&] { components().check(component.type); }), true},
              {"name", into_node_name(component.name)},
              {"namespace", into_name_space(component.name_space)},
              {"executor", into_executor(component.executor)},
              {"parameters",
               [&](const Value& parameters) { read_parameters(parameters, "", component); }},
              {"remap", each_in_map([&](const Value& topic) { read_remap(topic, component); })},
              {"callback_groups",
               each_in_map([&](const Value& group) { read_group(group, component); })}});
    add(std::move(component), value.line);
  }

  void read_parameters(const Value& map, const std::string& prefix,
                       ComponentDescription& component) {
    each_in_map([&](const Value& value) {
      const std::string name = prefix + value.name;
      if (std::holds_alternative<document::Map>(value.content)) {
        return read_parameters(value, name + ".", component);
      }
      const std::optional<ParameterValue> parameter = parameter_value(value);
      if (!parameter) return;
      component.parameter_lines.try_emplace(name, errors_.where(value.line));
      if (!component.parameters.try_emplace(name, *parameter).second) {  // "a.b", and "b" in "a"
        errors_.add(value.line, fmt::format("the parameter '{}' has a value already", name),
                    "leave out one of the two");
      }
    })(map);
  }

  std::optional<ParameterValue> parameter_value(const Value& value) {
    if (const auto* list = std::get_if<document::List>(&value.content)) {
      std::optional<ParameterValue> array = array_of<bool>(*list);
      if (!array) array = array_of<std::int64_t>(*list);
      if (!array) array = array_of<double>(*list);
      if (!array) array = array_of<std::string>(*list);
      if (array && !list->empty()) return array;
      refuse(value, list->empty() ? "at least one item, which tells the type"
                                  : "items of one type: numbers, texts, or true and false");
      return {};
    }
    const auto take = [](const auto& content) -> std::optional<ParameterValue> {
      if constexpr (std::is_constructible_v<ParameterValue, decltype(content)>) return content;
      return {};
    };
    std::optional<ParameterValue> result = std::visit(take, value.content);
    if (!result) refuse(value, "a value, or leave it out");
    return result;
  }

  void read_remap(const Value& value, ComponentDescription& component) {
    std::string topic;
    into_topic(topic)(value);
    component.remap.try_emplace(value.name, topic);
    component.remap_lines.try_emplace(value.name, errors_.where(value.line));
  }

  void read_group(const Value& value, ComponentDescription& component) {
    CallbackGroupDescription group{.where = errors_.where(value.line)};
    read_map(value, "a callback group",
             {{"executor", into_executor(group.executor)},
              {"priority", into(group.parameters.priority)},
              {"deadline", [&](const Value& deadline) {
                 read_deadline(deadline, group.parameters.deadline);
               }}});
    component.callback_groups.try_emplace(value.name, std::move(group));
  }

  void read_deadline(const Value& value, Nanoseconds& deadline) {
    const auto* text = std::get_if<std::string>(&value.content);
    if (text == nullptr) {
      return refuse(value, "a number and one of ns, us, ms, s, m, h, such as 20ms");
    }
    errors_.passes(value.line, [&] {
      deadline = parse_duration(*text);
      if (deadline == Nanoseconds::zero()) {
        throw Error("a deadline of 0 cannot be met", "leave it out, or give it time");
      }
    });
  }

  std::map<std::string, ThreadAttributes> threads_;
  std::set<std::string> executors_{"default"};  // always there
};

}  // namespace

SystemDescription read_configuration(const document::Value& root, document::Errors& errors) {
  return ConfigurationReader(errors).read(root);
}

}  // namespace takt
