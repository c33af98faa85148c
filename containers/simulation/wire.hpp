// Messages between processes in a simulation.
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

/// Delays messages between processes by the `delay` of their topic. Messages of one process arrive
/// at a subscription in sending order. As with DDS, they carry their sending time, but not the
/// begin of a chain. All other messages pass.
/// Thread safety: one thread at a time, as a manual clock has it. Real-time: no.
class Wire final : public DeliveryFilter {
 public:
  /// Delivers messages to `next`. `draws`: draws delays between the least and the longest; else it
  /// takes the longest.
  Wire(ManualClock& clock, DeliveryFilter& next, bool draws, std::uint64_t seed)
      : clock_(clock), next_(next), draws_(draws), random_(seed) {}

  /// For several processes, which this object must outlive. Throws Error for services between
  /// processes, which it cannot simulate.
  void set_up(const SystemDescription& system, std::span<const ModelledProcess> processes,
              const SystemModel& model);
  /// Assigns the threads that have joined the clock since the last call to this process.
  void add_threads(std::size_t process);
  std::size_t process_of(const CpuModel::Thread* thread) const { return threads_.at(thread); }
  /// Notes on topics without a `delay`, whose messages take no time.
  const std::vector<std::string>& notes() const noexcept { return notes_; }

  void deliver(IntraProcessReader& reader, MessageBlock& message, const Arrival& arrival,
               ReleasedMessages& released) noexcept override;
  /// When the next message arrives; kNever: none is in transit.
  TimePoint next() const noexcept;
  /// Delivers the messages that are due.
  void arrive();
  /// Drops messages in transit; later ones take no time.
  void end();

 private:
  struct End {  // a subscription in a process
    std::size_t process = 0;
    DelayDescription delay;
    std::map<std::size_t, TimePoint> last;  // by sending process: when its last message arrives
  };
  struct Message {
    IntraProcessReader* reader;
    MessageBlock* block;
    Arrival arrival;
    std::optional<ChainJoin> instances;  // of chains that the message belongs to
  };

  void arrive(Message& message, ReleasedMessages& released);

  ManualClock& clock_;
  DeliveryFilter& next_;
  const bool draws_;
  Draws random_;
  bool has_ended_ = false;
  std::unordered_map<const IntraProcessReader*, End> ends_;
  std::unordered_map<const CpuModel::Thread*, std::size_t> threads_;
  std::multimap<TimePoint, Message> under_way_;
  std::vector<std::string> notes_;
};

}  // namespace takt

#endif  // TAKT_CONTAINERS_SIMULATION_WIRE_HPP_
