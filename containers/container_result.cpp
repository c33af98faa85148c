// Collects the measurements of a run.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <string>

#include <fmt/format.h>

#include "takt/containers/container_parts.hpp"
#include "takt/containers/diagnostics.hpp"
#include "takt/containers/modes.hpp"
#include "takt/containers/process_usage.hpp"
#include "takt/containers/watching/bound_watch.hpp"
#include "takt/transport/local_topics.hpp"

namespace takt {
namespace {

// Adds (or subtracts) the kernel's counters of a thread. False: it has ended.
bool read_counters(int tid, ThreadStatistics& thread, int sign) {
  const auto usage = thread_usage(tid);
  if (!usage) return false;
  thread.cpu_time += sign * usage->cpu_time;
  thread.counters.voluntary_switches +=
      static_cast<std::uint64_t>(sign) * usage->voluntary_switches;
  return true;
}

}  // namespace

// The measured time is from release to hold, for the process and for each of its threads: an
// executor spins before and after, and a share of a longer time is another one.
void Container::begin_counting() {
  released_ = overrides_.clock->now();
  if (overrides_.execution_model != nullptr) return;
  std::error_code ended;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task", ended)) {
    const int tid = std::atoi(task.path().filename().c_str());
    read_counters(tid, counted_[tid], -1);
  }
  cpu_time_ = process_cpu_time();
}

void Container::end_counting() {
  held_ = overrides_.clock->now();
  if (overrides_.execution_model != nullptr) return;
  cpu_time_ = process_cpu_time() - cpu_time_;
  for (auto task = counted_.begin(); task != counted_.end();) {
    task = read_counters(task->first, task->second, 1) ? std::next(task) : counted_.erase(task);
  }
  pss_kb_ = proportional_set_size_kb();
  for (ThreadStatistics& thread : dds_threads_) {
    thread.in_force = thread_state(thread.in_force.tid);  // by now Cyclone has named it
  }
}

void Container::set_counted(ThreadStatistics& thread) const {
  const auto counted = counted_.find(thread.in_force.tid);
  if (counted == counted_.end()) return;
  thread.cpu_time = counted->second.cpu_time;
  thread.wall_time = held_ - released_;
  thread.spin_time = std::min(thread.spin_time, thread.cpu_time);
  thread.counters.voluntary_switches = counted->second.counters.voluntary_switches;
}

std::vector<EndpointState> Container::endpoints() const {
  if (participant_ == nullptr) return {};
  std::vector<EndpointState> endpoints = participant_->endpoints();
  std::erase_if(endpoints, [](const EndpointState& endpoint) {  // the container's own
    return endpoint.is_writer &&
           (endpoint.topic == "/rosout" || endpoint.topic == "/parameter_events" ||
            endpoint.topic == kDiagnosticsTopic);
  });
  return endpoints;
}

// Of its bounds, of what its publishers lend, and by Cyclone.
void Container::add_what_was_watched(ProcessResult& result) const {
  for (const RefusedLoans& refused : refused_loans()) {
    const auto loaded = shared_.lock()->find(refused.node);
    if (loaded == nullptr) continue;
    result.notes.push_back(fmt::format(
        "a publisher of '{}' on '{}' had no message to lend {} times: give it more `loans`",
        refused.node, refused.topic, refused.count));
  }
  if (const auto watch = bound_watch_.lock(); *watch != nullptr) {
    for (const ProcessResult::Thread& thread : result.threads) {
      const ThreadState& state = thread.statistics.in_force;
      if (!state.refused.empty()) (*watch)->refused(state.name, state.refused);
    }
    result.deviations = (*watch)->found();
    if (const std::string& how = (*watch)->note(); !how.empty()) result.notes.push_back(how);
  }
  if (participant_ != nullptr && dds_warnings() != 0) {
    result.notes.push_back(fmt::format("Cyclone DDS has warned {} times", dds_warnings()));
  }
}

ProcessResult Container::result() const {
  ProcessResult result;
  result.name = description_.name;
  {
    const auto shared = shared_.lock();
    result.notes = shared->notes;
    result.failures = shared->failures;
  }
  result.mode_switches = modes_->switches(released_);
  for (const auto& chain : chains_) {
    result.chains.push_back(
        {chain->options().name, chain->options().deadline, chain->statistics()});
  }
  const Nanoseconds wall = held_ - released_;
  result.duration_s = std::chrono::duration<double>(wall).count();
  result.cpu_percent = 100.0 * static_cast<double>(cpu_time_.count()) /
                       static_cast<double>(std::max<std::int64_t>(wall.count(), 1));
  result.pss_kb = pss_kb_;
  result.allocations_counted = allocations_are_counted();
  for (const auto& running : *executors_) {
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
      set_counted(statistics);
      result.threads.push_back({running->name, std::move(statistics), made.type, scheduler});
    }
  }
  for (ThreadStatistics thread : dds_threads_) {
    set_counted(thread);
    result.threads.push_back({"dds", std::move(thread)});
  }
  add_what_was_watched(result);
  return result;
}

}  // namespace takt
