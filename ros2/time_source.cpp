// SPDX-License-Identifier: Apache-2.0
#include "takt/ros2/time_source.hpp"

#include <mutex>
#include <utility>

namespace takt {

void TimeSource::set_host(const std::shared_ptr<Node>& host) {
  std::shared_ptr<Subscription<ClockMessage>> unused;  // goes after the lock: that may wait
  const std::lock_guard lock(mutex_);
  unused = std::move(subscription_);
  host_ = host;
  if (!clocks_.empty()) subscribe();
}

void TimeSource::follow(const std::shared_ptr<SimulatedClock>& clock) {
  const std::lock_guard lock(mutex_);
  subscribe();
  std::erase_if(clocks_, [](const auto& known) { return known.expired(); });
  clocks_.push_back(clock);
  if (now_) clock->set(*now_);
}

void TimeSource::leave(const SimulatedClock& clock) noexcept {
  std::shared_ptr<Subscription<ClockMessage>> unused;
  const std::lock_guard lock(mutex_);
  std::erase_if(clocks_, [&](const auto& known) {
    const auto alive = known.lock();
    return alive == nullptr || alive.get() == &clock;
  });
  if (!clocks_.empty()) return;
  unused = std::move(subscription_);
  now_.reset();
}

void TimeSource::subscribe() {
  const auto host = host_.lock();
  if (host == nullptr || subscription_ != nullptr) return;
  subscription_ = host->create_subscription<ClockMessage>(
      "/clock", *qos_profile("clock"), [this](const ClockMessage& message) {
        set(TimePoint(Nanoseconds(Time(message.clock).nanoseconds())));
      });
}

void TimeSource::set(TimePoint now) noexcept {
  const std::lock_guard lock(mutex_);
  now_ = now;
  for (const auto& known : clocks_) {
    if (const auto clock = known.lock()) clock->set(now);
  }
}

}  // namespace takt
