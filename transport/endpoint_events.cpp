// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/endpoint_events.hpp"

#include <algorithm>
#include <mutex>
#include <utility>

#include "takt/base/lockfree/read_section.hpp"

namespace takt {

void EndpointEvents::happened(EndpointEvent event) noexcept {
  const ReadSection section;
  if (Listener* listener = listeners_[static_cast<std::size_t>(event)].load()) listener->happened();
}

void EndpointEvents::matched(int change) noexcept {
  if (change > 0) total_matched_.fetch_add(static_cast<std::uint64_t>(change));
  matched_.fetch_add(change);
  happened(EndpointEvent::matched);
}

void EndpointEvents::incompatible(std::string_view policy) noexcept {
  last_policy_.store(policy.data());
  incompatible_.fetch_add(1);
  happened(EndpointEvent::incompatible_qos);
}

void EndpointEvents::lost(std::uint64_t count) noexcept {
  lost_.fetch_add(count);
  happened(EndpointEvent::message_lost);
}

void EndpointEvents::missed_deadlines(std::uint64_t count) noexcept {
  missed_.fetch_add(count);
  happened(EndpointEvent::deadline_missed);
}

void EndpointEvents::liveliness_changed(int alive_change, int not_alive_change) noexcept {
  alive_.fetch_add(alive_change);
  not_alive_.fetch_add(not_alive_change);
  happened(EndpointEvent::liveliness_changed);
}

void EndpointEvents::follow(std::shared_ptr<LivelinessLease> lease) {
  {
    const std::lock_guard lock(mutex_);
    followed_.push_back({std::move(lease)});
  }
  liveliness_changed(1, 0);
}

void EndpointEvents::leave(const LivelinessLease& lease) noexcept {
  bool was_alive = true;
  {
    const std::lock_guard lock(mutex_);
    const auto found = std::find_if(followed_.begin(), followed_.end(),
                                    [&](const auto& each) { return each.lease.get() == &lease; });
    if (found == followed_.end()) return;
    was_alive = found->is_alive;
    followed_.erase(found);
  }
  was_alive ? liveliness_changed(-1, 0) : liveliness_changed(0, -1);
}

TimePoint EndpointEvents::look_for_leases(TimePoint now) noexcept {
  TimePoint next = kNever;
  const std::lock_guard lock(mutex_);
  for (Followed& followed : followed_) {
    if (now >= followed.lease->end()) followed.lease->miss();
    const TimePoint end = followed.lease->end();
    const bool is_alive = now < end;
    if (is_alive != followed.is_alive) {
      alive_.fetch_add(is_alive ? 1 : -1);
      not_alive_.fetch_add(is_alive ? -1 : 1);
      followed.is_alive = is_alive;
    }
    if (is_alive) next = std::min(next, end);
  }
  return next;
}

MatchedStatus EndpointEvents::status(const MatchedStatus& before) const noexcept {
  const std::uint64_t total = total_matched_.load();
  const std::int64_t current = matched_.load();
  return {total, total - before.total_count, current, current - before.current_count};
}

IncompatibleQosStatus EndpointEvents::status(const IncompatibleQosStatus& before) const noexcept {
  const std::uint64_t total = incompatible_.load();
  return {total, total - before.total_count, last_policy_.load()};
}

MessageLostStatus EndpointEvents::status(const MessageLostStatus& before) const noexcept {
  const std::uint64_t total = lost_.load();
  return {total, total - before.total_count};
}

DeadlineMissedStatus EndpointEvents::status(const DeadlineMissedStatus& before) const noexcept {
  const std::uint64_t total = missed_.load();
  return {total, total - before.total_count};
}

LivelinessChangedStatus EndpointEvents::status(
    const LivelinessChangedStatus& before) const noexcept {
  const std::int64_t alive = alive_.load(), not_alive = not_alive_.load();
  return {alive, alive - before.alive_count, not_alive, not_alive - before.not_alive_count};
}

}  // namespace takt
