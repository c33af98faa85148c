// Injects the faults of a scenario.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_SIMULATION_FAULT_INJECTION_HPP_
#define TAKT_CONTAINERS_SIMULATION_FAULT_INJECTION_HPP_

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "takt/base/manual_clock.hpp"
#include "takt/containers/model/system_model.hpp"
#include "takt/containers/simulation/fault.hpp"
#include "takt/transport/intra_process.hpp"

namespace takt {

/// The callbacks of a process that may have a fault, by kind. Names are those of the model.
/// Thread safety: one thread. Real-time: no.
class FaultyCallbacks {
 public:
  FaultyCallbacks(const ModelledProcess& process, const SystemModel& model);

  /// Draws one to three faults of these kinds, at any time of the run; none if no callback can have
  /// them.
  std::vector<Fault> drawn(const FaultKinds& kinds, std::uint64_t seed, Nanoseconds duration) const;
  /// Throws Error if a callback cannot have its fault.
  void check(const std::vector<Fault>& faults) const;
  /// Notes on kinds that no callback can have.
  std::vector<std::string> notes(const FaultKinds& kinds) const;

 private:
  std::map<Fault::Kind, std::vector<std::string>> names_;
};

/// Stands between topics and subscriptions, and is asked before each execution.
/// Thread safety: one thread at a time, as a manual clock has it. Real-time: no.
class FaultInjection final : public DeliveryFilter {
 public:
  explicit FaultInjection(const ManualClock& clock) : clock_(clock) {}

  /// `faults`: checked by FaultyCallbacks. `begin`: of the run. This object must outlive the
  /// process.
  void set_up(const std::vector<Fault>& faults, TimePoint begin, const ModelledProcess& process,
              const SystemModel& model);
  void deliver(IntraProcessReader& reader, MessageBlock& message, const Arrival& arrival,
               ReleasedMessages& released) noexcept override;
  /// Whether the execution that begins has a fault of this kind.
  bool strikes(const Entity& entity, Fault::Kind kind) noexcept;

  /// The arrival times of late messages; deliver_late() delivers those that are due.
  std::vector<TimePoint> late_times() const;
  void deliver_late();
  /// Ends the run: delivers delayed messages, and injects no further faults.
  void end();

 private:
  struct Pending {
    Fault::Kind kind{};
    TimePoint from{}, until{};  // until: for `late`
    const Entity* entity = nullptr;
    IntraProcessReader* reader = nullptr;
    bool has_struck = false;
    std::vector<std::pair<MessageBlock*, Arrival>> kept = {};
  };

  static void deliver_kept(Pending& fault, ReleasedMessages& released) noexcept;
  static void repeat(IntraProcessReader& reader, MessageBlock& message, Arrival arrival,
                     std::size_t times, ReleasedMessages& released) noexcept;

  const ManualClock& clock_;
  std::vector<Pending> faults_;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_SIMULATION_FAULT_INJECTION_HPP_
