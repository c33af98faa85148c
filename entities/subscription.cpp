// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/subscription.hpp"

#include "takt/base/logger.hpp"

namespace takt {

SubscriptionBase::SubscriptionBase(EntityKind kind, const std::string& name,
                                   const std::shared_ptr<CallbackGroup>& group,
                                   const Endpoint& endpoint,
                                   const std::shared_ptr<Participant>& participant)
    : Entity(kind, name, group), IntraProcessReader(endpoint), participant_(participant) {
}

SubscriptionBase::~SubscriptionBase() = default;

SubscriptionBase::Report SubscriptionBase::report() const {
  return {.topic = topic(),
          .expected = expected(),
          .from_outside = ask_outside(&RemoteReader::received),
          .dropped = lost()};
}

void SubscriptionBase::attach(Sink& sink) noexcept {
  set_wants_time(sink.wants_time());
  set_listener(&sink);
  Entity::attach(sink);
}

void SubscriptionBase::detach() noexcept {
  set_listener(nullptr);
  Entity::detach();
  set_wants_time(false);
}

void SubscriptionBase::retire() noexcept {
  leave();
  Entity::retire();
  // After the callback, which asks it for the ends outside when it answers.
  if (own_remote_ == nullptr) return;
  remote_.store(nullptr);
  wait_for_readers();
  own_remote_.reset();
}

bool SubscriptionBase::front(Arrival& arrival) const noexcept {
  std::int64_t time_ns;
  if (!ring().front(arrival.sequence, time_ns)) return false;
  arrival.ready_time = TimePoint(Nanoseconds(time_ns));
  return true;
}

void SubscriptionBase::announce_if_ready() noexcept {
  if (ready_count() == 0) return;
  const ReadSection section;
  Arrival arrival{};
  if (!front(arrival)) arrival = {next_sequence(), {}};  // its publisher has not finished
  announce(arrival);
}

void SubscriptionBase::start() {
  if (participant_ == nullptr || !participant_->serves_own_process()) join();
  if (participant_ == nullptr) return;
  own_remote_ = participant_->create_reader(*this);
  remote_.store(own_remote_.get());
}

MessageBlock* SubscriptionBase::decode_received(MessageBlock& received) noexcept {
  const auto bytes = received.encoded();
  MessageBlock* message = decode(bytes);
  if (message != nullptr) {
    message->envelope = received.envelope;
    message->origin = received.origin;
  } else {
    static constinit LogThrottle throttle;
    malformed_.fetch_add(1, std::memory_order_relaxed);
    if (const auto left_out = throttle.may_log()) {
      log(LogLevel::warn, "{}: {} bytes are no {}: dropped{}", topic(), bytes.size(),
          endpoint().type->name, *left_out == 0 ? "" : fmt::format(" ({} more before)", *left_out));
    }
  }
  received.release();
  return message;
}

bool SubscriptionBase::take(Slot& slot) noexcept {
  slot.message = take_message(slot.more);
  if (slot.message == nullptr) return false;
  static_cast<Envelope&>(slot) = slot.message->envelope;
  return true;
}

detail::ControlBlocks::ControlBlocks(std::size_t count)
    : cells_(Pool<Cell>::create(count, [](std::uint32_t) { return std::make_unique<Cell>(); })) {
}

}  // namespace takt
