// The configuration of Cyclone for a domain.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_DDS_DOMAIN_CONFIGURATION_HPP_
#define TAKT_TRANSPORT_DDS_DOMAIN_CONFIGURATION_HPP_

#include <cstdint>
#include <optional>
#include <string>

#include "takt/transport/dds/participant.hpp"

namespace takt {

/// An index that no process of the machine uses on the domain; nullopt: there is none. A process
/// has an index on each domain that it joins, and two ports by it. Those up to 32 are left to ROS
/// 2, which starts no process without one, as long as there are others.
std::optional<int> free_participant_index(const DdsOptions& options);

/// Whether a thread of Cyclone's receives nothing but data. It needs no select() before each
/// message, but is woken at its end by a datagram of this process to itself. So it exists only
/// where the loopback interface is Cyclone's first one: over a network that has gone, the end would
/// wait for ever.
bool has_data_thread(const DdsOptions& options);
bool is_loopback_up();

/// As XML. It ends with CYCLONEDDS_URI, which overrules everything but what Takt relies on.
/// `roudi`: the identity of the one in use; 0: no shared memory.
std::string domain_configuration(const DdsOptions& options, int participant_index,
                                 std::uint64_t roudi);

}  // namespace takt

#endif  // TAKT_TRANSPORT_DDS_DOMAIN_CONFIGURATION_HPP_
