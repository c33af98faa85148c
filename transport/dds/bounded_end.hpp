// An end that comes although shared memory hangs.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_DDS_BOUNDED_END_HPP_
#define TAKT_TRANSPORT_DDS_BOUNDED_END_HPP_

#include <cstdint>

namespace takt {

/// Deletes an entity of Cyclone DDS of a domain with shared memory. One that is not deleted within
/// 3 s waits for a lock of iceoryx's that a killed process has kept: an error is logged, and it is
/// left as it is. So are those that are to be deleted later, as they may wait for it.
/// Thread safety: from any thread. Real-time: set-up only.
void delete_within_bound(std::int32_t entity);

/// From here on `exit` ends the process within 3 s, with the status that was asked for, though
/// iceoryx still waits for RouDi's answer to its goodbye. Call it when iceoryx has begun.
void bound_exit();

}  // namespace takt

#endif  // TAKT_TRANSPORT_DDS_BOUNDED_END_HPP_
