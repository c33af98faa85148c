// SPDX-License-Identifier: Apache-2.0
#include <cstring>
#include <utility>

#include "takt/transport/dds/cyclone_type.hpp"
#include "takt/transport/dds/participant.hpp"

namespace takt {

std::span<const std::byte> ReceivedBlock::encoded() const noexcept {
  return sample_ != nullptr ? static_cast<const Serdata*>(sample_)->bytes()
                            : std::span<const std::byte>(copy_.get(), copied_bytes_);
}

void ReceivedBlock::hold_bytes(std::span<const std::byte> bytes) {
  copy_ = std::make_unique_for_overwrite<std::byte[]>(bytes.size());
  std::memcpy(copy_.get(), bytes.data(), bytes.size());
  copied_bytes_ = bytes.size();
}

void ReceivedBlock::hold_copy(const void* payload, std::size_t size) {
  copy_ = std::make_unique_for_overwrite<std::byte[]>(size);
  std::memcpy(copy_.get(), payload, size);
  payload_ = copy_.get();
}

void ReceivedBlock::recycle() noexcept {
  if (sample_ != nullptr) ddsi_serdata_unref(std::exchange(sample_, nullptr));
  std::atomic<std::size_t>* held = std::exchange(held_, nullptr);
  payload_ = nullptr;
  copy_.reset();
  if (from_heap) {
    delete this;
  } else {
    Pool<ReceivedBlock>::recycle(*this);
  }
  if (held != nullptr) held->fetch_sub(1);  // after the last one, the reader may be freed
}

}  // namespace takt
