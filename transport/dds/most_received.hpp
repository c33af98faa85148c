// How much of what came from other processes may wait.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_DDS_MOST_RECEIVED_HPP_
#define TAKT_TRANSPORT_DDS_MOST_RECEIVED_HPP_

#include <cstddef>

namespace takt {

// Limit: bytes of all messages of a topic that came from other processes, in queues and callbacks.
// At it: the newest is dropped, unless it is the only one; a full `depth` drops the oldest. Seen:
// the warning of Cyclone DDS.
inline constexpr std::size_t kMostReceived = std::size_t{1} << 30;

}  // namespace takt

#endif  // TAKT_TRANSPORT_DDS_MOST_RECEIVED_HPP_
