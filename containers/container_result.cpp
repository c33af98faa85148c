// Collects the measurements of a run.
// SPDX-License-Identifier: Apache-2.0
#include <string>

#include <fmt/format.h>

#include "takt/containers/component_list.hpp"
#include "takt/containers/container_watching.hpp"
#include "takt/containers/diagnostics.hpp"
#include "takt/containers/measured_usage.hpp"
#include "takt/transport/local_topics.hpp"

namespace takt {

std::vector<EndpointState> Container::endpoints() const {
  if (setting_->participant == nullptr) return {};
  std::vector<EndpointState> endpoints = setting_->participant->endpoints();
  std::erase_if(endpoints, [](const EndpointState& endpoint) {  // the container's own
    return endpoint.is_writer &&
           (endpoint.topic == "/rosout" || endpoint.topic == "/parameter_events" ||
            endpoint.topic == kDiagnosticsTopic);
  });
  return endpoints;
}

ProcessResult Container::result() const {
  ProcessResult result;
  result.name = setting_->description.name;
  {
    const auto said = setting_->said.lock();
    result.notes = said->notes;
    result.failures = said->failures;
  }
  result.mode_switches = setting_->modes->switches(usage_->begun());
  result.active_nodes = lifecycle_->active();
  for (const auto& chain : chains_) {
    result.chains.push_back(
        {chain->options().name, chain->options().deadline, chain->statistics()});
  }
  result.allocations_counted = allocations_are_counted();
  for (const auto& running : *running_) {
    if (!running->has_begun.load()) continue;
    std::vector<CallbackStatistics> callbacks = running->executor->statistics();
    const ExecutorDescription& made = running->description;
    const std::string scheduler = scheduler_of(made);
    if (running->is_own) {
      callbacks.clear();
    } else {
      result.executors.push_back({running->name, made.type, scheduler, made.threads.size()});
    }
    result.callbacks.reserve(result.callbacks.size() + callbacks.size());
    for (auto& callback : callbacks) {
      result.callbacks.push_back({running->name, std::move(callback)});
    }
    for (auto& statistics : running->executor->thread_statistics()) {
      if (!running->is_own) {
        result.allocations_while_spinning += statistics.counters.allocations;
        result.allocations_in_dds += statistics.counters.foreign_allocations;
      }
      if (statistics.missed_periods + statistics.dropped_outputs != 0) {
        result.notes.push_back(fmt::format(
            "executor '{}' missed {} of its periods, and dropped {} messages that did not fit into "
            "one",
            running->name, statistics.missed_periods, statistics.dropped_outputs));
      }
      const ThreadState& state = statistics.in_force;
      for (const std::string& note : {state.refused, cpus_outside(state)})
        if (!note.empty()) result.notes.push_back(note);
      usage_->complete(statistics);
      result.threads.push_back({running->name, std::move(statistics), made.type, scheduler});
    }
  }
  usage_->add_to(result);
  for (const RefusedLoans& refused : refused_loans()) {
    if (components_->find(refused.node) == nullptr) continue;
    result.notes.push_back(fmt::format(
        "a publisher of '{}' on '{}' had no message to lend {} times: give it more `loans`",
        refused.node, refused.topic, refused.count));
  }
  watch_->add_to(result);
  if (setting_->participant != nullptr && dds_warnings() != 0)
    result.notes.push_back(fmt::format("Cyclone DDS has warned {} times", dds_warnings()));
  return result;
}

}  // namespace takt
