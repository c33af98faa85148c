// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/engine/timer_queue.hpp"

#include <algorithm>
#include <cstddef>

namespace takt::detail {
namespace {

// Heap order: the timer that is due first in front; of equal ones, the one registered first.
constexpr auto due_later = [](const auto& a, const auto& b) noexcept {
  return a.first != b.first ? a.first > b.first : a.second->id() > b.second->id();
};

}  // namespace

// A reading of the clock takes nearly half as long as a callback without work, so readings are
// paced: the number of dispatches between two follows the time that dispatches took so far.
void TimerQueue::look_at_clock() noexcept {
  constexpr std::int64_t kBetweenLooksNs = 2000;
  // The most callbacks for which a due timer waits, if brief ones suddenly become long.
  constexpr std::int64_t kMostBetweenLooks = 16;
  const TimePoint before = now_;
  read_clock();
  if (dispatches_until_look_ == 0) {
    const std::int64_t elapsed_ns = std::max<std::int64_t>((now_ - before).count(), 1);
    dispatches_between_looks_ = static_cast<std::uint32_t>(std::clamp<std::int64_t>(
        dispatches_between_looks_ * kBetweenLooksNs / elapsed_ns, 1, kMostBetweenLooks));
  }
  dispatches_until_look_ = dispatches_between_looks_;
}

void TimerQueue::arm(CallbackRecord& record) noexcept {
  const TimePoint release = *record.entity->next_release();
  if (release == kNever) return;
  entries_.emplace_back(release, &record);  // within the reserved capacity
  std::push_heap(entries_.begin(), entries_.end(), due_later);
}

// Rebuilds the heap once: timer by timer, n timers that begin together would cost O(n²). A timer
// that is announced meanwhile is erased, too, and armed when the inbox is drained.
void TimerQueue::rearm(ReadyCallback* first) noexcept {
  std::erase_if(entries_, [](const auto& timer) { return timer.second->is_announced.load(); });
  std::make_heap(entries_.begin(), entries_.end(), due_later);
  while (first != nullptr) {
    auto& record = static_cast<CallbackRecord&>(*std::exchange(first, first->next));
    RecordState::set_again(record.is_announced);
    arm(record);
  }
}

CallbackRecord* TimerQueue::take_first(TimePoint& due) noexcept {
  const auto [release, record] = entries_.front();
  std::pop_heap(entries_.begin(), entries_.end(), due_later);
  entries_.pop_back();
  due = release;
  return record;
}

// Looks only at the heap's second and third entry: the answer affects nothing but how often a
// worker has to be woken.
TimePoint TimerQueue::release_beside_first() const noexcept {
  if (next_release() == kNever) return kNever;
  const auto& [release, first] = entries_.front();
  const Nanoseconds period = first->settings.info.period;
  TimePoint result = period == Nanoseconds::zero() ? kNever : later(release, period);
  for (std::size_t i = 1; i < std::min<std::size_t>(entries_.size(), 3); ++i) {
    if (entries_[i].second->exclusion != first->exclusion) {
      result = std::min(result, entries_[i].first);
    }
  }
  return result;
}

// A few removed records are compared by address, without a cache miss for each timer's record.
void TimerQueue::exchange(Entries& memory, const std::vector<CallbackRecord*>& removed) noexcept {
  constexpr std::size_t kFew = 8;
  const auto is_removed = [&](const auto& timer) {
    return removed.size() > kFew
               ? timer.second->state.is_removed()
               : std::find(removed.begin(), removed.end(), timer.second) != removed.end();
  };
  const bool has_timers = std::any_of(removed.begin(), removed.end(),
                                      [](const auto* each) { return each->is_timer(); });
  if (has_timers && std::erase_if(entries_, is_removed) != 0)
    std::make_heap(entries_.begin(), entries_.end(), due_later);
  if (memory.capacity() <= entries_.capacity()) return;
  memory.assign(entries_.begin(), entries_.end());
  entries_.swap(memory);
}

}  // namespace takt::detail
