// What a model takes for granted, and what it refuses to.
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
  std::vector<std::string> names;
  for (const int cpu : cpus()) names.push_back(std::to_string(cpu));
  list.push_back(
      description_.machine.is_exclusive
          ? fmt::format("promised: nothing else runs on CPU {}", fmt::join(names, ", "))
          : fmt::format(
                "no real-time thread outside of the file runs on CPU {}; Takt's own threads "
                "(DDS, log, container) need no time of those that run callbacks",
                fmt::join(names, ", ")));
  list.push_back(
      "a callback sends one message to each of its topics in an execution, unless the "
      "model has seen more; nothing but callbacks sends, unless the model has seen it; and "
      "callbacks do not wait for each other by locks of theirs");
  if (joins_dds()) {
    list.push_back("nobody outside of the file publishes on a topic on which somebody inside does");
  }
  const analysis::Overheads& overheads = model_.system.overheads;
  if (overheads.dispatch == 0 && overheads.wake == 0 && overheads.context_switch == 0) {
    list.push_back("Linux and the executors need no time (`machine: overheads` says otherwise)");
  } else if (has_measured_overheads()) {
    const auto us = [](analysis::Time time) { return static_cast<double>(time) / 1e3; };
    list.push_back(
        fmt::format("as the model estimates, the executors need {:.1f} µs between two callbacks, "
                    "and Linux {:.1f} µs to wake a thread",
                    us(overheads.dispatch), us(overheads.wake)));
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
  const auto exists = [&](Provenance provenance) {
    return std::any_of(model_.callbacks.begin(), model_.callbacks.end(),
                       [&](const auto& callback) { return callback.execution == provenance; });
  };
  if (exists(Provenance::measured)) {
    list.push_back(
        fmt::format("no execution is longer than the longest that was measured, and {:g} "
                    "%; no arrivals are closer than those that were measured",
                    100 * measured_->margin));
  }
  list.insert(list.end(), contradictions_.begin(), contradictions_.end());
  add_what_was_not_seen();
  if (exists(Provenance::promised)) {
    list.push_back("no execution is longer than its `budget`: overruns are counted, not prevented");
  }
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
