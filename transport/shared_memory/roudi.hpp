// What the files of this folder know of RouDi.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_SHARED_MEMORY_ROUDI_HPP_
#define TAKT_TRANSPORT_SHARED_MEMORY_ROUDI_HPP_

#include <cstddef>
#include <cstdint>

#include <sys/types.h>

#include "takt/transport/shared_memory/iceoryx.hpp"

namespace takt {

// iceoryx's own names.
inline constexpr const char* kRoudiSocket = "/tmp/roudi";
inline constexpr const char* kRoudiLock = "/tmp/iox-unique-roudi.lock";
inline constexpr const char* kRoudiManagement = "/dev/shm/iceoryx_mgmt";

/// Beside a message, its chunk holds our header, Cyclone's (56 bytes), and padding to align them.
inline constexpr std::size_t kChunkOverhead = sizeof(ChunkHeader) + 128;

/// The process that holds RouDi's lock: RouDi, while it lives. 0: none.
pid_t holder_of_roudi_lock();

/// Registers with RouDi as a client does, and unregisters, with sockets that never block. Returns
/// false if RouDi has not answered within 1.5 s: its clients would wait for ever. If a process is
/// killed while it holds one of iceoryx's locks, the lock is never released, and RouDi waits for
/// it.
///
/// A request that was not answered is not repeated: until its answer comes, the result is false at
/// once. `identity` distinguishes one RouDi from the next.
///
/// Thread safety: from any thread. Real-time: set-up only.
bool roudi_answers(std::uint64_t identity);

}  // namespace takt

#endif  // TAKT_TRANSPORT_SHARED_MEMORY_ROUDI_HPP_
