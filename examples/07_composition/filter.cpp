// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/component.hpp"

#include "sample.hpp"

namespace pipeline {

/// Smooths: each value becomes the mean of itself and the smoothed one before.
class Filter : public takt::Node {
 public:
  explicit Filter(const takt::NodeOptions& options) : Node("filter", options) {
    publisher_ = create_publisher<Sample>("smooth", 200, {.loans = 250});
    subscription_ = create_subscription<Sample>("raw", 200, [this](const Sample& raw) {
      smooth_ = (smooth_ + raw.value) / 2;
      auto sample = publisher_->borrow_loaned_message();
      *sample = {raw.number, smooth_, raw.is_last};
      publisher_->publish(std::move(sample));
    });
  }

 private:
  std::int64_t smooth_ = 0;
  std::shared_ptr<takt::Publisher<Sample>> publisher_;
  std::shared_ptr<takt::Subscription<Sample>> subscription_;
};

}  // namespace pipeline

TAKT_REGISTER_COMPONENT(pipeline::Filter, "smooths samples")
