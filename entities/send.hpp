// How a message leaves its publisher.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_SEND_HPP_
#define TAKT_ENTITIES_SEND_HPP_

#include "takt/base/visibility.hpp"
#include "takt/transport/dds/participant.hpp"
#include "takt/transport/intra_process.hpp"

namespace TAKT_PUBLIC takt {

/// Sends a message with what a publisher has: near first, then far. Takes the caller's hold of it
/// over. `remote` may be nullptr.
inline void send(IntraProcessWriter& writer, RemoteWriter* remote, MessageBlock& message) noexcept {
  if (remote == nullptr) return writer.write(message);
  writer.write(message, 1);
  remote->write(message.payload());
  message.release();
}
/// The same, for a caller with a lock, which `released` outlives.
inline void send(IntraProcessWriter& writer, RemoteWriter* remote, MessageBlock& message,
                 ReleasedMessages& released) noexcept {
  if (remote == nullptr) return writer.write(message, 0, released);
  writer.write(message, 1, released);
  remote->write(message.payload());
  released.release(message);
}

}  // namespace takt

#endif  // TAKT_ENTITIES_SEND_HPP_
