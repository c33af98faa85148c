// What callbacks do in a simulation: they take their time, and send.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_SIMULATION_SIMULATED_BODIES_HPP_
#define TAKT_CONTAINERS_SIMULATION_SIMULATED_BODIES_HPP_

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "takt/base/manual_clock.hpp"
#include "takt/containers/model/system_model.hpp"
#include "takt/containers/planning/plan.hpp"
#include "takt/containers/result.hpp"
#include "takt/containers/simulation/draws.hpp"
#include "takt/containers/simulation/fault_injection.hpp"
#include "takt/containers/simulation/run_refusal.hpp"
#include "takt/executors/execution_model.hpp"
#include "takt/messages/cdr.hpp"
#include "takt/nodes/chain.hpp"
#include "takt/nodes/chain_join.hpp"
#include "takt/transport/intra_process.hpp"

namespace takt {

/// Sends messages with default fields, for a node whose own code does not run.
/// Thread safety: one thread at a time. Real-time: no.
class StandInPublisher {
 public:
  /// Throws Error if there is no such message.
  StandInPublisher(Endpoint endpoint, Clock& clock);
  /// Publishes in place of a callback, or of a publisher outside.
  void publish();

 private:
  IntraProcessWriter writer_;
  ByteBuffer bytes_;
};

/// Runs the bodies of callbacks of components that state their execution times (takt::Workload),
/// and of programs. Skips all others, and sends messages in their place.
/// Thread safety: as ExecutionModel. Real-time: no.
class SimulatedBodies final : public ExecutionModel {
 public:
  /// `running`: see SimulationOptions.
  SimulatedBodies(ManualClock& clock, bool draws, std::uint64_t seed, FaultInjection& faults,
                  RunRefusal& refusal, std::atomic<const std::string*>* running)
      : clock_(clock),
        draws_(draws),
        running_(running),
        random_(seed),
        faults_(faults),
        refusal_(refusal) {}

  /// `process`: its callbacks, in the order of the model. `chains`: to be measured. `dispatch`: the
  /// measured overhead. Throws Error for a callback that it cannot stand in for.
  void set_up(const ModelledProcess& process, const SystemModel& model,
              const std::vector<PlannedChain>& chains, const MeasuredTimes& dispatch);
  void dispatch() noexcept override;
  void execute(Entity& entity, Slot& slot) override;

  std::uint64_t executions() const noexcept { return executions_; }
  /// For each chain: the times, after the begin, of the release of its longest instance, and of the
  /// begins and ends of its callbacks.
  std::vector<std::vector<Nanoseconds>> longest_instances() const;
  std::vector<ProcessResult::ChainResult> chains() const;
  /// Timers release no more: see Chain::end.
  void end() noexcept { has_ended_ = true; }
  /// Notes on instances that could not be measured.
  std::vector<std::string> notes() const;
  /// A publisher on the topic of the subscription.
  StandInPublisher& publisher_for(const Entity& subscription);

 private:
  struct Join {
    std::vector<bool> has_come;
    std::unique_ptr<ChainJoin> chains;
  };
  struct Sent {
    StandInPublisher* publisher = nullptr;
    std::int64_t messages = 1;
    Join* join = nullptr;  // of which this is an input
    std::size_t input = 0;
  };
  struct Step {
    std::size_t chain;
    std::uint64_t path;  // of the chain's instances at this callback
    bool is_last;
  };
  struct Callback {
    std::string name;
    Nanoseconds least{0}, longest{0};  // without waits
    MeasuredTimes seen;                // drawn instead, if known
    Nanoseconds besides{0};            // the cost of sending
    Nanoseconds waits{0};              // the longest one
    bool is_known = false, runs = false;
    bool is_by_clock = false;  // takes as long on each CPU
    bool joins = false;        // it is an input of a join
    std::vector<Sent> sent;
    std::vector<Step> steps;
  };

  struct Execution {
    std::uint64_t path = 0;
    TimePoint root{}, begin{}, end{};
  };
  struct Instances {
    std::unique_ptr<Chain> chain;
    std::vector<std::uint64_t> paths;  // of its callbacks
    bool joins = false;                // one of them is an input of a join
    Nanoseconds longest{0};
    std::vector<TimePoint> moments;  // of the longest instance
  };

  void run_body(const Callback& callback, Entity& entity, Slot& slot);
  void run_own_code(const Callback& callback, Entity& entity, Slot& slot);
  void note_execution(const Callback& callback, TimePoint begin);
  void add_chain(const PlannedChain& planned);
  Callback described(const ModelledProcess::Callback& callback, const SystemModel& model,
                     std::size_t index) const;
  void add_outputs(const ModelledProcess& process, const SystemModel& model, std::size_t index,
                   Callback& callback);
  Nanoseconds time_of(const Callback& callback);
  Nanoseconds drawn(Nanoseconds least, Nanoseconds longest);

  ManualClock& clock_;
  const bool draws_;
  std::atomic<const std::string*>* const running_;
  Nanoseconds dispatch_{0};
  MeasuredTimes seen_dispatch_;  // drawn instead, if known
  Draws random_;
  FaultInjection& faults_;
  RunRefusal& refusal_;
  std::unordered_map<const Entity*, Callback> callbacks_;
  std::map<std::pair<const Node*, std::string>, std::unique_ptr<StandInPublisher>> publishers_;
  std::map<std::pair<const Node*, std::string>, std::unique_ptr<Join>> joins_;
  std::vector<Instances> chains_;
  // Limit: executions among which a simulation finds the callbacks of a chain's instance. At it:
  // the search knows less of where it may be held up. Seen: nothing.
  static constexpr std::size_t kMostRecent = 1024;
  std::vector<Execution> recent_;  // a ring buffer
  std::uint64_t executions_ = 0, noted_ = 0, forgotten_ = 0;
  bool has_ended_ = false;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_SIMULATION_SIMULATED_BODIES_HPP_
