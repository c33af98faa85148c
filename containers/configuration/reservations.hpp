// Whether Linux would grant the SCHED_DEADLINE threads of a whole system.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_CONTAINERS_CONFIGURATION_RESERVATIONS_HPP_
#define TAKT_CONTAINERS_CONFIGURATION_RESERVATIONS_HPP_

#include <span>
#include <string_view>
#include <vector>

#include "takt/base/visibility.hpp"
#include "takt/containers/configuration/system_description.hpp"

namespace TAKT_INTERNAL takt {

/// Whether the name is that of a thread of Takt's: "main", "signals" and so on.
bool is_reserved_name(std::string_view thread) noexcept;

/// Takt's own threads that the file describes, as often as so many processes make them.
/// Thread safety: a pure function. Real-time: no.
std::vector<ThreadAttributes> reserved_threads(const SystemDescription& system,
                                               std::size_t processes);

/// All threads that the file describes, as often as its processes make them: Takt's own, and for
/// each mention in an executor one in each process that uses it, and of an executor that isolates
/// nodes one for each node. How many groups get a thread of their own, only their nodes know.
/// Thread safety: a pure function. Real-time: no.
std::vector<ThreadAttributes> described_threads(const SystemDescription& system);

/// Throws Error if those of SCHED_DEADLINE reserve more than the machine has for them: Linux admits
/// them all together, whatever their process.
/// Thread safety: from any thread. Real-time: no.
void check_reservations(std::span<const ThreadAttributes> threads,
                        const MachineDescription& machine, const SourceLine& where = {});

}  // namespace takt

#endif  // TAKT_CONTAINERS_CONFIGURATION_RESERVATIONS_HPP_
