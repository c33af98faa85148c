// SPDX-License-Identifier: Apache-2.0
#include "rclcpp/detail/topic_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>

#include "takt/messages/statistics_msgs/msg/statistic_data_type.hpp"
#include "takt/nodes/node.hpp"

#include "rclcpp/message_info.hpp"
#include "rclcpp/time.hpp"

namespace rclcpp::detail {
namespace {

double milliseconds(std::int64_t ns) {
  return static_cast<double>(ns) / 1e6;
}
Time time_of(std::chrono::system_clock::time_point time) {
  return Time(std::chrono::nanoseconds(time.time_since_epoch()).count());
}

}  // namespace

std::shared_ptr<TopicStatistics> TopicStatistics::make(
    const node_interfaces::NodeBaseInterface& node, const SubscriptionOptionsBase& options) {
  const auto& wanted = options.topic_stats_options;
  const bool is_enabled = wanted.state == TopicStatisticsState::NodeDefault
                              ? node.get_enable_topic_statistics_default()
                              : wanted.state == TopicStatisticsState::Enable;
  if (!is_enabled) return nullptr;
  if (wanted.publish_period <= std::chrono::milliseconds::zero()) {
    throw std::invalid_argument(
        "topic_stats_options.publish_period must be greater than 0, specified value of " +
        std::to_string(wanted.publish_period.count()) + " ms");
  }
  return std::make_shared<TopicStatistics>();
}

std::shared_ptr<takt::Entity> TopicStatistics::publish(
    const std::shared_ptr<TopicStatistics>& statistics, node_interfaces::NodeBaseInterface& node,
    const SubscriptionOptionsBase& options) {
  if (statistics == nullptr) return nullptr;
  const auto& wanted = options.topic_stats_options;
  takt::Node& core = *node.takt_node();
  auto publisher = core.create_publisher<Message>(
      node.resolve_topic_or_service_name(wanted.publish_topic, false), wanted.qos.to_takt(false));
  return core.create_wall_timer(
      wanted.publish_period,
      [statistics, publisher = std::move(publisher), name = std::string(node.get_name())] {
        const auto end = Clock::now();
        const Window window = statistics->next_window(end);
        Message message;
        message.measurement_source_name = name;
        message.unit = "ms";
        message.window_start = time_of(window.begin);
        message.window_stop = time_of(end);
        message.metrics_source = "message_age";
        window.age.write(message);
        publisher->publish(message);
        message.metrics_source = "message_period";
        window.period.write(message);
        publisher->publish(message);
      },
      options.callback_group);
}

void TopicStatistics::received(const takt::MessageInfo& info) {
  const MessageInfo times(info);
  const std::int64_t sent = times.get_rmw_message_info().source_timestamp;
  const std::int64_t now = times.get_rmw_message_info().received_timestamp;
  const std::lock_guard lock(mutex_);
  if (sent != 0) window_.age.add(milliseconds(now - sent));
  if (last_ != 0) window_.period.add(milliseconds(now - last_));
  last_ = now;
}

TopicStatistics::Window TopicStatistics::next_window(Clock::time_point end) {
  const std::lock_guard lock(mutex_);
  return std::exchange(window_, Window{.begin = end});
}

void TopicStatistics::Measured::add(double value) noexcept {
  const double before = average;
  average += (value - before) / static_cast<double>(++count);
  sum_of_squares += (value - before) * (value - average);
  minimum = std::min(minimum, value);
  maximum = std::max(maximum, value);
}

void TopicStatistics::Measured::write(Message& message) const {
  using Type = statistics_msgs::msg::StatisticDataType;
  const auto known = [&](double value) {
    return count != 0 ? value : std::numeric_limits<double>::quiet_NaN();
  };
  const std::pair<std::uint8_t, double> points[] = {
      {Type::STATISTICS_DATA_TYPE_AVERAGE, known(average)},
      {Type::STATISTICS_DATA_TYPE_MAXIMUM, known(maximum)},
      {Type::STATISTICS_DATA_TYPE_MINIMUM, known(minimum)},
      {Type::STATISTICS_DATA_TYPE_SAMPLE_COUNT, static_cast<double>(count)},
      {Type::STATISTICS_DATA_TYPE_STDDEV,
       known(std::sqrt(sum_of_squares / static_cast<double>(count)))}};
  message.statistics.clear();
  for (const auto& [type, value] : points) {
    message.statistics.emplace_back();
    message.statistics.back().data_type = type;
    message.statistics.back().data = value;
  }
}

}  // namespace rclcpp::detail
