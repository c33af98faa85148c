// SPDX-License-Identifier: Apache-2.0
#include "takt/components/player.hpp"

#include <algorithm>
#include <chrono>

#include <fmt/format.h>

#include "takt/base/counted.hpp"
#include "takt/base/error.hpp"
#include "takt/base/ros_time.hpp"
#include "takt/components/named_file.hpp"
#include "takt/components/recorded_qos.hpp"
#include "takt/containers/component.hpp"

namespace takt {
namespace {

// From the last message of a loop to the first of the next: a recording may have one instant only.
constexpr auto kPauseOfLoop = std::chrono::milliseconds(1);

}  // namespace

Player::Player(const NodeOptions& options)
    : Node("player", options),
      reader_(named_file(
          options, declare_parameter("file", std::string("recording.mcap"), {.read_only = true}))),
      rate_(declare_parameter(
          "rate", 1.0,
          {.read_only = true, .floating_point_range = FloatingPointRange{0.001, 1000, 0}})),
      loops_(declare_parameter("loop", false, {.read_only = true})) {
  const auto milliseconds = [this](const char* name, std::int64_t value, std::int64_t least) {
    return std::chrono::milliseconds(declare_parameter(
        name, value, {.read_only = true, .integer_range = IntegerRange{least, 1 << 30, 0}}));
  };
  const auto delay = milliseconds("start_delay_ms", 500, 1);
  const auto offset = milliseconds("start_offset_ms", 0, 0);
  if (!reader_.is_complete()) {
    log(LogLevel::warn, "the recording is incomplete: playing its {} messages",
        reader_.messages().size());
  }
  publish_topics(declare_parameter("topics", std::vector<std::string>{}, {.read_only = true}));
  if (declare_parameter("clock", false, {.read_only = true})) {
    clock_publisher_ = create_publisher<rosgraph_msgs::msg::Clock>("/clock", 1);
  }
  const std::vector<RecordedMessage>& messages = reader_.messages();
  while (first_ < messages.size() &&
         since_first(messages[first_]) < std::chrono::duration_cast<Nanoseconds>(offset)) {
    ++first_;
  }
  next_ = first_;
  timer_ = create_timer("play", delay, [this] { play(); });
}

Player::~Player() {
  timer_.reset();
}

void Player::publish_topics(const std::vector<std::string>& wanted) {
  std::vector<std::string> names;
  for (const RecordedTopic& topic : reader_.topics()) names.push_back(topic.topic);
  for (const std::string& topic : wanted) {
    if (std::find(names.begin(), names.end(), topic) != names.end()) continue;
    throw Error(fmt::format("the recording has no topic '{}'", topic), suggest(topic, names));
  }
  for (const RecordedTopic& topic : reader_.topics()) {
    const bool is_wanted =
        wanted.empty() || std::find(wanted.begin(), wanted.end(), topic.topic) != wanted.end();
    publishers_.push_back(
        is_wanted ? create_generic_publisher(topic.topic, topic.type, from_recorded_qos(topic.qos))
                  : nullptr);
  }
}

Nanoseconds Player::since_first(const RecordedMessage& message) const {
  return Nanoseconds(
      static_cast<std::int64_t>(message.log_time_ns - reader_.messages().front().log_time_ns));
}

void Player::play() {
  const std::vector<RecordedMessage>& messages = reader_.messages();
  const TimePoint now = timer_->clock().now();
  if (begin_ == TimePoint{}) begin_ = now;
  const auto due = [&](const RecordedMessage& message) {
    const auto since =
        static_cast<double>((since_first(message) - since_first(messages[first_])).count());
    return begin_ + Nanoseconds(static_cast<std::int64_t>(since / rate_));
  };
  for (; next_ < messages.size() && due(messages[next_]) <= now; ++next_) publish(messages[next_]);
  if (next_ < messages.size()) return timer_->release_at(due(messages[next_]));
  if (loops_ && first_ < messages.size()) {
    next_ = first_;
    begin_ = {};
    return timer_->release_at(later(now, kPauseOfLoop));
  }
  timer_->cancel();
  log(LogLevel::info, "played: {} of {}", counted(played_, "message"),
      counted(reader_.topics().size(), "topic"));
  has_ended_.store(true);
}

void Player::publish(const RecordedMessage& message) {
  const auto& publisher = publishers_[message.topic];
  if (publisher == nullptr) return;
  if (clock_publisher_ != nullptr) {
    const Time recorded{Nanoseconds(message.log_time_ns)};
    clock_publisher_->publish(rosgraph_msgs::msg::Clock().set__clock(recorded));
  }
  publisher->publish(reader_.bytes(message));
  ++played_;
}

}  // namespace takt

TAKT_REGISTER_COMPONENT(takt::Player, "publishes the messages of an MCAP file")
