// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/model/join_losses.hpp"

#include <algorithm>
#include <set>
#include <vector>

#include <fmt/format.h>

namespace takt {
namespace {

using analysis::Count;
using analysis::kUnbounded;
using analysis::plus;

/// For each callback, the callbacks that send to it. The graph is acyclic: cycles have been cut.
class Senders {
 public:
  Senders(const SystemModel& model, const analysis::Bounds& bounds)
      : system_(model.system), bounds_(bounds), to_(system_.callbacks.size()) {
    for (std::size_t from = 0; from < system_.callbacks.size(); ++from) {
      for (const analysis::Output& output : system_.callbacks[from].outputs) {
        to_[output.to].push_back({from, &output});
      }
    }
  }

  struct Link {
    std::size_t from;
    const analysis::Output* output;
  };
  const std::vector<Link>& to(std::size_t callback) const { return to_[callback]; }

  /// The callback and its ancestors.
  std::set<std::size_t> before(std::size_t callback) const {
    std::set<std::size_t> found{callback};
    for (std::vector<std::size_t> left{callback}; !left.empty();) {
      const std::size_t next = left.back();
      left.pop_back();
      for (const Link& link : to_[next]) {
        if (found.insert(link.from).second) left.push_back(link.from);
      }
    }
    return found;
  }
  /// The ancestors that get arrivals from outside, or are timers.
  std::set<std::size_t> roots(std::size_t callback) const {
    std::set<std::size_t> found = before(callback);
    std::erase_if(found, [&](std::size_t each) { return !system_.callbacks[each].arrivals; });
    return found;
  }
  /// Whether the callback gets exactly one message for each release or message of a single root.
  bool has_one_way(std::size_t callback) const {
    while (!system_.callbacks[callback].arrivals) {
      if (to_[callback].size() != 1 || to_[callback].front().output->messages != 1) return false;
      callback = to_[callback].front().from;
    }
    return to_[callback].empty();
  }
  /// The longest time from the release of a root to the end of the callback.
  analysis::Time reach(std::size_t callback) const {
    const std::size_t executor = system_.callbacks[callback].executor;
    if (system_.executors[executor].let_period != 0) return kUnbounded;
    analysis::Time begins = 0;  // when messages enter its executor, from where its bound counts
    std::set<std::size_t> seen{callback};
    for (std::vector<std::size_t> left{callback}; !left.empty();) {
      const std::size_t next = left.back();
      left.pop_back();
      for (const Link& link : to_[next]) {
        if (link.output->waits) return kUnbounded;
        if (system_.callbacks[link.from].executor != executor) {
          begins = std::max(begins, plus(reach(link.from), link.output->delay));
        } else if (seen.insert(link.from).second) {
          left.push_back(link.from);
        }
      }
    }
    return plus(begins, bounds_.callbacks[callback].bound);
  }
  /// The longest time from any instant to the next end of an execution of the callback.
  analysis::Time next_end(std::size_t callback) const {
    analysis::Time longest = 0;
    for (const std::size_t root : roots(callback)) {
      longest = std::max(longest, system_.callbacks[root].longest_gap);
    }
    return plus(longest, reach(callback));
  }

 private:
  const analysis::System& system_;
  const analysis::Bounds& bounds_;
  std::vector<std::vector<Link>> to_;
};

}  // namespace

Loss loss_of_join(const SystemModel& model, const analysis::Bounds& bounds, std::size_t from,
                  std::size_t to, const std::function<std::string(std::size_t)>& why_lost_at) {
  const auto& callbacks = model.system.callbacks;
  const Senders senders(model, bounds);
  const auto& inputs = senders.to(to);
  if (std::none_of(inputs.begin(), inputs.end(), [&](const Senders::Link& link) {
        return link.from == from && link.output->waits;
      })) {
    return {};
  }
  const std::set<std::size_t> own_roots = senders.roots(from);
  const bool has_one_way = senders.has_one_way(from);
  analysis::Time others = 0;
  for (const Senders::Link& link : inputs) {
    if (!link.output->waits || link.from == from) continue;
    for (const std::size_t before : senders.before(link.from)) {
      const std::string why = why_lost_at(before);
      if (why.empty()) continue;
      return {fmt::format("a join before '{}' waits for '{}': {}", callbacks[to].name,
                          callbacks[link.from].name, why),
              0};
    }
    // From the same release, both messages arrive before the next release of the timer.
    if (has_one_way && senders.roots(link.from) == own_roots &&
        callbacks[*own_roots.begin()].is_timer &&
        std::max(senders.reach(from), senders.reach(link.from)) <=
            model.callbacks[*own_roots.begin()].period.count()) {
      continue;
    }
    others = std::max(others, senders.next_end(link.from));
  }
  if (others == 0) return {};
  const analysis::Time while_waiting = plus(others, senders.reach(from));
  const Count most = while_waiting >= kUnbounded || !has_one_way
                         ? 0
                         : callbacks[*own_roots.begin()].arrivals->most(plus(while_waiting, 1));
  if (most == 1) return {};
  if (most == 0) {
    return {fmt::format("it is not known how many messages of '{}' a join before '{}' replaces by "
                        "later ones, until its other inputs have come",
                        callbacks[from].name, callbacks[to].name),
            0};
  }
  return {fmt::format("of {} messages of '{}', a join before '{}' may send only the last one, when "
                      "its other inputs have come",
                      most, callbacks[from].name, callbacks[to].name),
          most};
}

}  // namespace takt
