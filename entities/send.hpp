// How a message leaves its publisher.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_SEND_HPP_
#define TAKT_ENTITIES_SEND_HPP_

#include "takt/base/visibility.hpp"
#include "takt/transport/dds/participant.hpp"
#include "takt/transport/intra_process.hpp"

namespace TAKT_PUBLIC takt {

/// When a message was published: read before anything is done with it, or {}.
struct PublishTime {
  TimePoint near{};
  WallTime far{};
};

/// Sends a message with what a publisher has: near first, then far. Takes the caller's hold of it
/// over. `remote` may be nullptr.
inline void send(IntraProcessWriter& writer, RemoteWriter* remote, MessageBlock& message,
                 const PublishTime& published) noexcept {
  if (remote == nullptr) return writer.write(message, published.near);
  writer.write(message, published.near, 1);
  remote->write(message.payload(), published.far);
  message.release();
}
/// The same, for a caller with a lock, which `released` outlives.
inline void send(IntraProcessWriter& writer, RemoteWriter* remote, MessageBlock& message,
                 const PublishTime& published, ReleasedMessages& released) noexcept {
  if (remote == nullptr) return writer.write(message, published.near, 0, released);
  writer.write(message, published.near, 1, released);
  remote->write(message.payload(), published.far);
  released.release(message);
}

}  // namespace takt

#endif  // TAKT_ENTITIES_SEND_HPP_
