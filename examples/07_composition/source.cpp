// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/component.hpp"

#include "sample.hpp"

namespace pipeline {

/// Sends `count` samples, one each millisecond.
class Source : public takt::Node {
 public:
  explicit Source(const takt::NodeOptions& options) : Node("source", options) {
    const auto count = declare_parameter<std::int64_t>("count", 200);
    publisher_ = create_publisher<Sample>("raw", 200, {.loans = 250});
    timer_ = create_timer("tick", std::chrono::milliseconds(1), [this, count] {
      if (number_ == count) return timer_->cancel();
      ++number_;
      auto sample = publisher_->borrow_loaned_message();
      *sample = {number_, number_ * number_ % 1000, number_ == count};
      publisher_->publish(std::move(sample));
    });
  }

 private:
  std::int64_t number_ = 0;
  std::shared_ptr<takt::Publisher<Sample>> publisher_;
  std::shared_ptr<takt::Timer> timer_;
};

}  // namespace pipeline

TAKT_REGISTER_COMPONENT(pipeline::Source, "sends numbered samples")
