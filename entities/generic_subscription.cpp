// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/generic_subscription.hpp"

namespace takt {

// The message is not decoded.
bool GenericSubscription::take(Slot& slot) noexcept {
  slot.message = IntraProcessReader::take(slot.more);
  if (slot.message == nullptr) return false;
  static_cast<Envelope&>(slot) = slot.message->envelope;
  return true;
}

void GenericSubscription::execute(Slot& slot) {
  const HeldMessage held(slot.message);
  const MessageInfo info(slot);
  if (slot.message->payload() == nullptr) {
    return callback_(slot.message->encoded(), info);
  }
  // The callback takes the buffer: it may spin an executor that runs another generic subscription.
  static thread_local ByteBuffer spare;
  struct Taken {
    ByteBuffer bytes = std::exchange(spare, {});
    ~Taken() { spare = std::exchange(bytes, {}); }
  } taken;
  taken.bytes.clear();
  payload_type()->encode(slot.message->payload(), taken.bytes);
  callback_(taken.bytes.bytes(), info);
}

}  // namespace takt
