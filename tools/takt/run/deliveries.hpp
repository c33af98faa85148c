// What was sent between the processes of a run, and whether it has arrived.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_DELIVERIES_HPP_
#define TAKT_TOOLS_TAKT_DELIVERIES_HPP_

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "run/children.hpp"

namespace takt::tools {

/// How many others each end has, by process and in the order of its endpoints.
std::vector<json> count_matches(const std::vector<json>& processes);

/// How many messages were sent to each reader from other processes, in the same order.
std::vector<std::vector<std::uint64_t>> count_sent(const std::vector<json>& processes);

/// The ends of each topic: process and number.
using Ends = std::map<std::string, std::set<std::pair<std::size_t, std::uint64_t>>>;
Ends ends_of(const std::vector<json>& processes);

/// Of which topics all who have sent can still be asked, and all who read were there: those that
/// have the same ends as in the beginning, while no process has died.
class Countable {
 public:
  Countable(const Children& children, Ends beginning)
      : children_(children), beginning_(std::move(beginning)) {}
  bool operator()(const Ends& now, const std::string& topic) const {
    const auto then = beginning_.find(topic);
    return children_.are_complete() && then != beginning_.end() && then->second == now.at(topic);
  }

 private:
  const Children& children_;
  const Ends beginning_;
};

/// Nothing is pending anywhere and, where that can be counted, every message that was sent has
/// arrived. More have where a process outside the run sends too, as `takt component` does.
bool all_is_served(const std::vector<json>& processes, const Countable& is_countable);

/// What a process could not know: how much was sent to it by others.
template <class IsCountable>
void complete(json& callbacks, const json& endpoints, const std::vector<std::uint64_t>& sent,
              IsCountable&& is_countable) {
  std::vector<bool> used(endpoints.size(), false);
  for (json& callback : callbacks) {
    if (callback.at("kind") != "subscription") continue;
    for (std::size_t i = 0; i < endpoints.size(); ++i) {
      if (used[i] || endpoints[i].at("is_writer") ||
          endpoints[i].at("topic") != callback.at("topic")) {
        continue;
      }
      used[i] = true;
      if (!is_countable(endpoints[i].at("topic"))) break;
      const auto number = [&](const char* key) { return callback.at(key).get<std::uint64_t>(); };
      const std::uint64_t expected = number("expected") - number("from_outside") + sent[i];
      const std::uint64_t served = number("received") + number("dropped");
      callback["expected"] = expected;
      callback["lost"] = expected > served ? expected - served : 0;
      break;
    }
  }
}

bool uses_shared_memory(const std::vector<json>& processes);

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_DELIVERIES_HPP_
