// For tests: what the analysis says of the first chain of a file.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_MODEL_BOUND_OF_TEST_HPP_
#define TAKT_CONTAINERS_MODEL_BOUND_OF_TEST_HPP_

#include <cstdlib>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "takt/containers/configuration/configuration_file_test.hpp"
#include "takt/containers/configuration/system_reader.hpp"
#include "takt/containers/container.hpp"
#include "takt/containers/model/system_model.hpp"

namespace takt::test {

/// The model of a file and its bounds.
struct Analyzed {
  SystemModel model;
  ModelBounds bounds;

  const SystemModel::Chain& chain() const { return model.chains.at(0); }
  const ModelBounds::Chain& bound() const { return bounds.chains.at(0); }
  Verdict verdict() const { return takt::verdict(chain(), bound()); }
  /// Of the first chain; nullptr: it does not assume it.
  const Assumption* assumption(std::string_view id) const {
    for (const Assumption& each : chain().assumptions) {
      if (each.id == id) return &each;
    }
    return nullptr;
  }
  /// Empty: it does not assume it.
  std::string text_of(std::string_view id) const {
    const Assumption* const found = assumption(id);
    return found != nullptr ? found->text : std::string();
  }
  /// The ids of what keeps the first chain from being guaranteed.
  std::vector<std::string> missing() const {
    std::vector<std::string> result;
    for (const Assumption* each : takt::missing(chain(), bound())) result.push_back(each->id);
    return result;
  }
};

/// On a machine of its own, with nobody else.
inline MachineFacts quiet(bool is_virtual) {
  MachineFacts facts = facts_of_kernel();
  facts.is_virtual = is_virtual;
  facts.fair_server = Nanoseconds::zero();
  return facts;
}
inline const MachineFacts kQuiet = quiet(/*is_virtual=*/false);

/// tools/check/ignored.py asks whether a test sees that the model passes over a key: "a topic:
/// lifespan".
inline bool is_ignored(std::string_view map, std::string_view key) {
  static const char* const chosen = std::getenv("TAKT_IGNORED");
  return chosen != nullptr && chosen == fmt::format("{}: {}", map, key);
}

/// The same of what a run has measured: "a measured callback: dropped".
template <class T>
void forget_if_ignored(const char* of, const char* fact, T& value) {
  if (is_ignored(of, fact)) value = T{};
}
inline MeasuredModel without_ignored(MeasuredModel model) {
  constexpr const char* kModel = "a measured model";
  forget_if_ignored(kModel, "duration", model.duration);
  forget_if_ignored(kModel, "path", model.path);
  forget_if_ignored(kModel, "margin", model.margin);
  forget_if_ignored(kModel, "dispatch", model.dispatch_overhead);
  forget_if_ignored(kModel, "wake", model.wake_overhead);
  forget_if_ignored(kModel, "lost_executions", model.lost_executions);
  forget_if_ignored(kModel, "active_nodes", model.active_nodes);
  forget_if_ignored(kModel, "callbacks", model.callbacks);
  forget_if_ignored(kModel, "chains", model.chains);
  forget_if_ignored(kModel, "differs", model.differs);
  for (MeasuredCallback& callback : model.callbacks) {
    constexpr const char* kCallback = "a measured callback";
    if (is_ignored(kCallback, "name")) callback.name = "/nobody/t";
    forget_if_ignored(kCallback, "executions", callback.executions);
    forget_if_ignored(kCallback, "longest_execution", callback.longest_execution);
    if (is_ignored(kCallback, "least_execution")) callback.least_execution = Nanoseconds::max();
    forget_if_ignored(kCallback, "longest_wait", callback.longest_wait);
    forget_if_ignored(kCallback, "least_distances", callback.least_distances);
    forget_if_ignored(kCallback, "period", callback.period);
    forget_if_ignored(kCallback, "jitter", callback.jitter);
    forget_if_ignored(kCallback, "dropped", callback.dropped);
    forget_if_ignored(kCallback, "uncaused", callback.uncaused);
    forget_if_ignored(kCallback, "uncaused_distances", callback.uncaused_distances);
    forget_if_ignored(kCallback, "causes", callback.causes);
  }
  for (MeasuredChain& chain : model.chains) {
    forget_if_ignored("a measured chain", "name", chain.name);
    forget_if_ignored("a measured chain", "longest", chain.longest);
    forget_if_ignored("a measured chain", "instances", chain.instances);
  }
  return model;
}

inline Analyzed analyzed(const std::string& text, const MeasuredModel* given = nullptr,
                         bool accepts_all = false, const MachineFacts& machine = kQuiet) {
  const MeasuredModel known = given != nullptr ? without_ignored(*given) : MeasuredModel{};
  const MeasuredModel* const measured = given != nullptr ? &known : nullptr;
  const ConfigurationFile file("system.yaml", text);
  ignored_key = is_ignored;
  SystemDescription description = file.read();
  ignored_key = nullptr;
  if (accepts_all) {
    for (const AssumptionKind& kind : assumption_kinds()) {
      description.accepted.try_emplace(std::string(kind.id), "a test");
    }
  }
  std::vector<std::unique_ptr<Container>> containers;
  std::vector<ModelledProcess> processes;
  std::vector<std::shared_ptr<Node>> nodes;
  for (SystemDescription process : split(description, Composition::file)) {
    process.dds.reset();  // nothing runs
    process.watches_bounds = false;
    containers.push_back(std::make_unique<Container>(process));
    processes.push_back(containers.back()->modelled());
    for (const ModelledProcess::Member& member : processes.back().nodes) {
      nodes.push_back(member.node);
    }
  }
  std::vector<std::string> errors;
  const auto chains = containers.size() == 1 ? containers[0]->plan().chains
                                             : find_chains(description, nodes, errors);
  SystemModel model = make_system_model(description, chains, processes, measured, machine);
  ModelBounds bounds = analyze(model);
  return {std::move(model), std::move(bounds)};
}

inline ModelBounds::Chain bound_of(const std::string& text,
                                   const MeasuredModel* measured = nullptr) {
  return analyzed(text, measured).bound();
}

/// If somebody has accepted all that nobody checks.
inline Verdict verdict_of(const std::string& text, const MeasuredModel* measured = nullptr) {
  return analyzed(text, measured, /*accepts_all=*/true).verdict();
}

/// A timer of one process sends to a subscription of another one. `top`: more keys of the file.
inline std::string two_processes(const std::string& top, int period_us = 20'000) {
  return top + fmt::format(R"(
threads:
  a: {{policy: SCHED_FIFO, priority: 60, affinity: [0]}}
  b: {{policy: SCHED_FIFO, priority: 60, affinity: [1]}}
machine: {{cpus: [0, 1]}}
executors: {{a: {{type: events, threads: [a]}}, b: {{type: events, threads: [b]}}}}
containers:
  - {{name: p1, components: [{{component: takt::Workload, name: x, executor: a, parameters: {{publishers: {{topic: [x], period_us: [{}], work_us: [100]}}}}}}]}}
  - {{name: p2, components: [{{component: takt::Workload, name: y, executor: b, parameters: {{subscriptions: {{topic: [x], work_us: [100]}}}}}}]}}
chains: [{{name: c, deadline: 150ms, path: [x/x_timer, y/x]}}]
)",
                           period_us);
}

}  // namespace takt::test

#endif  // TAKT_CONTAINERS_MODEL_BOUND_OF_TEST_HPP_
