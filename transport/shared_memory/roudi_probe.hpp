// Checks in bounded time whether RouDi answers.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_SHARED_MEMORY_ROUDI_PROBE_HPP_
#define TAKT_TRANSPORT_SHARED_MEMORY_ROUDI_PROBE_HPP_

#include <cstdint>

namespace takt {

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

#endif  // TAKT_TRANSPORT_SHARED_MEMORY_ROUDI_PROBE_HPP_
