// SPDX-License-Identifier: Apache-2.0
#include "takt/sched/picas.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace takt::picas {

Assignment assign(const std::vector<Callback>& callbacks, const std::vector<Chain>& chains,
                  const std::vector<int>& cpus, int highest) {
  std::size_t units = 0;
  for (const Callback& callback : callbacks) units = std::max(units, callback.unit + 1);
  Assignment result{std::vector<std::size_t>(callbacks.size(), kNone),
                    std::vector<int>(callbacks.size(), 0),
                    std::vector<std::size_t>(units, kNone),
                    {}};
  std::vector<std::size_t> by_criticality(chains.size());
  std::iota(by_criticality.begin(), by_criticality.end(), 0);
  std::stable_sort(by_criticality.begin(), by_criticality.end(), [&](std::size_t a, std::size_t b) {
    return chains[a].priority > chains[b].priority;
  });

  // Rules I and II: count down, the last callback of the most critical chain first.
  int priority = static_cast<int>(callbacks.size());
  for (const std::size_t chain : by_criticality) {
    const auto& path = chains[chain].callbacks;
    for (auto callback = path.rbegin(); callback != path.rend(); ++callback) {
      if (result.chain_of_callback[*callback] != kNone) continue;
      result.chain_of_callback[*callback] = chain;
      result.callback_priority[*callback] = priority--;
    }
  }

  // Rules III and IV.
  for (const std::size_t chain : by_criticality) {
    bool has_executor = false;
    for (const std::size_t callback : chains[chain].callbacks) {
      std::size_t& executor = result.executor_of_unit[callbacks[callback].unit];
      if (executor != kNone || callbacks[callback].is_placed) continue;
      if (!std::exchange(has_executor, true)) {
        const int rank = static_cast<int>(result.executors.size());
        result.executors.push_back({chain, std::max(highest - rank, 1), 0, 0});
      }
      executor = result.executors.size() - 1;
    }
  }
  for (const Callback& callback : callbacks) {
    const std::size_t executor = result.executor_of_unit[callback.unit];
    if (executor != kNone) result.executors[executor].utilisation += callback.utilisation;
  }

  // Rule V. If utilisations are not known, the number of executors decides.
  std::vector<std::pair<double, std::size_t>> used(cpus.size());
  for (Assignment::Executor& executor : result.executors) {
    const auto least = std::min_element(used.begin(), used.end());
    executor.cpu = cpus[static_cast<std::size_t>(least - used.begin())];
    least->first += executor.utilisation;
    ++least->second;
  }
  return result;
}

}  // namespace takt::picas
