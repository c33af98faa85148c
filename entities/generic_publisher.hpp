// Publishes encoded messages of a type that is given by its name.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_ENTITIES_GENERIC_PUBLISHER_HPP_
#define TAKT_ENTITIES_GENERIC_PUBLISHER_HPP_

#include <memory>
#include <span>
#include <string>

#include "takt/base/visibility.hpp"
#include "takt/transport/dds/participant.hpp"
#include "takt/transport/intra_process.hpp"

namespace TAKT_PUBLIC takt {

/// Publishes bytes as they are on the wire: CDR with its header. Readers in this process decode
/// them, on their threads. Bytes that are not a message of the type are dropped there, and counted.
/// Thread safety: publish from any thread.
/// Real-time: no; each message is copied to the heap. A logical execution time does not hold it
/// back.
class GenericPublisher {
 public:
  GenericPublisher(Endpoint endpoint, Clock& clock,
                   const std::shared_ptr<Participant>& participant = nullptr);

  const std::string& topic() const noexcept { return writer_.endpoint().topic; }
  const std::string& type_name() const noexcept { return writer_.endpoint().type->name; }
  std::size_t subscription_count() const noexcept {
    return writer_.reader_count() + (remote_ != nullptr ? remote_->reader_count() : 0);
  }
  /// Throws Error when the bytes have no header of little-endian CDR.
  void publish(std::span<const std::byte> message);

 private:
  IntraProcessWriter writer_;
  const std::unique_ptr<RemoteWriter> remote_;
};

}  // namespace takt

#endif  // TAKT_ENTITIES_GENERIC_PUBLISHER_HPP_
