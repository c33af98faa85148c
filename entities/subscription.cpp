// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/subscription.hpp"

namespace takt {

void SubscriptionBase::attach(Sink& sink) noexcept {
  set_wants_time(sink.wants_time());
  Entity::attach(sink);
}

void SubscriptionBase::detach() noexcept {
  Entity::detach();
  set_wants_time(false);
}

void SubscriptionBase::retire() noexcept {
  leave();  // first, so that nothing arrives any more
  Entity::retire();
}

bool SubscriptionBase::front(Arrival& arrival) const noexcept {
  std::int64_t time_ns;
  if (!ring().front(arrival.sequence, time_ns)) return false;
  arrival.ready_time = TimePoint(Nanoseconds(time_ns));
  return true;
}

bool SubscriptionBase::take(Slot& slot) noexcept {
  slot.message = IntraProcessReader::take(slot.more);
  if (slot.message == nullptr) return false;
  const Envelope& envelope = slot.message->envelope;
  slot.sequence = envelope.sequence;
  slot.ready_time = envelope.publish_time;
  slot.root_release = envelope.root_release;
  slot.chain_instance = envelope.chain_instance;
  slot.expected_period = envelope.expected_period;
  return true;
}

}  // namespace takt
