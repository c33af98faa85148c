// The assumptions of a model, and what it refuses to assume.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <chrono>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "takt/containers/model/model_builder.hpp"

namespace takt {

// Callbacks that the model has seen and the file's components have not made: they may be made while
// it runs, and nobody knows when they become ready.
void ModelBuilder::add_unknown_callbacks() {
  if (measured_ == nullptr) return;
  for (const MeasuredCallback& seen : measured_->callbacks) {
    if (seen.executions == 0) continue;
    bool has_node = false, is_known = false;
    std::set<std::size_t> executors;
    for (std::size_t i = 0; i < callbacks_.size(); ++i) {
      const analysis::Callback& callback = model_.system.callbacks[i];
      is_known = is_known || callback.name == seen.name;
      if (!seen.name.starts_with(callbacks_[i]->node->fully_qualified_name() + "/")) continue;
      has_node = true;
      executors.insert(callback.executor);
    }
    if (is_known) continue;
    if (!has_node) {
      throw Error(fmt::format("the model has a callback '{}', which ran {} times, and '{}' has no "
                              "node of that name",
                              seen.name, seen.executions, description_.file),
                  "give the model of this system", measured_->path);
    }
    for (const std::size_t executor : executors) {
      model_.system.executors[executor].unknown = fmt::format(
          "'{}' ran {} times in the model, and its node has not made it when it was "
          "constructed: nothing is known of how often it runs",
          seen.name, seen.executions);
    }
  }
}

void ModelBuilder::add_assumptions() {
  auto& list = model_.assumptions;
  add_assumptions_of_machine();
  list.push_back(
      "nothing but callbacks sends, unless the model has seen it; and callbacks do not wait for "
      "each other by locks of theirs");
  if (joins_dds()) {
    list.push_back(
        "nobody outside of the file publishes on a topic, or calls a service, on which somebody "
        "inside does");
  }
  add_assumptions_of_model();
  add_what_nobody_says();
  list.insert(list.end(), granted_.begin(), granted_.end());
  add_what_was_not_seen();
}

void ModelBuilder::add_assumptions_of_machine() {
  auto& list = model_.assumptions;
  const std::string on = fmt::format("CPU {}", fmt::join(cpus(), ", "));
  list.push_back(
      description_.machine.is_exclusive
          ? "promised: nothing else runs on " + on
          : fmt::format("no real-time thread outside of the file runs on {}; Takt's own threads "
                        "(DDS, log, container) need no time of those that run callbacks",
                        on));
  const analysis::Overheads& overheads = model_.system.overheads;
  const MachineDescription& machine = description_.machine;
  std::vector<const char*> free;
  const auto add_overhead = [&](analysis::Time time, Nanoseconds stated, const char* what) {
    if (time == 0) free.push_back(what);
    if (time == stated.count()) return;
    list.push_back(fmt::format("{} takes {:.1f} µs at most, as the model estimates", what,
                               static_cast<double>(time) / 1e3));
  };
  add_overhead(overheads.dispatch, machine.dispatch, "an executor's way to its next callback");
  add_overhead(overheads.wake, machine.wake, "waking a thread");
  add_overhead(overheads.context_switch, machine.change, "a change from thread to thread");
  if (!free.empty()) {
    list.push_back(
        fmt::format("these take no time, as nobody has stated (`machine: overheads`) or measured "
                    "it: {}",
                    fmt::join(free, ", ")));
  }
  const auto& executors = model_.system.executors;
  const auto has_rights = [](const analysis::Executor& executor) {
    return executor.is_realtime || executor.reservation;
  };
  if (description_.realtime == Realtime::prefer &&
      std::any_of(executors.begin(), executors.end(), has_rights)) {
    list.push_back(
        "Linux gives all threads their policies and priorities: `realtime: prefer` goes on without "
        "(`takt doctor` says whether it may have them, `realtime: require` makes sure)");
  }
  if (!description_.machine.rt_runtime && model_.system.for_realtime) {
    list.push_back(fmt::format(
        "Linux grants {:g} ms of each second to the real-time threads of a CPU, as on this machine",
        static_cast<double>(model_.system.for_realtime->budget) / 1e6));
  }
}

void ModelBuilder::add_assumptions_of_model() {
  const auto exists = [&](Provenance provenance) {
    return std::any_of(model_.callbacks.begin(), model_.callbacks.end(),
                       [&](const auto& callback) { return callback.execution == provenance; });
  };
  if (exists(Provenance::measured)) {
    model_.assumptions.push_back(
        fmt::format("no execution is longer than the longest that was measured, and {:g} %; none "
                    "waits longer or sends more messages, and no arrivals are closer than those "
                    "that were measured",
                    100 * measured_->margin));
  }
  if (measured_ != nullptr && measured_->lost_executions != 0) {
    model_.assumptions.push_back(
        fmt::format("the {} executions that the trace of the model has lost were as the others",
                    measured_->lost_executions));
  }
  if (exists(Provenance::promised)) {
    model_.assumptions.push_back(
        "no execution is longer than its `budget`: overruns are counted, not prevented");
  }
}

// Of each callback by name: what neither the file, a run nor its component tells.
void ModelBuilder::add_what_nobody_says() {
  std::vector<std::string> waits, executions, messages, answers;
  for (std::size_t i = 0; i < callbacks_.size(); ++i) {
    const Provenance execution = model_.callbacks[i].execution;
    if (!may_run_[i] || execution == Provenance::unknown || said_by_component(i)) continue;
    const MeasuredCallback* const seen = measured(i);
    const bool has_run = seen != nullptr && seen->executions != 0;
    const std::string name = "'" + model_.system.callbacks[i].name + "'";
    const bool is_service = callbacks_[i]->entity->kind() == EntityKind::service;
    if (!callbacks_[i]->described.waits && !(has_run && seen->longest_wait)) waits.push_back(name);
    if (has_run) continue;
    if (execution == Provenance::declared) executions.push_back(name);
    if (!model_.system.callbacks[i].outputs.empty())
      (is_service ? answers : messages).push_back(name);
  }
  const auto add = [&](const char* what, const std::vector<std::string>& names, const char* why) {
    if (names.empty()) return;
    model_.assumptions.push_back(fmt::format("{} {} {}", what, fmt::join(names, ", "), why));
  };
  add("no execution of", executions, "is longer than declared: no run has measured it");
  add("no execution of", waits,
      "waits for a lock, a device, a reply or the like: nobody has declared (`waits`) or measured "
      "how long");
  add("no execution of", messages,
      "sends more than one message to each topic and service: no run has shown it");
  add("each execution of", answers, "answers its request: no run has shown it");
}

void ModelBuilder::add_what_was_not_seen() {
  if (not_seen_.empty()) return;
  const std::string length =
      measured_->duration == Nanoseconds::zero()
          ? "the measured run, of unknown length,"
          : fmt::format("the measured run of {:.3g} s",
                        std::chrono::duration<double>(measured_->duration).count());
  for (const std::string& what : not_seen_) {
    model_.assumptions.push_back(
        fmt::format("it never happens that {}: {} has not shown it", what, length));
  }
}

}  // namespace takt
