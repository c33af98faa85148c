// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/configuration/reservations.hpp"

#include <algorithm>
#include <map>
#include <string>

#include "takt/base/available_cpus.hpp"
#include "takt/base/error.hpp"

namespace takt {

std::vector<ThreadAttributes> threads_of_executors(const SystemDescription& system) {
  std::vector<ThreadAttributes> result;
  for (const ExecutorDescription& executor : system.executors) {
    std::map<std::string, std::size_t> nodes;  // by process
    for (const ComponentDescription& component : system.components) {
      if (uses(component, executor)) ++nodes[component.container];
    }
    if (nodes.empty()) nodes[system.name] = 1;
    const bool isolates =
        executors().traits(executor.type).isolates && executor.per == Isolation::node;
    for (const auto& [process, count] : nodes) {
      const std::size_t mentioned = executor.threads.size();
      const std::size_t made = isolates && mentioned != 0 ? std::max(mentioned, count) : mentioned;
      for (std::size_t i = 0; i < made; ++i) {
        const ThreadDescription* const thread =
            find_thread(system, executor.threads[i % mentioned]);
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
