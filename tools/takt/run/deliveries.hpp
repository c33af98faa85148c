// What was sent between the processes of a run, and whether it has arrived. All of it is computed
// from what the processes report, see child.cpp.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_DELIVERIES_HPP_
#define TAKT_TOOLS_TAKT_DELIVERIES_HPP_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

namespace takt::tools {

/// How many others each end has, by process and in the order of its endpoints.
std::vector<nlohmann::json> count_matches(const std::vector<nlohmann::json>& processes);

/// How many messages were sent to each reader from other processes, in the same order.
std::vector<std::vector<std::uint64_t>> count_sent(const std::vector<nlohmann::json>& processes);

/// The ends of each topic: process and number.
using Ends = std::map<std::string, std::set<std::pair<std::size_t, std::uint64_t>>>;
Ends ends_of(const std::vector<nlohmann::json>& processes);

/// Of which topics every sender can still be asked, and every reader was there from the beginning:
/// those that have the same ends as in the beginning, while no process has died.
class Countable {
 public:
  /// `are_complete`: no process has died.
  Countable(Ends beginning, std::function<bool()> are_complete)
      : beginning_(std::move(beginning)), are_complete_(std::move(are_complete)) {}
  bool operator()(const Ends& now, const std::string& topic) const {
    const auto then = beginning_.find(topic);
    return are_complete_() && then != beginning_.end() && then->second == now.at(topic);
  }

 private:
  const Ends beginning_;
  const std::function<bool()> are_complete_;
};

/// Nothing is pending anywhere and, where that can be counted, every message that was sent has
/// arrived. More have where a process outside the run sends too, as `takt component` does.
bool all_is_served(const std::vector<nlohmann::json>& processes, const Countable& is_countable);

/// Adds to the callbacks of a process what it could not know: how much was sent to it by others.
/// `ends`: of all processes.
void complete_callbacks(nlohmann::json& callbacks, const nlohmann::json& endpoints,
                        const std::vector<std::uint64_t>& sent, const Ends& ends,
                        const Countable& is_countable);

bool uses_shared_memory(const std::vector<nlohmann::json>& processes);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_DELIVERIES_HPP_
