// Age and period of the messages of a subscription.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__DETAIL__TOPIC_STATISTICS_HPP_
#define RCLCPP__DETAIL__TOPIC_STATISTICS_HPP_

#include <chrono>
#include <cstdint>
#include <limits>
#include <memory>

#include "takt/base/pi_mutex.hpp"
#include "takt/entities/subscription.hpp"
#include "takt/messages/statistics_msgs/msg/metrics_message.hpp"

#include "rclcpp/node_interfaces/node_base_interface.hpp"
#include "rclcpp/subscription_options.hpp"

namespace rclcpp::detail {

/// Measures age and period of the messages since statistics were last published.
/// Thread safety: every method from any thread.
/// Real-time: `received` takes a lock with priority inheritance.
class TopicStatistics {
 public:
  /// nullptr: the options do not enable topic statistics. Throws std::invalid_argument when the
  /// publish period is not positive.
  static std::shared_ptr<TopicStatistics> make(const node_interfaces::NodeBaseInterface& node,
                                               const SubscriptionOptionsBase& options);
  /// Returns a timer that publishes the statistics at the end of each period; nullptr if
  /// `statistics` is.
  static std::shared_ptr<takt::Entity> publish(const std::shared_ptr<TopicStatistics>& statistics,
                                               node_interfaces::NodeBaseInterface& node,
                                               const SubscriptionOptionsBase& options);

  /// Measures a message just before its callback is called.
  void received(const takt::MessageInfo& info);

 private:
  using Message = statistics_msgs::msg::MetricsMessage;
  using Clock = std::chrono::system_clock;
  struct Measured {  // in ms
    void add(double value) noexcept;
    void write(Message& message) const;
    double average = 0, sum_of_squares = 0;  // squares of differences from the average
    double minimum = std::numeric_limits<double>::max();
    double maximum = std::numeric_limits<double>::lowest();
    std::uint64_t count = 0;
  };
  struct Window {
    Measured age, period;
    Clock::time_point begin = Clock::now();
  };
  /// Returns the current window; the next one begins at `end`.
  Window next_window(Clock::time_point end);

  takt::PiMutex mutex_;
  Window window_ TAKT_GUARDED_BY(mutex_);
  std::int64_t last_ TAKT_GUARDED_BY(mutex_) = 0;  // time of the last message; 0: none yet
};

}  // namespace rclcpp::detail

#endif  // RCLCPP__DETAIL__TOPIC_STATISTICS_HPP_
