// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/generic_publisher.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "takt/base/error.hpp"

namespace takt {

GenericPublisher::GenericPublisher(Endpoint endpoint, Clock& clock,
                                   const std::shared_ptr<Participant>& participant)
    : writer_(std::move(endpoint), clock),
      remote_(participant != nullptr
                  ? participant->create_writer(writer_.endpoint(), writer_.events())
                  : nullptr) {
}

void GenericPublisher::publish(std::span<const std::byte> message) {
  if (message.size() < kCdrHeader.size() ||
      !std::equal(kCdrHeader.begin(), kCdrHeader.begin() + 2, message.begin())) {
    throw Error(
        fmt::format("'{}' is to send {} bytes that are not a message", topic(), message.size()),
        "give little-endian CDR with its four bytes of header");
  }
  const TimePoint published = writer_.stamp();
  if (remote_ != nullptr) remote_->write(&message, {});
  auto block = std::make_unique<ReceivedBlock>();
  block->from_heap = true;
  block->hold_bytes(message);
  writer_.write(*block.release(), published);
}

}  // namespace takt
