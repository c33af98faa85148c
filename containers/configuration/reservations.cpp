// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/configuration/reservations.hpp"

#include <algorithm>
#include <iterator>
#include <set>
#include <string>

#include "takt/base/available_cpus.hpp"
#include "takt/base/error.hpp"

namespace takt {

namespace {

/// A thread of Takt's that a file may describe by this name.
struct ReservedThread {
  std::string_view name;
  std::size_t in_each_process = 1;
  std::size_t of_the_command = 0;  // that starts several processes
};
constexpr ReservedThread kReservedThreads[] = {
    {"main"},   {"log"},   {"container"},     {"requests", 3}, {"lifecycle"},
    {"loader"}, {"lttng"}, {"signals", 1, 1}, {"watchdog"},
};

std::size_t most_threads(const SystemDescription& system, const ExecutorDescription& executor,
                         std::size_t nodes) {
  const bool isolates =
      executors().traits(executor.type).isolates && executor.per == Isolation::node;
  const std::size_t mentioned = executor.threads.size();
  if (nodes == 0 && !is_of_chain(executor, system.chains)) return 0;
  return isolates && mentioned != 0 ? std::max(mentioned, nodes) : mentioned;
}

}  // namespace

bool is_reserved_name(std::string_view thread) noexcept {
  return std::any_of(std::begin(kReservedThreads), std::end(kReservedThreads),
                     [&](const ReservedThread& reserved) { return reserved.name == thread; });
}

std::vector<ThreadAttributes> reserved_threads(const SystemDescription& system,
                                               std::size_t processes) {
  std::vector<ThreadAttributes> result;
  for (const auto& [name, in_each_process, of_the_command] : kReservedThreads) {
    const ThreadDescription* const thread = find_thread(system, std::string(name));
    if (thread == nullptr) continue;
    result.insert(result.end(), in_each_process * processes + (processes > 1 ? of_the_command : 0),
                  thread->attributes);
  }
  return result;
}

std::vector<ThreadAttributes> described_threads(const SystemDescription& system) {
  std::set<std::string> processes;
  for (const ComponentDescription& component : system.components)
    processes.insert(component.container);
  std::vector<ThreadAttributes> result = reserved_threads(system, processes.size());
  for (const ExecutorDescription& executor : system.executors) {
    for (const std::string& process : processes) {
      const auto nodes = std::count_if(
          system.components.begin(), system.components.end(), [&](const auto& component) {
            return component.container == process && uses(component, executor);
          });
      const std::size_t most = most_threads(system, executor, static_cast<std::size_t>(nodes));
      for (std::size_t i = 0; i < most; ++i) {
        const ThreadDescription* const thread =
            find_thread(system, executor.threads[i % executor.threads.size()]);
        if (thread != nullptr) result.push_back(thread->attributes);
      }
    }
  }
  return result;
}

void check_reservations(std::span<const ThreadAttributes> threads,
                        const MachineDescription& machine, const SourceLine& where) {
  try {
    if (machine.cpus.empty() && !machine.rt_runtime) return check_admission(threads);
    const std::size_t cpus = (machine.cpus.empty() ? available_cpus() : machine.cpus).size();
    const RealtimeGrant granted =
        machine.rt_runtime ? RealtimeGrant{.runtime = *machine.rt_runtime} : realtime_grant();
    check_admission(threads, static_cast<double>(cpus) * std::min(1.0, granted.share()));
  } catch (const Error& error) {
    throw Error(error.what(), {}, where);
  }
}

}  // namespace takt
