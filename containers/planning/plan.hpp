// Finds the chains of a process, and assigns priorities, executors and CPUs to them.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_PLANNING_PLAN_HPP_
#define TAKT_CONTAINERS_PLANNING_PLAN_HPP_

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "takt/base/available_cpus.hpp"
#include "takt/base/visibility.hpp"
#include "takt/containers/configuration/system_description.hpp"
#include "takt/nodes/chain.hpp"
#include "takt/nodes/node.hpp"
#include "takt/sched/picas.hpp"

namespace TAKT_PUBLIC takt {

/// "/node/callback".
std::string to_string(const Chain::Step& step);

/// The part of a chain that runs in this process.
struct PlannedChain {
  ChainOptions options;
  std::vector<Chain::Step> path;
};

/// All callbacks of a process, and the priorities and executors that Takt assigns to them. Values
/// given in the file take precedence.
struct Plan {
  struct Callback {
    std::shared_ptr<Node> node;
    std::shared_ptr<Entity> entity;
    Nanoseconds period{0};  // its own, or of a timer whose messages reach it; 0: unknown
    int priority = 0;       // assigned
    std::string chain;      // the most critical one; empty: none
    std::string executor;   // assigned; empty: none, or given in the file
  };
  struct Executor {
    std::string name;  // of the chain; also the thread's name
    ThreadAttributes thread;
    double utilisation = 0;
  };
  std::shared_ptr<const void> look;  // of a container: unload() waits until this is dropped
  std::vector<PlannedChain> chains;
  std::vector<Callback> callbacks;
  std::vector<Executor> executors;  // the most critical first
};

/// Finds the chains of the description among the nodes of this process. It completes omitted steps,
/// and finds all chains for `chains: auto`. Adds errors, with their lines, to `errors`.
/// Thread safety: none. Real-time: no.
std::vector<PlannedChain> find_chains(const SystemDescription& description,
                                      const std::vector<std::shared_ptr<Node>>& nodes,
                                      std::vector<std::string>& errors);

/// Makes the plan with picas::assign. With rate_monotonic, callbacks get priorities by their
/// periods instead: 1 for the longest, and one more for each shorter one; 0: no period is known. A
/// subscription has the period of the fastest timer whose messages reach it in this process. Thread
/// priorities start at 80 and decrease. `placed`: groups that have an executor already; chains get
/// executors only for other groups. `cpus`: for the threads of chains.
Plan make_plan(std::vector<PlannedChain> chains, const std::vector<std::shared_ptr<Node>>& nodes,
               const std::vector<const CallbackGroup*>& placed = {},
               const std::vector<int>& cpus = available_cpus(),
               PriorityMethod method = PriorityMethod::picas);

}  // namespace takt

#endif  // TAKT_CONTAINERS_PLANNING_PLAN_HPP_
