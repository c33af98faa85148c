// Simulated time of a context's nodes.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP_CONTEXT_TIME_SOURCE_HPP_
#define RCLCPP_CONTEXT_TIME_SOURCE_HPP_

#include <memory>
#include <mutex>
#include <thread>

#include "takt/executors/executor.hpp"
#include "takt/ros2/time_source.hpp"

#include "rclcpp/context.hpp"

namespace rclcpp::detail {

/// Takt's TimeSource with a node and a thread of its own, so that simulated time advances while no
/// node is spun. Both start with the first clock that needs simulated time.
/// Thread safety: every method from any thread. Real-time: no.
class ContextTimeSource final : public takt::SimulatedClock::Source {
 public:
  explicit ContextTimeSource(Context& context) : context_(context.weak_from_this()) {}
  ~ContextTimeSource() override {
    if (!thread_.joinable()) return;
    executor_->cancel();
    thread_.join();
  }

  void follow(const std::shared_ptr<takt::SimulatedClock>& clock) override {
    start();
    source_->follow(clock);
  }
  void leave(const takt::SimulatedClock& clock) noexcept override { source_->leave(clock); }

 private:
  void start();

  const std::weak_ptr<Context> context_;
  const std::shared_ptr<takt::TimeSource> source_ = std::make_shared<takt::TimeSource>();
  std::mutex mutex_;  // guards all below
  std::shared_ptr<takt::Node> node_;
  std::unique_ptr<takt::Executor> executor_;
  std::thread thread_;
};

}  // namespace rclcpp::detail

#endif  // RCLCPP_CONTEXT_TIME_SOURCE_HPP_
