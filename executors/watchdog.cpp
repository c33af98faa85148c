// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/watchdog.hpp"

#include <algorithm>
#include <mutex>

#include "takt/base/manual_clock.hpp"
#include "takt/entities/wait_in_callback.hpp"

namespace takt {

Watchdog::Watchdog(const ThreadAttributes& thread, Realtime realtime, Clock& clock)
    : clock_(clock), backend_(make_wait_backend(kAutoWait, clock, 1, false)) {
  backend_->prepare();
  thread_ = std::make_unique<RealtimeThread>(thread, realtime, [this] { run(); });
}

Watchdog::~Watchdog() {
  stopping_.store(true);
  backend_->post();
  // Under a manual clock, only this thread can let the watchdog's thread end.
  if (ManualClock* manual = clock_.as_manual()) {
    while (!has_ended_.load()) manual->settle();
  }
}

void Watchdog::add(Watched& watched) {
  {
    const std::lock_guard lock(mutex_);
    watched_.push_back(&watched);
  }
  backend_->post();
}

void Watchdog::remove(Watched& watched) noexcept {
  {
    const std::lock_guard lock(mutex_);
    std::erase(watched_, &watched);
  }
  const detail::WaitInCallback wait(&watched);
  wait.until([&] { return wait.is_for_itself() || calling_.load() != &watched; });
  // Ends the loop of report_misses: a handler that still runs is this executor's last.
  Watched* called = &watched;
  calling_.compare_exchange_strong(called, nullptr);
  backend_->post();  // the current round may have skipped another
}

// The handler may destroy what is watched, or wait for a thread that does.
TimePoint Watchdog::report_misses(Watched& watched) noexcept {
  std::optional<TimePoint> first;
  {
    const detail::Running running(&watched);
    while (calling_.load() == &watched && !first) first = watched.report_miss(clock_.now());
  }
  calling_.store(nullptr);
  detail::WaitInCallback::notify_progress();
  return first.value_or(kNever);
}

// A thread that expects a deadline stores it before it reads wakes_at_; this thread writes
// wakes_at_ and begins to count as asleep before it reads the deadlines. So one of the two sees the
// other.
void Watchdog::run() noexcept {
  while (!stopping_.load()) {
    wakes_at_.store(kNever);
    sleeper_.begin();
    TimePoint next = kNever;
    {
      std::unique_lock lock(mutex_);
      for (std::size_t i = 0; i < watched_.size(); ++i) {
        Watched* const watched = watched_[i];
        calling_.store(watched);
        lock.unlock();
        next = std::min(next, report_misses(*watched));
        lock.lock();
      }
    }
    wakes_at_.store(next);  // what was expected meanwhile has posted
    sleeper_.end(backend_->wait(0, next));
  }
  backend_->leave(0);
  has_ended_.store(true);
}

}  // namespace takt
