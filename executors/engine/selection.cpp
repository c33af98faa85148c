// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/engine/selection.hpp"

#include <algorithm>
#include <bit>

namespace takt::detail {

bool Selection::puts_aside(CallbackRecord& record, std::size_t worker) noexcept {
  if (holds(record)) return true;
  if (worker == kAnyWorker || (record.settings.workers >> worker & 1) != 0) return false;
  if (passed_over_ == nullptr) end_of_passed_over_ = &passed_over_;
  *end_of_passed_over_ = &record;
  end_of_passed_over_ = &record.next;
  return true;
}

bool Selection::holds(CallbackRecord& record) noexcept {
  if (admits(record)) return false;
  record.next = std::exchange(held_, &record);
  if (rule_->may_hold_for_ever()) record.is_held.store(true);
  return true;
}

ReadyCallback* Selection::take_held() noexcept {
  for (ReadyCallback* each = held_; each != nullptr; each = each->next)
    static_cast<CallbackRecord*>(each)->is_held.store(false);
  return std::exchange(held_, nullptr);
}

TimePoint Selection::release_or_opening(TimePoint release, bool has_waiting) const noexcept {
  if (rule_ == nullptr) return release;
  if (is_logical_) return rule_->opens_at();
  const bool is_awaited = held_ != nullptr || (has_waiting && !rule_->is_open());
  return is_awaited ? std::min(release, rule_->opens_at()) : release;
}

// A callback that is demoted interrupts nothing.
std::optional<std::size_t> Selection::worker_for(const CallbackRecord& record) const noexcept {
  const std::uint32_t level = record.info == &record.settings.info ? record.level.load() : 0;
  std::size_t next = 0;
  for (std::size_t i = 0; i < running_.size(); ++i) {
    const Running& running = running_[i];
    if (running.ceiling != 0 && level > running.ceiling &&
        policy_->precedes(record, running.callback)) {
      next = i + 1;
    }
  }
  if (next == running_.size() || running_[next].ceiling != 0) return {};
  return next;
}

void Selection::begin(const CallbackRecord& record, std::size_t worker) noexcept {
  const std::uint32_t level = record.level.load();
  running_[worker] = {record, record.is_reentrant() ? level : record.exclusion->ceiling()};
  set_ceiling();
}

void Selection::end(std::size_t worker) noexcept {
  running_[worker].ceiling = 0;
  set_ceiling();
}

void Selection::set_ceiling() noexcept {
  std::uint32_t highest = 0;
  for (const Running& running : running_) highest = std::max(highest, running.ceiling);
  ceiling_.store(highest);
}

void Selection::count(const ReadyCallback& callback, int change) noexcept {
  WorkerSet left = static_cast<const CallbackRecord&>(callback).settings.workers;
  for (; left != 0; left &= left - 1) {
    auto& waiting = waiting_for_[static_cast<std::size_t>(std::countr_zero(left))];
    waiting.store(waiting.load(std::memory_order_relaxed) + static_cast<std::uint32_t>(change));
  }
}

}  // namespace takt::detail
