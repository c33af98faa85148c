// SPDX-License-Identifier: Apache-2.0
#include "takt/ros2/time_source.hpp"

#include <algorithm>
#include <mutex>
#include <utility>

#include "takt/base/same_owner.hpp"

namespace takt {

void TimeSource::set_host(const std::shared_ptr<Node>& host) {
  std::shared_ptr<Subscription<ClockMessage>> unused;  // destroyed after the unlock: that may wait
  {
    const std::lock_guard lock(mutex_);
    unused = std::move(subscription_);
    host_ = host;
    if (clocks_.empty()) return;
  }
  subscribe();
}

void TimeSource::follow(const std::shared_ptr<SimulatedClock>& clock) {
  subscribe();
  const std::lock_guard lock(mutex_);
  std::erase_if(clocks_, [](const Followed& known) { return known.clock.expired(); });
  const auto known = std::find_if(clocks_.begin(), clocks_.end(), [&](const Followed& each) {
    return is_same_owner(each.clock, clock);
  });
  Followed& followed = known != clocks_.end() ? *known : clocks_.emplace_back(Followed{clock});
  ++followed.count;
  if (now_) clock->set(*now_);
}

void TimeSource::leave(const SimulatedClock& clock) noexcept {
  std::shared_ptr<Subscription<ClockMessage>> unused;
  const std::lock_guard lock(mutex_);
  std::erase_if(clocks_, [&](Followed& known) {
    const auto alive = known.clock.lock();
    return alive == nullptr || (alive.get() == &clock && --known.count == 0);
  });
  if (!clocks_.empty()) return;
  unused = std::move(subscription_);
  now_.reset();
}

// Creates the subscription without the lock: executors that listen to the node take their own
// locks. Drops it if another thread has made one meanwhile, or the host has changed.
void TimeSource::subscribe() {
  std::shared_ptr<Node> host;
  {
    const std::lock_guard lock(mutex_);
    host = host_.lock();
    if (host == nullptr || subscription_ != nullptr) return;
  }
  std::shared_ptr<Subscription<ClockMessage>> made = host->create_subscription<ClockMessage>(
      "/clock", *qos_profile("clock"), [this](const ClockMessage& message) {
        set(TimePoint(Nanoseconds(Time(message.clock).nanoseconds())));
      });
  const std::lock_guard lock(mutex_);
  if (subscription_ == nullptr && is_same_owner(host_, host)) subscription_.swap(made);
}

void TimeSource::set(TimePoint now) noexcept {
  const std::lock_guard lock(mutex_);
  now_ = now;
  for (const Followed& known : clocks_) {
    if (const auto clock = known.clock.lock()) clock->set(now);
  }
}

}  // namespace takt
