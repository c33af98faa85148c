// SPDX-License-Identifier: Apache-2.0
#include "takt/entities/subscription.hpp"

#include "takt/base/logger.hpp"
#include "takt/base/tracepoints.hpp"

namespace takt {

namespace {
constexpr std::size_t kControlBlock = 64;  // bytes, of a shared_ptr with a deleter
}  // namespace

SubscriptionBase::SubscriptionBase(EntityKind kind, const std::string& name,
                                   const std::shared_ptr<CallbackGroup>& group,
                                   const Endpoint& endpoint,
                                   const std::shared_ptr<Participant>& participant,
                                   const Memory& memory)
    : Entity(kind, name, group),
      IntraProcessReader(endpoint),
      participant_(participant),
      maker_(memory.maker),
      messages_(memory.copies || (participant != nullptr && memory.maker != nullptr)
                    ? make_loans_by_need(memory.messages, *memory.maker)
                    : nullptr),
      control_blocks_(memory.shared != 0
                          ? std::make_unique<const Cells>(memory.shared, kControlBlock)
                          : nullptr) {
}

SubscriptionBase::~SubscriptionBase() = default;

SubscriptionBase::Counts SubscriptionBase::counts() const noexcept {
  return {.expected = expected(),
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
  // Only now, as the callback of a service uses it to answer clients in other processes.
  if (own_remote_ == nullptr) return;
  remote_.store(nullptr);
  wait_for_readers();
  own_remote_.reset();
}

bool SubscriptionBase::front(Arrival& arrival) const noexcept {
  std::int64_t time_ns, root_time_ns;
  if (!ring().front(arrival.sequence, time_ns, root_time_ns)) return false;
  arrival.ready_time = TimePoint(Nanoseconds(time_ns));
  arrival.root_time = TimePoint(Nanoseconds(root_time_ns));
  return true;
}

void SubscriptionBase::announce_if_ready() noexcept {
  if (ready_count() == 0) return;
  const ReadSection section;
  Arrival arrival{};
  if (!front(arrival)) arrival = {next_sequence(), {}};  // the publisher is still storing it
  announce(arrival);
}

void SubscriptionBase::start() {
  if (participant_ == nullptr || !participant_->serves_own_process()) join();
  if (participant_ == nullptr) return;
  own_remote_ = participant_->create_reader(*this);
  if (const Tracepoints* const points = tracepoints())
    points->rmw_subscription_init(static_cast<Entity*>(this), own_remote_->gid().data());
  remote_.store(own_remote_.get());
}

std::size_t SubscriptionBase::ready_count() const noexcept {
  return ring().size();
}

std::uint64_t SubscriptionBase::lost() const noexcept {
  return dropped() + malformed_;
}

MessageBlock* SubscriptionBase::decode(std::span<const std::byte> bytes) noexcept {
  const MessageType& type = *endpoint().type;
  if (LoanedBlock* loan = messages_ != nullptr ? messages_->acquire() : nullptr) {
    loan->set_references(1);
    if (type.decode(bytes, loan->message())) return loan;
    loan->release();
    return nullptr;
  }
  auto owned = std::make_unique<OwnedBlock>();
  owned->from_heap = true;
  owned->set_references(1);
  if (type.decode(bytes, maker_->own(*owned))) return owned.release();
  return nullptr;
}

std::shared_ptr<const void> SubscriptionBase::share(MessageBlock& message) {
  HeldMessage held(&message);
  if (const std::shared_ptr<const void>* shared = message.shared()) return *shared;
  return std::shared_ptr<const void>(
      message.payload(), [held = held.release()](const void*) { held->release(); },
      control_blocks_->allocator());
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

void SubscriptionBase::discard(Slot& slot) noexcept {
  slot.message->release();
}

// Every message passes here: one tracepoint for messages of this process, three for others.
void SubscriptionBase::trace_take(const Tracepoints& points,
                                  const MessageBlock& message) const noexcept {
  if (message.origin.writer == 0) {
    const auto index = reinterpret_cast<std::uintptr_t>(message.payload());
    return points.rclcpp_ring_buffer_dequeue(static_cast<const IntraProcessReader*>(this), index,
                                             queued());
  }
  const auto sent = message.origin.source_time.time_since_epoch();
  points.rmw_take(static_cast<const Entity*>(this), message.payload(),
                  std::chrono::duration_cast<Nanoseconds>(sent).count(), 1);
  points.rcl_take(message.payload());
  points.rclcpp_take(message.payload());
}

bool SubscriptionBase::take(Slot& slot) noexcept {
  slot.message = take_message(slot.more);
  if (slot.message == nullptr) return false;
  const Tracepoints* const points = tracepoints();
  if (points != nullptr && points->records_takes()) [[unlikely]]
    trace_take(*points, *slot.message);
  static_cast<Envelope&>(slot) = slot.message->envelope;
  return true;
}

}  // namespace takt
