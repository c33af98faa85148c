// Facts that no number of a model covers: a chain that depends on one has no guarantee.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include <fmt/format.h>

#include "takt/containers/component.hpp"
#include "takt/containers/model/coverage.hpp"
#include "takt/containers/model/model_builder.hpp"
#include "takt/nodes/lifecycle_node.hpp"

namespace takt {

// Callbacks of the measured run that no constructor of the file's components has made: they may be
// made at run time, and their arrivals are not known.
void ModelBuilder::add_unknown_callbacks() {
  if (measured_ == nullptr) return;
  // A program may have nodes that its file does not name: the program's own executors serve them.
  const bool may_have_others =
      processes_.front().is_program &&
      std::any_of(model_.system.callbacks.begin(), model_.system.callbacks.end(),
                  [&](const auto& callback) { return measured_callbacks_.count(callback.name); });
  for (const MeasuredCallback& seen : measured_->callbacks) {
    if (seen.executions == 0) continue;
    const auto& known = model_.system.callbacks;
    if (std::any_of(known.begin(), known.end(),
                    [&](const auto& callback) { return callback.name == seen.name; }))
      continue;
    const std::set<std::optional<std::size_t>> executors = executors_of_maker(seen.name);
    if (executors.empty()) {
      if (may_have_others) continue;
      throw Error(fmt::format("the model has a callback '{}', which ran {} times, and '{}' has no "
                              "node of that name",
                              seen.name, seen.executions, description_.file),
                  "give the model of this system", measured_->path);
    }
    const std::string why = fmt::format(
        "'{}' ran {} times in the model, and its node has not made it when it was constructed: "
        "nothing is known of how often it runs",
        seen.name, seen.executions);
    for (const auto& executor : executors) {
      if (executor) {
        model_.system.executors[*executor].unknown = why;
      } else {
        assume({.id = "callbacks",
                .state = Assumption::State::not_covered,
                .text = why,
                .name = {},
                .source = measured_source(),
                .executor = {}});
      }
    }
  }
}

// Those that serve the groups of the node with a callback of this name; empty: there is none.
std::set<std::optional<std::size_t>> AssumptionFinder::executors_of_maker(
    const std::string& callback) const {
  std::set<std::optional<std::size_t>> result;
  for (const ModelledProcess& process : processes_) {
    for (const ModelledProcess::Member& member : process.nodes) {
      if (!callback.starts_with(member.node->fully_qualified_name() + "/")) continue;
      for (const auto& part : parts_of(process, member)) result.insert(part);
    }
  }
  return result;
}

// A key without an entry is of a library, or was forgotten in the table.
void AssumptionFinder::add_keys_not_covered() {
  for (const WrittenKey& key : description_.keys) {
    const CoverageEntry* const entry = coverage_of(key.map, key.key);
    if (entry != nullptr && entry->coverage != Coverage::not_covered) continue;
    const bool is_of_executor = key.map == "an executor", is_of_order = key.map == "a scheduler";
    Fact fact{.id = key.key,
              .state = Assumption::State::not_covered,
              .text = entry != nullptr
                          ? std::string(entry->why)
                          : std::string("a library brings it, and nothing tells how it "
                                        "counts"),
              .name = {},
              .source = declared_at(key.where),
              .executor = {}};
    if (!is_of_executor && !is_of_order) {
      assume(std::move(fact));
      continue;
    }
    const auto described =
        std::find_if(description_.executors.begin(), description_.executors.end(),
                     [&](const ExecutorDescription& other) { return other.name == key.entry; });
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      const ModelledPart& part = parts_[i];
      // If one executor names a library, it applies to all executors of this type.
      const bool has_its_type = key.key == "library" && described != description_.executors.end() &&
                                part.description->type == described->type;
      const bool is_it = part.description->name == key.entry || has_its_type;
      if (is_of_executor ? !is_it : part.scheduler != key.entry) continue;
      fact.executor = i;
      assume(fact);
    }
  }
}

// The executors of the same process that serve a node's groups; nullopt: an executor without
// callbacks so far: nobody knows which chains it delays.
std::vector<std::optional<std::size_t>> AssumptionFinder::parts_of(
    const ModelledProcess& process, const ModelledProcess::Member& node) const {
  std::vector<std::optional<std::size_t>> result;
  for (const std::string& executor : node.executors) {
    const std::size_t before = result.size();
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      if (parts_[i].process == &process && parts_[i].description->name == executor) {
        result.emplace_back(i);
      }
    }
    if (result.size() == before) result.emplace_back();
  }
  return result;
}

// A lifecycle node makes callbacks when it is configured, which the analysis does not do. Those
// that a run has shown are in the model.
void AssumptionFinder::add_lifecycle_nodes() {
  for (const ModelledProcess& process : processes_) {
    for (const ModelledProcess::Member& member : process.nodes) {
      const auto* const node = dynamic_cast<const LifecycleNode*>(member.node.get());
      if (node == nullptr || takt::says_all(member)) continue;
      const std::string name = node->fully_qualified_name();
      if (measured_ != nullptr && measured_->active_nodes.contains(name)) continue;
      for (const auto& part : parts_of(process, member)) {
        assume({.id = "lifecycle",
                .state = Assumption::State::not_covered,
                .text = "{} is a lifecycle node: it may make callbacks when it is configured, and "
                        "only a model of a run in which it was active knows them",
                .name = "'" + name + "'",
                .source = declared_at(member.where),
                .executor = part});
      }
    }
  }
}

// What nodes send that the program has besides those of the file.
void AssumptionFinder::add_other_nodes(std::size_t receiver) {
  const Entity& entity = *callbacks_[receiver]->entity;
  const std::string topic = entity.topic();
  const bool is_service = entity.kind() == EntityKind::service;
  for (const auto& [node, topics] : process_of(receiver)->others) {
    const bool sends = std::any_of(topics.begin(), topics.end(), [&](const std::string& its) {
      return its == topic ||
             (is_service && its.starts_with('r') && service_of(its) == service_of(topic));
    });
    if (!sends) continue;
    assume_of(receiver, "no_other_publishers",
              fmt::format("'{}', a node of the program that is not in the file, may send to {{}}: "
                          "name it in `nodes`",
                          node),
              "the program", Assumption::State::refuted);
  }
}

// Threads of Takt and of DDS to which the file gives a priority above those of callbacks.
void AssumptionFinder::add_reserved_threads() {
  if (description_.realtime == Realtime::off) return;
  for (const ThreadDescription& thread : description_.threads) {
    const std::string& name = thread.attributes.name;
    const CoverageEntry* const entry = coverage_of("a reserved thread", name);
    if (entry != nullptr && entry->coverage == Coverage::used) {
      add_reserved_thread(thread.attributes, "threads." + name);
    }
    if (description_.dds && description_.dds->threads.name == name) {
      add_reserved_thread(thread.attributes, "dds.threads");
    }
  }
}

void AssumptionFinder::add_reserved_thread(const ThreadAttributes& own, const std::string& key) {
  if (!is_realtime(own.policy)) return;
  for (const ModelledThread& thread : threads_) {
    const ThreadAttributes& other = thread.attributes;
    const bool is_after = own.policy != ThreadPolicy::deadline &&
                          (other.policy == ThreadPolicy::deadline || own.priority < other.priority);
    if (is_after) continue;
    const std::vector<int>& its = other.affinity.empty() ? cpus() : other.affinity;
    const std::vector<int>& mine = own.affinity.empty() ? cpus() : own.affinity;
    const bool may_meet =
        std::find_first_of(mine.begin(), mine.end(), its.begin(), its.end()) != mine.end();
    if (!may_meet) continue;
    assume({.id = key,
            .state = Assumption::State::not_covered,
            .text = fmt::format("thread '{}' {} before {{}}, on its CPU, for as long as it likes",
                                own.name, own.affinity.empty() ? "may run" : "runs"),
            .name = "'" + other.name + "'",
            .source = declared_at(line_of("the file", "threads")),
            .executor = thread.executor});
  }
}

}  // namespace takt
