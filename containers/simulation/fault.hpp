// Faults in a run of a simulation.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_SIMULATION_FAULT_HPP_
#define TAKT_CONTAINERS_SIMULATION_FAULT_HPP_

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "takt/base/time.hpp"
#include "takt/base/visibility.hpp"

namespace TAKT_INTERNAL takt {

/// A fault that happens once to one callback.
struct Fault {
  enum class Kind {
    lost,       // a message does not come
    late,       // messages that are sent during `span` come at its end
    doubled,    // a message comes twice
    reordered,  // a message comes after the one that is sent next
    full,       // a message comes as often as the queue has places
    slow,       // an execution takes kSlowdown times as long
    throws,     // an execution ends with an exception, and sends nothing
  };
  static constexpr int kSlowdown = 10;

  Kind kind = Kind::lost;
  std::string callback;
  Nanoseconds time{0};  // after the begin of the run: the next message or execution has it
  Nanoseconds span{0};  // for `late`
};

using FaultKinds = std::set<Fault::Kind>;

/// The fault as a part of a scenario's word: "late=/planner/imu@3s+20ms".
/// Thread safety: any thread. Real-time: no.
std::string to_string(const Fault& fault);
std::string_view to_string(Fault::Kind kind) noexcept;

/// Whether the word is the name of a kind.
bool is_fault_kind(std::string_view word) noexcept;
/// `what`: the text after "late=". Throws Error if it is no fault.
Fault parse_fault(std::string_view kind, std::string_view what);
/// "lost,late", or "all". Throws Error, which lists the kinds.
FaultKinds parse_fault_kinds(std::string_view list);

}  // namespace takt

#endif  // TAKT_CONTAINERS_SIMULATION_FAULT_HPP_
