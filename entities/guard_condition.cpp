// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/guard_condition.hpp"

#include "takt/base/lockfree/read_section.hpp"
#include "takt/base/lockfree/sequence.hpp"

namespace takt {

GuardCondition::GuardCondition(std::string name, std::shared_ptr<CallbackGroup> group, Clock& clock,
                               std::function<void()> callback)
    : Entity(EntityKind::waitable, std::move(name), std::move(group)),
      clock_(clock),
      callback_(std::move(callback)) {
}

void GuardCondition::trigger() noexcept {
  const ReadSection section;
  const Arrival arrival{next_sequence(), clock_.now()};
  if (sequence_.load() == 0) {
    ready_time_.store(arrival.ready_time, std::memory_order_relaxed);  // published by the swap
    std::uint64_t none = 0;
    sequence_.compare_exchange_strong(none, arrival.sequence);
  }
  announce(arrival);
}

bool GuardCondition::front(Arrival& arrival) const noexcept {
  arrival = {sequence_.load(), ready_time_.load(std::memory_order_relaxed)};
  return arrival.sequence != 0;
}

bool GuardCondition::take(Slot& slot) noexcept {
  slot.ready_time = ready_time_.load(std::memory_order_relaxed);
  slot.sequence = sequence_.exchange(0);
  return slot.sequence != 0;
}

void GuardCondition::execute(Slot&) {
  if (callback_) callback_();
}

}  // namespace takt
