// The measurements of a run.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_RESULT_HPP_
#define TAKT_CONTAINERS_RESULT_HPP_

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/executors/executor.hpp"
#include "takt/nodes/chain.hpp"

namespace TAKT_PUBLIC takt {

/// The measurements of one process: its callbacks and threads, each with its executor.
struct ProcessResult {
  struct Callback {
    std::string executor;
    CallbackStatistics statistics;
    std::string process = {};  // here and below: set where results of several processes are merged
  };
  struct Thread {
    std::string executor;
    ThreadStatistics statistics;
    std::string executor_type = {}, scheduler = {};  // empty: of Cyclone DDS
    std::string process = {};
  };

  /// An executor of components that ran.
  struct UsedExecutor {
    std::string name, type, scheduler;
    std::size_t threads_given = 0;  // by the file; 0: the type decides
    std::string process = {};
  };

  struct ChainResult {
    std::string name;
    Nanoseconds deadline{0};
    ChainStatistics statistics = {};
    std::string process = {};
  };

  /// An assumption of the analysis that did not hold, or a bound that was exceeded: see BoundWatch.
  struct Deviation {
    std::string id;  // of the assumption; "bound": a bound was exceeded
    std::string text;
    std::uint64_t count = 0;
    std::vector<std::string> chains = {};  // whose bounds depend on it
    std::string process = {};
  };

  /// A mode of `modes:` came into force.
  struct ModeSwitch {
    std::string mode, cause;
    Nanoseconds after{0};  // the start of the timers
    /// By the clock of the executors. Callbacks that a thread picks after `end_ns` are served as
    /// the new mode says.
    std::int64_t begin_ns = 0, end_ns = 0;
    std::string process = {};
  };

  std::string name;
  std::vector<Callback> callbacks;
  std::vector<ChainResult> chains;
  std::vector<UsedExecutor> executors;
  std::optional<std::vector<Deviation>> deviations;  // nullopt: nobody watched
  std::vector<ModeSwitch> mode_switches;
  std::vector<std::string> active_nodes;  // the lifecycle nodes that have been active
  std::vector<Thread> threads;
  double duration_s = 0;
  double cpu_percent = 0;  // of one CPU
  std::uint64_t pss_kb = 0;
  std::uint64_t allocations_while_spinning = 0;  // on executor threads
  std::uint64_t allocations_in_dds = 0;          // of those threads, inside Cyclone DDS
  bool allocations_counted = false;
  std::vector<std::string> notes;     // settings that were refused or ignored
  std::vector<std::string> failures;  // why the run failed, though no callback threw
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_RESULT_HPP_
