// What Cyclone DDS needs to join a domain.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_DDS_ROOM_HPP_
#define TAKT_TRANSPORT_DDS_ROOM_HPP_

#include <cstddef>

namespace takt {

/// Takes for a moment what Cyclone will take: it aborts, or fails at a null pointer, where memory,
/// threads or file descriptors end while it joins. Beside its own memory it maps so much of others.
/// Throws an Error that names the limit.
void check_room(std::size_t mapped_bytes = 0);

}  // namespace takt

#endif  // TAKT_TRANSPORT_DDS_ROOM_HPP_
