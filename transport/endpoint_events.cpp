// SPDX-License-Identifier: Apache-2.0
#include "takt/transport/endpoint_events.hpp"

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
