// SPDX-License-Identifier: Apache-2.0
#include "takt/components/player.hpp"

#include <chrono>

#include "takt/containers/component.hpp"
#include "takt/ros2/wire_time.hpp"

namespace takt {

Player::Player(const NodeOptions& options)
    : Node("player", options),
      reader_(declare_parameter("file", std::string("recording.mcap"), {.read_only = true})),
      rate_(declare_parameter(
          "rate", 1.0,
          {.read_only = true, .floating_point_range = FloatingPointRange{0.001, 1000, 0}})) {
  const auto delay = std::chrono::milliseconds(declare_parameter(
      "start_delay_ms", 500, {.read_only = true, .integer_range = IntegerRange{1, 1 << 30, 0}}));
  if (!reader_.is_complete()) {
    log(LogLevel::warn, "the recording is incomplete: playing its {} messages",
        reader_.messages().size());
  }
  for (const RecordedTopic& topic : reader_.topics()) {
    publishers_.push_back(create_generic_publisher(topic.topic, topic.type, QoS(1000)));
  }
  if (declare_parameter("clock", false, {.read_only = true})) {
    clock_publisher_ = create_publisher<rosgraph_msgs::msg::Clock>("/clock", 1);
  }
  timer_ = create_timer("play", delay, [this] { play(); });
}

Player::~Player() {
  timer_.reset();
}

void Player::play() {
  const std::vector<RecordedMessage>& messages = reader_.messages();
  const TimePoint now = timer_->clock().now();
  if (begin_ == TimePoint{}) begin_ = now;
  const auto due = [&](const RecordedMessage& message) {
    const auto since_first =
        static_cast<double>(message.log_time_ns - messages.front().log_time_ns);
    return begin_ + Nanoseconds(static_cast<std::int64_t>(since_first / rate_));
  };
  for (; next_ < messages.size() && due(messages[next_]) <= now; ++next_) {
    const RecordedMessage& message = messages[next_];
    if (clock_publisher_ != nullptr) {
      const std::chrono::system_clock::time_point recorded(
          std::chrono::nanoseconds(message.log_time_ns));
      clock_publisher_->publish(rosgraph_msgs::msg::Clock().set__clock(wire_time(recorded)));
    }
    publishers_[message.topic]->publish(reader_.bytes(message));
  }
  if (next_ < messages.size()) return timer_->release_at(due(messages[next_]));
  timer_->cancel();
  log(LogLevel::info, "{} messages of {} topics were played", messages.size(),
      reader_.topics().size());
}

}  // namespace takt

TAKT_REGISTER_COMPONENT(takt::Player, "publishes the messages of an MCAP file")
