// What Takt makes of the chains of a process: which callbacks they are, and what follows for
// priorities, executors and CPUs.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_PLANNING_PLAN_HPP_
#define TAKT_CONTAINERS_PLANNING_PLAN_HPP_

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "takt/containers/configuration/system_description.hpp"
#include "takt/nodes/chain.hpp"
#include "takt/nodes/node.hpp"
#include "takt/sched/picas.hpp"

namespace takt {

/// "/node/callback".
std::string to_string(const Chain::Step& step);

/// One chain, as far as it lies in this process.
struct PlannedChain {
  ChainOptions options;
  std::vector<Chain::Step> path;
};

/// All callbacks of a process, and what Takt assigns to them. What the file gives is not changed.
struct Plan {
  struct Callback {
    std::shared_ptr<Node> node;
    std::shared_ptr<Entity> entity;
    Nanoseconds period{0};  // its own, or that of the timer which its chain begins with; 0: unknown
    int priority = 0;       // assigned
    std::string chain;      // the most critical one; empty: none
    std::string executor;   // assigned; empty: none, or the file's
  };
  struct Executor {
    std::string name;  // that of its chain, for the thread too
    ThreadAttributes thread;
    double utilisation = 0;
  };
  std::vector<PlannedChain> chains;
  std::vector<Callback> callbacks;
  std::vector<Executor> executors;  // the most critical first
};

/// Finds the chains of the description among the nodes of this process: steps that the file leaves
/// out, and all chains where it says `auto`. Errors, with their lines, go to `errors`.
/// Thread safety: none. Real-time: no.
std::vector<PlannedChain> find_chains(const SystemDescription& description,
                                      const std::vector<std::shared_ptr<Node>>& nodes,
                                      std::vector<std::string>& errors);

/// A chain, and how long an instance of it may take.
struct ChainBound {
  std::string chain;
  Nanoseconds bound, deadline;
};
/// Where a callback runs.
struct Placement {
  std::string executor;
  bool is_by_priority = false;  // the executor looks at priorities; else at nothing
};
/// A bound for each chain with a deadline, from budgets and periods; callbacks that have none count
/// for nothing. On each executor of the chain, as if it had one thread that nobody preempts: the
/// chain's own budgets; the longest less urgent callback, once for each of its steps; and the
/// others as often as they can be released meanwhile (the busy-period argument of fixed priorities,
/// see Casini et al., ECRTS 2019, for executors). More than ten deadlines are Nanoseconds::max().
std::vector<ChainBound> chain_bounds(
    const Plan& plan, const std::function<Placement(const Plan::Callback&)>& placement);

/// Assigns as picas::assign does. Thread priorities count down from 80.
Plan make_plan(std::vector<PlannedChain> chains, const std::vector<std::shared_ptr<Node>>& nodes);

}  // namespace takt

#endif  // TAKT_CONTAINERS_PLANNING_PLAN_HPP_
