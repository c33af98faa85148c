// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/simulation/simulated_processes.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <utility>

#include "takt/containers/configuration/system_description.hpp"

namespace takt {
namespace {

// In virtual time; as long as a container's own limit for draining.
constexpr auto kUnderWayLimit = std::chrono::seconds(5);

/// Adds the rows of a process to those of others.
template <class Row>
void add_rows(std::vector<Row>& all, std::vector<Row>& more, const std::string& process) {
  for (Row& row : more) {
    row.process = process;
    all.push_back(std::move(row));
  }
}

}  // namespace

SimulatedProcesses::SimulatedProcesses(const SystemDescription& system,
                                       const std::vector<SystemDescription>& processes,
                                       const ContainerOverrides& overrides) {
  std::vector<std::shared_ptr<Node>> nodes;
  for (const SystemDescription& process : processes) {
    containers_.push_back(std::make_unique<Container>(process, overrides));
    modelled_.push_back(containers_.back()->modelled());
    const ModelledProcess& made = modelled_.back();
    all_.callbacks.insert(all_.callbacks.end(), made.callbacks.begin(), made.callbacks.end());
    all_.nodes.insert(all_.nodes.end(), made.nodes.begin(), made.nodes.end());
    for (const ModelledProcess::Member& member : made.nodes) nodes.push_back(member.node);
  }
  if (!are_several()) {
    chains_ = containers_.front()->plan().chains;
    return;
  }
  std::vector<std::string> errors;
  chains_ = find_chains(system, nodes, errors);
  if (!errors.empty()) throw ConfigurationError(errors);
}

void SimulatedProcesses::start(Wire& wire) {
  for (std::size_t i = 0; i < containers_.size(); ++i) {
    containers_[i]->start();
    wire.add_threads(i);
  }
}

void SimulatedProcesses::release() {
  for (const auto& container : containers_) container->release();
}

bool SimulatedProcesses::is_any_pending() const {
  return std::any_of(containers_.begin(), containers_.end(),
                     [](const auto& container) { return container->pending() != 0; });
}

// Drains all processes together: a message to one may cause messages to another.
void SimulatedProcesses::drain(ManualClock& clock, Wire& wire) {
  const TimePoint limit = later(clock.now(), kUnderWayLimit);
  for (clock.settle(); is_any_pending() || wire.next() != kNever; clock.settle()) {
    if (clock.now() > limit) return;
    const TimePoint next = std::min(wire.next(), later(clock.now(), std::chrono::milliseconds(1)));
    clock.advance(std::max(next - clock.now(), Nanoseconds::zero()));
    wire.arrive();
  }
  // Cancel all together: none runs on while another one ends.
  for (const auto& container : containers_) container->cancel();
}

void SimulatedProcesses::end(ManualClock& clock, Wire& wire) {
  for (const auto& container : containers_) container->hold();
  if (are_several()) drain(clock, wire);
  wire.end();
  for (const auto& container : containers_) container->stop();
}

ProcessResult SimulatedProcesses::result() const {
  ProcessResult all = containers_.front()->result();
  if (!are_several()) return all;
  ProcessResult several;
  several.duration_s = all.duration_s;
  for (const auto& container : containers_) {
    ProcessResult one = container == containers_.front() ? std::move(all) : container->result();
    add_rows(several.callbacks, one.callbacks, one.name);
    add_rows(several.executors, one.executors, one.name);
    add_rows(several.threads, one.threads, one.name);
    std::move(one.notes.begin(), one.notes.end(), std::back_inserter(several.notes));
    std::move(one.failures.begin(), one.failures.end(), std::back_inserter(several.failures));
    several.name += (several.name.empty() ? "" : ", ") + one.name;
  }
  return several;
}

std::map<const CpuModel::Thread*, int> set_virtual(ProcessResult& result,
                                                   std::vector<ManualClock::Use> use,
                                                   Nanoseconds duration) {
  std::map<const CpuModel::Thread*, int> numbers;
  int number = 0;
  Nanoseconds all{0};
  bool are_realtime = true;
  for (ProcessResult::Thread& thread : result.threads) {
    ThreadStatistics& statistics = thread.statistics;
    const ThreadAttributes& asked = statistics.asked;
    are_realtime = are_realtime && is_realtime(asked.policy);
    statistics.in_force = {.name = asked.name,
                           .tid = ++number,
                           .policy = asked.policy,
                           .priority = asked.priority,
                           .nice = asked.nice,
                           .affinity = asked.affinity,
                           .runtime = asked.runtime,
                           .deadline = asked.deadline,
                           .period = asked.period,
                           .refused = {}};
    statistics.counters = {};
    statistics.wall_time = duration;
    const auto found =
        std::find_if(use.begin(), use.end(), [&](const auto& of) { return of.name == asked.name; });
    statistics.cpu_time = found != use.end() ? found->time : Nanoseconds::zero();
    if (found != use.end()) {
      numbers[found->thread] = number;
      use.erase(found);
    }
    all += statistics.cpu_time;
    for (NamedTraceEvent& event : statistics.trace) {
      event.cpu_time = {};
      event.has_waited = false;
    }
  }
  result.cpu_percent =
      100.0 * static_cast<double>(all.count()) / static_cast<double>(duration.count());
  result.allocations_counted = false;
  for (auto& callback : result.callbacks) callback.statistics.allocations = std::nullopt;
  if (are_realtime) return numbers;
  result.notes.emplace_back(
      "the order of threads that are not real-time ones is a model: turns of 3 ms");
  return numbers;
}

}  // namespace takt
