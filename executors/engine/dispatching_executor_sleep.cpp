// How workers wait: how one searches, sleeps and is woken.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "takt/base/spin_pause.hpp"
#include "takt/executors/engine/dispatching_executor.hpp"

namespace takt {
namespace {

// What it costs to sleep and to be woken: for so long it is worth while to search.
constexpr Nanoseconds kPatience(20'000);
// For so long a searcher leaves what is announced to the worker whose callback has announced it, as
// that usually ends with it: a callback that moves to another CPU finds none of its data there.
constexpr Nanoseconds kMoment(1'000);

}  // namespace

// ---- What wakes a worker ----

// What has to wait for the group of the callback that announces needs no other worker: this one
// looks for it afterwards.
void DispatchingExecutor::announce(CallbackRecord& record, Arrival arrival) noexcept {
  if (ready_.announce(record, arrival) && let_ == nullptr &&
      (group_inside() != record.exclusion.get() || record.is_reentrant())) {
    notify(Search::asked);
  }
}

// The calling thread has written before what there is to do. Both kinds of worker look for it after
// they have said, sequentially consistent, what they do: a searcher that it searches no more, a
// sleeper that it is idle. So one of the two threads sees what the other has written. Without
// searcher and sleepers this costs three loads.
void DispatchingExecutor::notify(Search what) noexcept {
  for (Search state = search_.load(); state != Search::none;) {
    if (state == Search::called && what == Search::called) break;  // it has not come: preempted?
    if (state >= what || search_.compare_exchange_weak(state, what)) return;
  }
  if (claim_idle()) {
    backend_->post();
  } else if (Wakeable* observer = observer_.load()) {
    observer->wake();
  }
}

void DispatchingExecutor::wake_all() noexcept {
  wake();
  while (claim_idle()) backend_->post();
}

bool DispatchingExecutor::claim_idle() noexcept {
  std::size_t idle = idle_.load();
  while (idle != 0) {
    if (idle_.compare_exchange_weak(idle, idle - 1)) return true;
  }
  return false;
}

// Called with the lock held, when a worker is about to execute. Wakes another one if more may run
// at once, or if none waits for the first timer.
void DispatchingExecutor::pass_on() noexcept {
  if (!shared_ || (idle_.load() == 0 && search_.load() == Search::none)) return;
  if (ready_.next_release() < first_wait_ || ready_.has_another()) wake();
}

// ---- What a worker does that waits: all with the lock held before and after ----

// Until this time, kNever if for no release, the worker waits.
void DispatchingExecutor::set_wait(std::size_t index, TimePoint until) noexcept {
  waits_[index] = until;
  first_wait_ = *std::min_element(waits_.begin(), waits_.end());
}

// The release for which the worker has to wake up: the first one, if no other waits for that. When
// the other has woken up it may be busy for long, and should not have to wake this one before. So
// one more waits for what may come next.
TimePoint DispatchingExecutor::release_to_wait_for() const noexcept {
  const TimePoint first = first_release();
  if (first < first_wait_) return first;
  const auto waiting =
      std::count_if(waits_.begin(), waits_.end(), [](TimePoint wait) { return wait != kNever; });
  return waiting == 1 && is_parallel_ ? ready_.release_beside_first() : kNever;
}

// How long the worker searches before it sleeps. In a pool only one does, and only if no thread of
// the pool is more urgent: while it searches, nobody wakes that. It does even if not asked to, as
// long as others work, who would have to wake it for what they leave over.
Nanoseconds DispatchingExecutor::patience_of(std::size_t index) const noexcept {
  if (!may_search(index)) return Nanoseconds::zero();
  const TimePoint release = first_release();
  if (early_wake_ != Nanoseconds::zero() && release < first_wait_ &&
      release <= later(ready_.now(), early_wake_)) {
    return Nanoseconds::max();
  }
  return shared_ && idle_.load() + 1 < workers_ ? std::max(spin_, kPatience) : spin_;
}

// Looks for what a sleeper would be woken for, until that time, or until nobody has announced
// anything for so long. Returns true if there may be something to run.
bool DispatchingExecutor::search(std::size_t index, TimePoint until, Nanoseconds patience,
                                 const FutureState* future) noexcept {
  const Nanoseconds between_looks = shared_ ? kMoment : Nanoseconds::zero();
  const bool timers_were_held = ready_.timers_are_held();
  set_wait(index, until);
  if (shared_) search_.store(Search::quiet);
  unlock();
  const Clock& clock = *options_.clock;
  const TimePoint start = clock.now();
  TimePoint now = start, last = start;
  bool has_found = false;
  do {
    const TimePoint look = later(now, between_looks);
    do {
      spin_pause();
      now = clock.now();
    } while (now < look);
    Search asked = Search::asked;
    if (search_.load(std::memory_order_relaxed) == asked &&  // else it leaves the line to others
        search_.compare_exchange_strong(asked, Search::quiet)) {
      last = now;
    }
    has_found = must_look(future) || search_.load() == Search::called ||
                ready_.timers_are_held() != timers_were_held ||
                (watched_.load(std::memory_order_relaxed) != 0 && backend_->look());
  } while (!has_found && now < until && now - last < patience);
  lock();
  if (shared_ && search_.exchange(Search::none) != Search::quiet) has_found = true;
  set_wait(index, kNever);
  spin_times_[index] += now - start;
  ready_.read_clock();
  return has_found || now >= until;
}

// After `next` has found nothing. Returns true if the worker must look again, false at the limit.
bool DispatchingExecutor::wait(std::size_t index, TimePoint limit,
                               const FutureState* future) noexcept {
  has_just_run_ = false;
  const Nanoseconds patience = patience_of(index);
  if (patience != Nanoseconds::zero() &&
      search(index, std::min(limit, first_release()), patience, future)) {
    return ready_.now() < limit || must_look(future);
  }
  const TimePoint release = release_to_wait_for();
  TimePoint end = std::min(limit, release);
  if (end == release && end != kNever && may_search(index)) end -= early_wake_;
  if (end != kNever) wake_up_on_time();
  set_wait(index, release);
  idle_.fetch_add(1);
  const bool is_needed = must_look(future) || exception_ != nullptr;
  unlock();
  const bool was_woken = !is_needed && backend_->wait(index, end);
  // This worker still counts as idle, unless another thread is about to wake it: then it takes the
  // post.
  if (!was_woken && !claim_idle()) {
    while (!backend_->wait(index, kNever)) {
    }
  }
  lock();
  set_wait(index, kNever);
  ready_.read_clock();
  return is_needed || ready_.now() < limit;
}

}  // namespace takt
