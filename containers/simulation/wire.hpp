// What goes from one process to another in a simulation.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_SIMULATION_WIRE_HPP_
#define TAKT_CONTAINERS_SIMULATION_WIRE_HPP_

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "takt/base/manual_clock.hpp"
#include "takt/containers/model/system_model.hpp"
#include "takt/containers/simulation/draws.hpp"
#include "takt/nodes/chain_join.hpp"
#include "takt/transport/intra_process.hpp"

namespace takt {

/// Holds messages between processes for the `delay` of their topic. Those of one process come to a
/// subscription in the order in which they were sent. With them comes what DDS brings: when they
/// were sent, and not when a chain began. All other messages pass.
/// Thread safety: one thread at a time, as a manual clock has it. Real-time: no.
class Wire final : public DeliveryFilter {
 public:
  /// What arrives goes on to `next`. `draws`: delays between the least and the longest, else that.
  Wire(ManualClock& clock, DeliveryFilter& next, bool draws, std::uint64_t seed)
      : clock_(clock), next_(next), draws_(draws), random_(seed) {}

  /// Of several processes. Throws Error for what does not go between them here. It outlives them.
  void set_up(const SystemDescription& system, std::span<const ModelledProcess> processes,
              const SystemModel& model, bool do_find_each_other);
  /// The threads that the clock has since the last call are of this process.
  void add_threads(std::size_t process);
  std::size_t process_of(const CpuModel::Thread* thread) const { return threads_.at(thread); }
  /// Which messages take no time, as nothing says how long.
  const std::vector<std::string>& notes() const noexcept { return notes_; }

  void deliver(IntraProcessReader& reader, MessageBlock& message, const Arrival& arrival,
               ReleasedMessages& released) noexcept override;
  /// When the next one comes; kNever: none is under way.
  TimePoint next() const noexcept;
  /// Lets those come that are due.
  void arrive();
  /// From here on nothing takes time.
  void end();

 private:
  struct End {  // of a topic, in a process
    std::size_t process = 0;
    DelayDescription delay;
    std::map<std::size_t, TimePoint> last;  // by process: when the last one from there comes
  };
  struct Message {
    IntraProcessReader* reader;
    MessageBlock* block;
    Arrival arrival;
    std::optional<ChainJoin> instances;  // of chains, that it belongs to
  };

  void arrive(Message& message, ReleasedMessages& released);

  ManualClock& clock_;
  DeliveryFilter& next_;
  const bool draws_;
  Draws random_;
  bool do_find_each_other_ = true, has_ended_ = false;
  std::unordered_map<const IntraProcessReader*, End> ends_;
  std::unordered_map<const CpuModel::Thread*, std::size_t> threads_;
  std::multimap<TimePoint, Message> under_way_;
  std::vector<std::string> notes_;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_SIMULATION_WIRE_HPP_
