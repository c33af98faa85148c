// SPDX-License-Identifier: Apache-2.0
#include "rclcpp/subscription.hpp"

#include <algorithm>

#include "rclcpp/clock.hpp"

namespace rclcpp {

MessageInfo::MessageInfo(const takt::MessageInfo& info) : info_{} {
  const auto since_1970 = [](std::chrono::system_clock::time_point time) {
    return std::chrono::nanoseconds(time.time_since_epoch()).count();
  };
  info_.received_timestamp = since_1970(detail::system_now());
  info_.source_timestamp = since_1970(info.source_time);
  // A message of this process has no source time, only a publish time of the steady clock.
  if (info_.source_timestamp == 0 && info.publish_time != takt::TimePoint{}) {
    const takt::Nanoseconds age = takt::Clock::steady().now() - info.publish_time;
    info_.source_timestamp = info_.received_timestamp - age.count();
  }
  info_.publication_sequence_number = info_.reception_sequence_number = info.sequence;
  info_.publisher_gid.implementation_identifier = "takt";
  std::memcpy(info_.publisher_gid.data, &info.writer, sizeof info.writer);
  info_.from_intra_process = info.writer == 0;
}

std::size_t SubscriptionBase::get_publisher_count() const {
  return static_cast<std::size_t>(
      std::max<std::int64_t>(takt_->events()->status(takt::MatchedStatus{}).current_count, 0));
}

bool SubscriptionBase::take_serialized(SerializedMessage& message, MessageInfo& info) {
  takt::Slot slot;
  if (!takt_->take(slot)) return false;
  const takt::HeldMessage held(slot.message);
  const takt::MessageType& type = *takt_->endpoint().type;
  if (type.encode == nullptr) refuse("take_serialized for a subscription of encoded messages");
  takt::ByteBuffer bytes;
  type.encode(held->payload(), bytes);
  message = SerializedMessage(bytes.bytes());
  info = MessageInfo(takt::MessageInfo(slot));
  return true;
}

}  // namespace rclcpp
