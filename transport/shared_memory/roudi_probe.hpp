// Whether RouDi answers, found out without waiting for ever.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TRANSPORT_SHARED_MEMORY_ROUDI_PROBE_HPP_
#define TAKT_TRANSPORT_SHARED_MEMORY_ROUDI_PROBE_HPP_

#include <cstdint>

namespace takt {

/// Registers with RouDi as a client does and says goodbye, with sockets that never block. False:
/// RouDi has not answered within 1.5 s, so its clients would wait for ever. Iceoryx's locks are
/// lost with a process that is killed while it holds one, and RouDi waits for them.
///
/// A question that was not answered is not asked again: until its answer comes, the result is false
/// at once. `identity` tells one RouDi from the next.
///
/// Thread safety: from any thread. Real-time: set-up only.
bool roudi_answers(std::uint64_t identity);

}  // namespace takt

#endif  // TAKT_TRANSPORT_SHARED_MEMORY_ROUDI_PROBE_HPP_
