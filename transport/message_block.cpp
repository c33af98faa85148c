// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/message_block.hpp"

#include <cstring>

#include "takt/messages/cdr.hpp"

namespace takt {

std::optional<std::uint64_t> MessageBlock::address() const noexcept {
  std::uint64_t address = 0;
  if (payload_ != nullptr) {
    std::memcpy(&address, payload_, sizeof address);
  } else {  // not decoded yet
    const auto bytes = encoded();
    if (bytes.size() < kCdrHeader.size() + sizeof address) return std::nullopt;
    std::memcpy(&address, bytes.data() + kCdrHeader.size(), sizeof address);
  }
  return address;
}

void OwnedBlock::recycle() noexcept {
  unique_.reset();
  shared_.reset();
  if (from_heap) {
    delete this;
  } else {
    Pool<OwnedBlock>::recycle(*this);
  }
}

}  // namespace takt
