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
  const auto make = [&maker, prototype](void* place, std::uint32_t) {
    maker.loan(place, prototype);
  };
  return PoolPtr<LoanedBlock>(Pool<LoanedBlock>::create(count, make, count, maker.layout));
}

// Allocated as by new, so that unique_ptr may delete it.
std::unique_ptr<LoanedBlock> make_loan(const MessageMaker& maker, const void* prototype) {
  const std::align_val_t alignment{maker.layout.alignment};
  void* const place = ::operator new(maker.layout.bytes, alignment);
  try {
    return std::unique_ptr<LoanedBlock>(maker.loan(place, prototype));
  } catch (...) {
    ::operator delete(place, alignment);
    throw;
  }
}

PoolPtr<LoanedBlock> make_loans_by_need(std::size_t count, const MessageMaker& maker) {
  const auto make = [&maker](void* place, std::uint32_t) {
    maker.loan(place, nullptr)->is_filled_anew = true;
  };
  return PoolPtr<LoanedBlock>(Pool<LoanedBlock>::create(count, make, /*at_once=*/0, maker.layout));
}

void ReleasedMessages::recycle(MessageBlock* first) noexcept {
  while (first != nullptr) std::exchange(first, first->next_released_)->recycle();
}

}  // namespace takt
