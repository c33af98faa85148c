// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/planning/plan.hpp"

#include <algorithm>
#include <functional>
#include <iterator>
#include <limits>
#include <optional>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace takt {
namespace {

/// More chains would make a plan that is too long to read.
// Limit: chains that `chains: auto` finds. At it: the file is refused. Seen: the error.
constexpr std::size_t kMostChains = 100;
constexpr int kHighestPriority = 80;

/// Links each callback to the subscriptions of the topics that it publishes.
class SystemGraph {
 public:
  explicit SystemGraph(const std::vector<std::shared_ptr<Node>>& nodes) {
    for (const auto& node : nodes) {
      for (const auto& entity : node->entities()) {
        callbacks_.push_back({node, entity->name()});
        kinds_.push_back(entity->kind());
        topics_.push_back(entity->topic());
      }
    }
    links_.resize(callbacks_.size());
    for (std::size_t from = 0; from < callbacks_.size(); ++from) {
      for (std::size_t to = 0; to < callbacks_.size(); ++to) {
        if (kinds_[to] == EntityKind::subscription &&
            callbacks_[from].first->publishes(callbacks_[from].second, topics_[to])) {
          links_[from].push_back(to);
        }
      }
    }
  }

  /// The paths from one callback to another, without cycles; at most two, as a second one is an
  /// error.
  std::vector<std::vector<Chain::Step>> paths(const Chain::Step& from,
                                              const Chain::Step& to) const {
    std::vector<std::vector<Chain::Step>> result;
    const std::size_t end = index(to);
    walk({index(from)}, [&](const std::vector<std::size_t>& path, bool) {
      if (path.back() != end) return result.size() < 2;
      if (path.size() > 1) result.push_back(steps(path));
      return false;
    });
    return result;
  }

  /// All paths from timers to callbacks without successors; at most kMostChains + 1.
  std::vector<std::vector<Chain::Step>> all_paths() const {
    std::vector<std::vector<Chain::Step>> result;
    for (std::size_t i = 0; i < callbacks_.size(); ++i) {
      if (kinds_[i] != EntityKind::timer) continue;
      walk({i}, [&](const std::vector<std::size_t>& path, bool is_end) {
        if (is_end && path.size() > 1) result.push_back(steps(path));
        return result.size() <= kMostChains;
      });
    }
    return result;
  }

  /// For each callback, its own period, or else the shortest one of the callbacks whose messages
  /// reach it; 0: not known. `own`: the callbacks' own periods, or 0.
  std::vector<Nanoseconds> fastest(const std::vector<Nanoseconds>& own) const {
    std::vector<std::size_t> roots;
    for (std::size_t i = 0; i < own.size(); ++i)
      if (own[i] != Nanoseconds::zero()) roots.push_back(i);
    std::stable_sort(roots.begin(), roots.end(),
                     [&](std::size_t a, std::size_t b) { return own[a] < own[b]; });
    std::vector<Nanoseconds> result = own;
    for (const std::size_t root : roots) {
      std::vector<std::size_t> open{root};
      while (!open.empty()) {
        const std::size_t from = open.back();
        open.pop_back();
        for (const std::size_t to : links_[from]) {
          if (result[to] != Nanoseconds::zero()) continue;  // a faster root's, or its own
          result[to] = own[root];
          open.push_back(to);
        }
      }
    }
    return result;
  }

 private:
  std::size_t index(const Chain::Step& step) const {
    return static_cast<std::size_t>(std::find(callbacks_.begin(), callbacks_.end(), step) -
                                    callbacks_.begin());
  }
  std::vector<Chain::Step> steps(const std::vector<std::size_t>& path) const {
    std::vector<Chain::Step> result;
    for (const std::size_t i : path) result.push_back(callbacks_[i]);
    return result;
  }
  /// Searches depth-first: calls goes_on(path, whether the path ends here) for the path and for its
  /// continuations. A path for which it returns false is not continued.
  template <class GoesOn>
  void walk(std::vector<std::size_t> path, GoesOn&& goes_on) const {
    std::vector<std::size_t> next;
    for (const std::size_t to : links_[path.back()]) {
      if (std::find(path.begin(), path.end(), to) == path.end()) next.push_back(to);
    }
    if (!goes_on(path, next.empty())) return;
    for (const std::size_t to : next) {
      path.push_back(to);
      walk(path, goes_on);
      path.pop_back();
    }
  }

  std::vector<Chain::Step> callbacks_;
  std::vector<EntityKind> kinds_;
  std::vector<std::string> topics_;
  std::vector<std::vector<std::size_t>> links_;
};

/// Completes the steps between the named ones. Throws Error if there is more than one path.
std::vector<Chain::Step> filled(const std::vector<Chain::Step>& named, const SystemGraph& graph) {
  std::vector<Chain::Step> path{named.front()};
  for (std::size_t i = 1; i < named.size(); ++i) {
    const auto topic = named[i].first->find_entity(named[i].second)->topic();
    if (!topic.empty() && path.back().first->publishes(path.back().second, topic)) {
      path.push_back(named[i]);
      continue;
    }
    const auto paths = graph.paths(path.back(), named[i]);
    if (paths.empty()) {
      throw Error(
          fmt::format("no messages go from {} to {}", to_string(path.back()), to_string(named[i])),
          "name callbacks that follow each other, or correct the topics; requests to services and "
          "their answers are no steps of a chain");
    }
    if (paths.size() > 1) {
      const auto text = [](const std::vector<Chain::Step>& candidate) {
        std::vector<std::string> names;
        for (const Chain::Step& step : candidate) names.push_back(to_string(step));
        return fmt::format("{}", fmt::join(names, " → "));
      };
      throw Error(
          fmt::format("there are several paths from {} to {}: {}, and {}", to_string(path.back()),
                      to_string(named[i]), text(paths[0]), text(paths[1])),
          "name a callback between them");
    }
    path.insert(path.end(), paths.front().begin() + 1, paths.front().end());
  }
  return path;
}

Nanoseconds period_of(const std::vector<Chain::Step>& path) {
  return path.front().first->find_entity(path.front().second)->period();
}

std::vector<PlannedChain> found_chains(const SystemDescription& description,
                                       const SystemGraph& graph, std::vector<std::string>& errors) {
  auto paths = graph.all_paths();
  if (paths.size() > kMostChains) {
    errors.push_back(
        fmt::format("{}: there are more than {} paths from a timer to a last callback; name the "
                    "chains that matter",
                    description.chains_where, kMostChains));
    return {};
  }
  std::stable_sort(paths.begin(), paths.end(),
                   [](const auto& a, const auto& b) { return period_of(a) < period_of(b); });
  std::vector<PlannedChain> chains;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    chains.push_back(
        {{.name = fmt::format("chain_{}", i + 1), .priority = static_cast<int>(paths.size() - i)},
         std::move(paths[i])});
  }
  return chains;
}

void set_rate_monotonic(std::vector<Plan::Callback>& callbacks,
                        const std::vector<std::shared_ptr<Node>>& nodes) {
  std::vector<Nanoseconds> own;
  for (const Plan::Callback& callback : callbacks) {
    const CallbackParameters parameters = callback.node->callback_parameters(*callback.entity);
    own.push_back(parameters.period.value_or(callback.entity->period()));
  }
  const std::vector<Nanoseconds> periods = SystemGraph(nodes).fastest(own);
  std::set<Nanoseconds, std::greater<>> known(periods.begin(), periods.end());
  known.erase(Nanoseconds::zero());
  for (std::size_t i = 0; i < callbacks.size(); ++i) {
    callbacks[i].period = periods[i];
    const auto rank = known.find(periods[i]);
    callbacks[i].priority =
        rank == known.end() ? 0 : static_cast<int>(std::distance(known.begin(), rank)) + 1;
  }
}

Plan::Executor executor_of(const picas::Assignment::Executor& assigned, const std::string& name) {
  return {name,
          {.name = name,
           .policy = ThreadPolicy::fifo,
           .priority = assigned.thread_priority,
           .affinity = {assigned.cpu}},
          assigned.utilisation};
}

}  // namespace

std::string to_string(const Chain::Step& step) {
  const auto& [node, callback] = step;
  return node->fully_qualified_name() + (callback.starts_with('/') ? "" : "/") + callback;
}

std::vector<PlannedChain> find_chains(const SystemDescription& description,
                                      const std::vector<std::shared_ptr<Node>>& nodes,
                                      std::vector<std::string>& errors) {
  if (!description.finds_chains && description.chains.empty()) return {};
  const SystemGraph graph(nodes);
  if (description.finds_chains) return found_chains(description, graph, errors);
  std::vector<PlannedChain> chains;
  for (const ChainDescription& described : description.chains) {
    // Splits a chain into the pieces that lie in this process.
    std::vector<std::vector<Chain::Step>> pieces;
    bool follows = false;
    for (const auto& step : described.path) {  // clang 14 captures no structured bindings
      const auto node = std::find_if(nodes.begin(), nodes.end(), [&](const auto& candidate) {
        return candidate->fully_qualified_name() == step.first;
      });
      if (node != nodes.end()) {
        if (!follows) pieces.emplace_back();
        pieces.back().emplace_back(*node, step.second);
      }
      follows = node != nodes.end();
    }
    for (auto& piece : pieces) {
      ChainOptions options = described.options;
      if (piece.size() != described.path.size()) options.deadline = Nanoseconds::zero();
      try {
        for (auto& [node, callback] : piece) callback = node->find_entity(callback)->name();
        chains.push_back({options, filled(piece, graph)});
      } catch (const Error& error) {
        errors.push_back(
            fmt::format("{}: chain '{}': {}", described.where, options.name, error.what()));
      }
    }
  }
  return chains;
}

Plan make_plan(std::vector<PlannedChain> chains, const std::vector<std::shared_ptr<Node>>& nodes,
               const std::vector<const CallbackGroup*>& placed, const std::vector<int>& cpus,
               PriorityMethod method) {
  Plan plan;
  std::vector<picas::Callback> callbacks;
  std::vector<const CallbackGroup*> units;
  for (const auto& node : nodes) {
    for (const auto& entity : node->entities()) {
      const CallbackGroup* group = entity->group().get();
      const auto unit = std::find(units.begin(), units.end(), group);
      const bool is_placed = std::find(placed.begin(), placed.end(), group) != placed.end();
      callbacks.push_back({static_cast<std::size_t>(unit - units.begin()), 0, is_placed});
      if (unit == units.end()) units.push_back(group);
      plan.callbacks.push_back({node, entity, entity->period(), 0, {}, {}});
    }
  }
  std::vector<picas::Chain> paths;
  for (const PlannedChain& chain : chains) {
    picas::Chain& path = paths.emplace_back(picas::Chain{chain.options.priority, {}});
    for (const auto& [node, name] : chain.path) {
      const auto callback =
          std::find_if(plan.callbacks.begin(), plan.callbacks.end(),
                       [&, of = node, called = name](const auto& candidate) {
                         return candidate.node == of && candidate.entity->name() == called;
                       });
      path.callbacks.push_back(static_cast<std::size_t>(callback - plan.callbacks.begin()));
      if (callback->period == Nanoseconds::zero()) callback->period = period_of(chain.path);
    }
  }
  for (std::size_t i = 0; i < callbacks.size(); ++i) {
    Plan::Callback& callback = plan.callbacks[i];
    const CallbackParameters parameters = callback.node->callback_parameters(*callback.entity);
    callback.period = parameters.period.value_or(callback.period);
    if (parameters.budget && callback.period != Nanoseconds::zero()) {
      callbacks[i].utilisation = static_cast<double>(parameters.budget->count()) /
                                 static_cast<double>(callback.period.count());
    }
  }
  const picas::Assignment assigned = picas::assign(callbacks, paths, cpus, kHighestPriority);
  for (const auto& executor : assigned.executors) {
    plan.executors.push_back(executor_of(executor, chains[executor.chain].options.name));
  }
  for (std::size_t i = 0; i < callbacks.size(); ++i) {
    Plan::Callback& callback = plan.callbacks[i];
    callback.priority = assigned.callback_priority[i];
    if (assigned.chain_of_callback[i] != picas::kNone) {
      callback.chain = chains[assigned.chain_of_callback[i]].options.name;
    }
    const std::size_t executor = assigned.executor_of_unit[callbacks[i].unit];
    if (executor != picas::kNone) callback.executor = plan.executors[executor].name;
  }
  if (method == PriorityMethod::rate_monotonic) set_rate_monotonic(plan.callbacks, nodes);
  plan.chains = std::move(chains);
  return plan;
}

}  // namespace takt
