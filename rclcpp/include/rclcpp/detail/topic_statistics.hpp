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

/// What has been measured since the last message about it.
/// Thread safety: every method from any thread.
/// Real-time: `received` takes a lock with priority inheritance.
class TopicStatistics {
 public:
  /// nullptr: the options do not ask for them. Throws std::invalid_argument when the period is not
  /// positive.
  static std::shared_ptr<TopicStatistics> make(const node_interfaces::NodeBaseInterface& node,
                                               const SubscriptionOptionsBase& options);
  /// Publishes them, if there are any, at the end of each period, for as long as it lives.
  static std::shared_ptr<takt::Entity> publish(const std::shared_ptr<TopicStatistics>& statistics,
                                               node_interfaces::NodeBaseInterface& node,
                                               const SubscriptionOptionsBase& options);

  /// A message, whose callback is about to be called.
  void received(const takt::MessageInfo& info);

 private:
  using Message = statistics_msgs::msg::MetricsMessage;
  using Clock = std::chrono::system_clock;
  struct Measured {  // in ms
    void add(double value) noexcept;
    void write(Message& message) const;
    double average = 0, sum_of_squares = 0;  // these of differences from the average
    double minimum = std::numeric_limits<double>::max();
    double maximum = std::numeric_limits<double>::lowest();
    std::uint64_t count = 0;
  };
  struct Window {
    Measured age, period;
    Clock::time_point begin = Clock::now();
  };
  /// Ends the window; the next one begins then.
  Window next_window(Clock::time_point end);

  takt::PiMutex mutex_;
  Window window_ TAKT_GUARDED_BY(mutex_);
  std::int64_t last_ TAKT_GUARDED_BY(mutex_) = 0;  // received; 0: none
};

}  // namespace rclcpp::detail

#endif  // RCLCPP__DETAIL__TOPIC_STATISTICS_HPP_
