// The CPUs of a simulated machine, as they are specified.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TESTING_ORACLE_MACHINE_HPP_
#define TAKT_TESTING_ORACLE_MACHINE_HPP_

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "takt/analysis/system.hpp"

namespace takt::testing {

struct MachineThread {
  bool is_awake = false, is_throttled = false, is_reserved = false;
  std::uint64_t awake_order = 0;
  const std::vector<int>* cpus = nullptr;  // that it shares; nullptr: none
  analysis::Time order = 0;                // of a reservation its deadline, else -priority
};

inline bool comes_before(const MachineThread& a, const MachineThread& b) {
  const auto key = [](const MachineThread& of) {
    return std::tuple(!of.is_reserved, of.order, of.awake_order);
  };
  return key(a) < key(b);
}

/// The threads that run of those that share CPUs, where each reservation takes another CPU away:
/// in their order, each on the first CPU that is free.
inline std::vector<std::size_t> beside_reservations(const std::vector<MachineThread>& threads) {
  std::set<int> free;
  std::vector<std::size_t> waiting, result;
  std::ptrdiff_t reserved = 0;
  for (std::size_t i = 0; i < threads.size(); ++i) {
    const MachineThread& thread = threads[i];
    if (thread.cpus != nullptr) free.insert(thread.cpus->begin(), thread.cpus->end());
    if (thread.cpus != nullptr && thread.is_awake) waiting.push_back(i);
    if (thread.is_reserved && thread.is_awake && !thread.is_throttled) ++reserved;
  }
  free.erase(free.begin(), std::next(free.begin(), std::min(reserved, std::ssize(free))));
  std::sort(waiting.begin(), waiting.end(),
            [&](std::size_t a, std::size_t b) { return comes_before(threads[a], threads[b]); });
  for (const std::size_t index : waiting) {
    for (const int cpu : *threads[index].cpus) {
      if (free.erase(cpu) == 0) continue;
      result.push_back(index);
      break;
    }
  }
  return result;
}

/// Written from the words in base/cpu_model.hpp, without its code.
class Machine {
 public:
  explicit Machine(std::vector<int> cpus) : cpus_(std::move(cpus)) {}

  /// The threads that run from now on. Always asked with the same threads.
  std::vector<std::size_t> running(const std::vector<MachineThread>& threads) {
    last_.resize(threads.size(), -1);
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < threads.size(); ++i) {
      if (threads[i].is_awake) order.push_back(i);
    }
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return comes_before(threads[a], threads[b]); });
    const std::map<int, std::size_t> before = std::exchange(holders_, {});
    // How good it is: idle, or else held by a thread that is not urgent; its own is the best.
    const auto worth = [&](std::size_t thread, int cpu) -> std::size_t {
      const auto holder = before.find(cpu);
      const bool is_reserved = threads[thread].cpus == nullptr;
      const bool is_own =
          is_reserved ? cpu == last_[thread] : holder != before.end() && holder->second == thread;
      if (is_own) return SIZE_MAX;
      const auto place = holder == before.end()
                             ? order.end()
                             : std::find(order.begin(), order.end(), holder->second);
      return 2 * static_cast<std::size_t>(place - order.begin()) + (cpu == last_[thread] ? 1 : 0);
    };
    std::vector<std::size_t> result;
    for (const std::size_t thread : order) {
      if (threads[thread].is_throttled) continue;
      std::vector<int> free = threads[thread].cpus != nullptr ? *threads[thread].cpus : cpus_;
      std::erase_if(free, [this](int cpu) { return holders_.contains(cpu); });
      const auto best = std::max_element(free.begin(), free.end(), [&](int a, int b) {
        return worth(thread, a) < worth(thread, b);
      });
      if (best == free.end()) continue;
      holders_[*best] = thread;
      last_[thread] = *best;
      result.push_back(thread);
    }
    return result;
  }

 private:
  const std::vector<int> cpus_;
  std::map<int, std::size_t> holders_;
  std::vector<int> last_;  // the CPU that each has had
};

}  // namespace takt::testing

#endif  // TAKT_TESTING_ORACLE_MACHINE_HPP_
