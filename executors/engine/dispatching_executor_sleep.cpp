// How workers are woken, and what one does while there is nothing for it: it stands by, spins, then
// sleeps.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "takt/base/spin_pause.hpp"
#include "takt/executors/engine/dispatching_executor.hpp"

namespace takt {

bool DispatchingExecutor::claim_idle() noexcept {
  std::size_t idle = idle_.load();
  while (idle != 0) {
    if (idle_.compare_exchange_weak(idle, idle - 1)) return true;
  }
  return false;
}

// Called from another thread, or in an executor with several workers. What has to wait for the
// group of the callback that announces needs no other worker: this one looks for it afterwards.
void DispatchingExecutor::announce(CallbackRecord& record, Arrival arrival) noexcept {
  if (ready_.announce(record, arrival) && let_ == nullptr &&
      (group_inside() != record.exclusion.get() || record.is_reentrant())) {
    wake();
  }
}

[[gnu::flatten]] void DispatchingExecutor::announce_alone(CallbackRecord& record,
                                                          Arrival arrival) noexcept {
  ready_.announce_from_callback(record, arrival);
}

// Wakes one sleeping worker. The announcing thread writes its announcement first. A worker counts
// itself idle before it looks for events a last time. Both are sequentially consistent, so no
// wake-up is lost. A worker that stands by looks for events after it has ceased to. Without
// sleepers this costs three loads.
void DispatchingExecutor::wake() noexcept {
  if (standing_by_.load() != 0) return;
  if (claim_idle()) {
    backend_->post();
  } else if (Wakeable* observer = observer_.load()) {
    observer->wake();
  }
}

void DispatchingExecutor::wake_all() noexcept {
  is_left_over_.store(true);
  while (claim_idle()) backend_->post();
}

// Called with the lock held. Until the limit, looks for what a sleeper is woken for: nobody has to
// wake this worker meanwhile. Returns true if there is something. The ready set then has the time.
// An only worker counts as one that stands by until it sleeps, also in callbacks: to leave and come
// back each time would cost it a transfer of the cache line that publishers read.
bool DispatchingExecutor::spin_until(TimePoint limit, std::size_t index,
                                     const FutureState* future) noexcept {
  constexpr int kLooks = 32;          // between two readings of the clock
  constexpr Nanoseconds kLook(2000);  // between two looks at file descriptors
  if (shared_ || standing_by_.load() == 0) standing_by_.fetch_add(1);
  if (shared_) watched_closely_.fetch_add(1);
  unlock();
  const Clock& clock = *options_.clock;
  const TimePoint start = clock.now();
  TimePoint now = start, looked = start;
  bool is_needed = false;
  do {
    for (int i = 0; i < kLooks && !is_needed; ++i) {
      is_needed = is_left_over_.load(std::memory_order_relaxed) || must_look(future);
    }
    // Nobody needs the time of just now: the spin counts as over since the last reading.
    if (is_needed && now != start && !ready_.exact_time()) break;
    now = clock.now();
    if (watched_.load(std::memory_order_relaxed) != 0 && now - looked >= kLook) {
      if (backend_->look()) is_needed = true;  // an only worker announces beside the inbox
      looked = now;
    }
  } while (!is_needed && now < limit);
  lock();
  if (shared_) {
    watched_closely_.fetch_sub(1);
    standing_by_.fetch_sub(1);
  }
  spin_times_[index] += now - start;
  ready_.set_now(now);
  return is_needed;
}

// Called with the lock held. Returns true if this worker wakes up for the first timer: no other
// does so early enough.
bool DispatchingExecutor::keep_time(std::size_t index) noexcept {
  const TimePoint release = first_release();
  if (!needs_timekeeper(release)) return false;
  timekeeper_ = index;
  timekeeper_deadline_ = release;
  return true;
}

// Called with the lock held, after `next` found nothing. Returns true if the worker must look
// again, false at the limit.
bool DispatchingExecutor::sleep(std::size_t index, TimePoint limit,
                                const FutureState* future) noexcept {
  is_left_over_.store(exception_ != nullptr);  // before the next release is read
  has_just_run_ = false;
  if (spin_ != Nanoseconds::zero()) {
    keep_time(index);
    const TimePoint deadline = std::min(limit, first_release());
    const bool is_needed =
        spin_until(std::min(deadline, later(options_.clock->now(), spin_)), index, future);
    stop_keeping_time(index);
    if (is_needed || ready_.now() >= deadline) return is_needed || ready_.now() < limit;
  }
  const TimePoint release = first_release();
  const TimePoint deadline = keep_time(index) ? std::min(limit, release) : limit;
  const bool wakes_early =
      early_wake_ != Nanoseconds::zero() && deadline == release && release != kNever;
  const TimePoint end = wakes_early ? deadline - early_wake_ : deadline;
  if (end != kNever) wake_up_on_time();
  if (!shared_) standing_by_.store(0);
  idle_.fetch_add(1);
  // Left over: what came while this worker spun has woken no worker.
  bool is_needed = is_left_over_.load() || must_look(future) || exception_ != nullptr;
  unlock();
  bool was_woken =
      !is_needed && (!wakes_early || options_.clock->now() < end) && backend_->wait(index, end);
  // This worker still counts as idle, unless another thread is about to wake it: then it takes the
  // post.
  if (!was_woken && !claim_idle()) {
    while (!backend_->wait(index, kNever)) {
    }
    was_woken = true;
  }
  lock();
  ready_.read_clock();
  if (wakes_early && !is_needed && !was_woken && ready_.now() >= end &&
      !(shared_ && ready_.has_waiting())) {
    is_needed = spin_until(deadline, index, future);
  }
  stop_keeping_time(index);
  return ready_.now() < limit || is_needed;
}

// Called with the lock held, by a worker that others keep from dispatching, or leave nothing to.
// While they dispatch so fast that one more would only be in their way, and for a moment after the
// last dispatch, it watches them instead of sleeping, so nobody has to wake it for what they leave
// over. Where that may be left over for ever, it comes after some such looks all the same. Returns
// false if there was nobody to watch, or nothing has come for long.
bool DispatchingExecutor::stand_by() noexcept {
  constexpr Nanoseconds kFast(250);         // for each dispatch
  constexpr Nanoseconds kLook(1000);        // between two looks at slower ones
  constexpr Nanoseconds kPatience(20'000);  // what it costs to sleep and to be woken
  constexpr int kPauses = 16;               // a busy core's other hardware thread slows it down
  constexpr int kFastLooks = 10;            // where the scheduler may starve a callback
  if (!stands_by_ || idle_.load() + standing_by_.load() + 1 >= threads_.size()) return false;
  watched_closely_.fetch_add(1);
  standing_by_.fetch_add(1);
  is_left_over_.store(exception_ != nullptr || ready_.has_waiting());
  keep_time(place_);
  const TimePoint release = first_release();
  std::uint64_t before = dispatches_.load(std::memory_order_relaxed);
  unlock();
  const Clock& clock = options_.clock->real();
  TimePoint start = clock.now(), now = start, last = start;
  bool is_fast = false;
  int fast_looks = 0;
  for (;;) {
    const TimePoint look = later(start, is_fast ? kPatience : kLook);
    for (; now < look; now = clock.now()) {
      for (int i = 0; i < (is_fast ? kPauses : 1); ++i) spin_pause();
    }
    const std::uint64_t dispatches = dispatches_.load(std::memory_order_relaxed) - before;
    if (dispatches != 0) last = now;
    if (kFast * static_cast<std::int64_t>(dispatches) >= now - start) {
      if (!std::exchange(is_fast, true)) watched_closely_.fetch_sub(1);
      if (may_starve_ && ++fast_looks == kFastLooks) break;
    } else if (is_fast || is_left_over_.load(std::memory_order_relaxed) || has_announcements() ||
               now >= release || now - last >= kPatience) {
      break;
    }
    before += dispatches;
    start = now;
  }
  lock();
  if (!is_fast) watched_closely_.fetch_sub(1);
  standing_by_.fetch_sub(1);
  stop_keeping_time(place_);
  ready_.read_clock();
  return now - last < kPatience || ready_.has_waiting() || ready_.has_announcements();
}

}  // namespace takt
