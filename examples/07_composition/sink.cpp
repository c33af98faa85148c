// SPDX-License-Identifier: Apache-2.0
#include "takt/containers/component.hpp"

#include "sample.hpp"

namespace pipeline {

/// Prints, after the last sample, how many samples arrived and the sum of their values.
class Sink : public takt::Node {
 public:
  explicit Sink(const takt::NodeOptions& options) : Node("sink", options) {
    subscription_ = create_subscription<Sample>("smooth", 200, [this](const Sample& sample) {
      ++count_;
      sum_ = (sum_ * 31 + sample.number * sample.value) % 1'000'000'007;
      if (sample.is_last) log(takt::LogLevel::info, "{} samples, sum {}", count_, sum_);
    });
  }

 private:
  std::int64_t count_ = 0, sum_ = 0;
  std::shared_ptr<takt::Subscription<Sample>> subscription_;
};

}  // namespace pipeline

TAKT_REGISTER_COMPONENT(pipeline::Sink, "adds samples up")
