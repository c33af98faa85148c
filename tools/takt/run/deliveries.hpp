// Computes from the reports of the processes (see child.cpp) how many messages were sent between
// them, and whether they have arrived.
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

#include "run/process_state.hpp"

namespace takt::tools {

/// The number of matching endpoints in other processes, by process and endpoint.
std::vector<std::vector<std::uint64_t>> count_matches(const std::vector<ProcessState>& processes);

/// The number of messages sent to each reader from other processes, in the same order.
std::vector<std::vector<std::uint64_t>> count_sent(const std::vector<ProcessState>& processes);

/// The endpoints of each topic: process and index.
using Ends = std::map<std::string, std::set<std::pair<std::size_t, std::uint64_t>>>;
Ends ends_of(const std::vector<ProcessState>& processes);

/// Topics for which sent and received messages can be compared: every writer can still be queried,
/// and every reader existed from the start. These have the same endpoints as at the start, if no
/// process has died.
class Countable {
 public:
  /// `are_complete`: whether no process has died.
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

/// Whether no callback is pending and all counted messages have arrived. More messages than were
/// sent also count as arrived: a process outside the run may publish, for example `takt component`.
bool all_is_served(const std::vector<ProcessState>& processes, const Countable& is_countable);

/// Adds the number of messages sent by other processes to the callbacks of a process, which cannot
/// know it. `ends`: the endpoints of all processes.
void complete_callbacks(std::vector<rt::Run::Callback>& callbacks,
                        const std::vector<ProcessState::Endpoint>& endpoints,
                        const std::vector<std::uint64_t>& sent, const Ends& ends,
                        const Countable& is_countable);

bool uses_shared_memory(const std::vector<ProcessState>& processes);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_DELIVERIES_HPP_
