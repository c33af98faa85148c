// Lets the faults of a scenario happen.
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

/// Which callbacks of a process may have a fault, by kind; by name, as the model has them.
/// Thread safety: one thread. Real-time: no.
class FaultyCallbacks {
 public:
  FaultyCallbacks(const ModelledProcess& process, const SystemModel& model);

  /// One to three of these kinds, at any time of the run; none if nothing can have them.
  std::vector<Fault> drawn(const FaultKinds& kinds, std::uint64_t seed, Nanoseconds duration) const;
  /// Throws Error if something cannot have one of them.
  void check(const std::vector<Fault>& faults) const;
  /// For people: of which kinds nothing can have one.
  std::vector<std::string> notes(const FaultKinds& kinds) const;

 private:
  std::map<Fault::Kind, std::vector<std::string>> names_;
};

/// Stands between topics and subscriptions, and is asked before each execution.
/// Thread safety: one thread at a time, as a manual clock has it. Real-time: no.
class FaultInjection final : public DeliveryFilter {
 public:
  explicit FaultInjection(const ManualClock& clock) : clock_(clock) {}

  /// What FaultyCallbacks has checked. `begin`: of the run. It outlives the process.
  void set_up(const std::vector<Fault>& faults, TimePoint begin, const ModelledProcess& process,
              const SystemModel& model);
  void deliver(IntraProcessReader& reader, MessageBlock& message, const Arrival& arrival,
               ReleasedMessages& released) noexcept override;
  /// Whether the execution that begins has a fault of this kind.
  bool strikes(const Entity& entity, Fault::Kind kind) noexcept;

  /// When messages that are late come, and let those come.
  std::vector<TimePoint> late_times() const;
  void deliver_late();
  /// The end: what is still under way comes, and nothing goes wrong any more.
  void end();

 private:
  struct Pending {
    Fault::Kind kind{};
    TimePoint from{}, until{};  // until: of late ones
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
