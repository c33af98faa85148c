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

void LoanedBlock::recycle() noexcept {
  Pool<LoanedBlock>::recycle(*this);
}

void OwnedBlock::recycle() noexcept {
  free_owned();
  shared_.reset();
  if (from_heap) {
    delete this;
  } else {
    Pool<OwnedBlock>::recycle(*this);
  }
}

PoolPtr<LoanedBlock> make_loans(std::size_t count, const MessageMaker& maker,
                                const void* prototype) {
  return PoolPtr<LoanedBlock>(
      Pool<LoanedBlock>::create(count, [&](std::uint32_t) { return maker.loan(prototype); }));
}

void ReleasedMessages::recycle(MessageBlock* first) noexcept {
  while (first != nullptr) std::exchange(first, first->next_released_)->recycle();
}

}  // namespace takt
