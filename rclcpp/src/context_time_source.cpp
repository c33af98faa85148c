// SPDX-License-Identifier: Apache-2.0
#include "context_time_source.hpp"

#include <string>

#include <unistd.h>

#include "takt/programs/simulated_program.hpp"

namespace rclcpp::detail {

void ContextTimeSource::start() {
  takt::programs::refuse("follows /clock (use_sim_time)");
  const std::lock_guard lock(mutex_);
  if (node_ != nullptr) return;
  takt::NodeOptions options;
  if (const auto context = context_.lock()) options.participant = context->participant();
  node_ = std::make_shared<takt::Node>("_takt_clock_" + std::to_string(getpid()), options);
  takt::ExecutorOptions how;
  how.name = "ros_clock";
  executor_ = takt::executors().make("single_threaded", how);
  executor_->add_node(node_);
  source_->set_host(node_);
  thread_ = std::thread([this] { executor_->spin(); });
}

}  // namespace rclcpp::detail
