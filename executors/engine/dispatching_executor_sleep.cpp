// What a worker does while there is nothing for it: it stands by, then sleeps.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "takt/base/spin_pause.hpp"
#include "takt/executors/engine/dispatching_executor.hpp"

namespace takt {

// Called without the lock. Returns true if another thread has posted.
bool DispatchingExecutor::wait(std::size_t index, TimePoint deadline, TimePoint release,
                               const FutureState* future) noexcept {
  const Clock& clock = *options_.clock;
  if (early_wake_ == Nanoseconds::zero() || deadline != release || deadline == kNever) {
    return backend_->wait(index, deadline);
  }
  const TimePoint early = deadline - early_wake_;
  TimePoint now = clock.now();
  if (now < early) {
    if (backend_->wait(index, early)) return true;
    now = clock.now();
    if (now < early) return false;  // the wait has ended for another reason
  }
  while (now < deadline && !has_announcements() && update_.load() == nullptr &&
         !cancelled_.load() && (future == nullptr || !future->ready())) {
    now = clock.now();
  }
  return false;
}

// Called with the lock held, after `next` found nothing. Returns true if the worker must look
// again, false at the limit.
bool DispatchingExecutor::sleep(std::size_t index, TimePoint limit,
                                const FutureState* future) noexcept {
  TimePoint deadline = limit;
  const TimePoint release = let_ != nullptr ? let_->next : ready_.next_release();
  if (timekeeper_ == kNobody || release < timekeeper_deadline_) {
    timekeeper_ = index;
    timekeeper_deadline_ = release;
    deadline = std::min(deadline, release);
  }
  idle_.fetch_add(1);
  const bool is_needed = has_announcements() || update_.load() != nullptr || stopping() ||
                         (future != nullptr && future->ready());
  unlock_and_leave();
  const bool was_woken = !is_needed && wait(index, deadline, release, future);
  // This worker still counts as idle, unless another thread is about to wake it: then it takes the
  // post.
  if (!was_woken && !claim_idle()) {
    while (!backend_->wait(index, kNever)) {
    }
  }
  lock();
  if (timekeeper_ == index) timekeeper_ = kNobody;
  ready_.read_clock();
  return ready_.now() < limit || is_needed;
}

// Called with the lock held, by a worker that others keep from dispatching, or leave nothing to.
// While they dispatch so fast that one more would only be in their way, and for a moment after the
// last dispatch, it watches them instead of sleeping, so nobody has to wake it for what they leave
// over. Returns false if there was nobody to watch, or nothing has come for long.
bool DispatchingExecutor::stand_by() noexcept {
  constexpr Nanoseconds kFast(250);  // for each dispatch
  constexpr Nanoseconds kLook(1000), kLookAtFast(5000);
  constexpr Nanoseconds kPatience(20'000);  // what it costs to sleep and to be woken
  if (!stands_by_ || idle_.load() + standing_by_.load() + 1 >= threads_.size()) return false;
  standing_by_.fetch_add(1);
  const TimePoint release = ready_.next_release();
  is_left_over_.store(ready_.waiting() != 0, std::memory_order_relaxed);
  std::uint64_t before = dispatches_.load(std::memory_order_relaxed);
  unlock();
  const Clock& clock = options_.clock->real();
  TimePoint start = clock.now(), now = start, last = start;
  for (bool is_fast = false;;) {
    const TimePoint look = start + (is_fast ? kLookAtFast : kLook);
    for (; now < look; now = clock.now()) spin_pause();
    const std::uint64_t dispatches = dispatches_.load(std::memory_order_relaxed) - before;
    if (dispatches != 0) last = now;
    is_fast = kFast * static_cast<std::int64_t>(dispatches) >= now - start;
    if (!is_fast && (is_left_over_.load(std::memory_order_relaxed) || has_announcements() ||
                     now >= release || now - last >= kPatience)) {
      break;
    }
    before += dispatches;
    start = now;
  }
  lock();
  standing_by_.fetch_sub(1);
  ready_.read_clock();
  return now - last < kPatience || ready_.waiting() != 0 || ready_.has_announcements();
}

}  // namespace takt
