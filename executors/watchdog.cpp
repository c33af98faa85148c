// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/watchdog.hpp"

#include <algorithm>
#include <mutex>

#include "takt/base/manual_clock.hpp"

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
  std::unique_lock lock(mutex_);
  std::erase(watched_, &watched);
  if (std::this_thread::get_id() == thread_id_) {
    if (calling_ == &watched) calling_ = nullptr;
  } else {
    called_.wait(lock, [&] { return calling_ != &watched; });
  }
  lock.unlock();
  backend_->post();  // the current round may have skipped another
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
      thread_id_ = std::this_thread::get_id();
      for (std::size_t i = 0; i < watched_.size(); ++i) {
        Watched* const watched = calling_ = watched_[i];
        lock.unlock();
        std::optional<TimePoint> first;
        while (calling_ == watched && !first) first = watched->report_miss(clock_.now());
        next = std::min(next, first.value_or(kNever));
        lock.lock();
        calling_ = nullptr;
        called_.notify_all();
      }
    }
    wakes_at_.store(next);  // what was expected meanwhile has posted
    sleeper_.end(backend_->wait(0, next));
  }
  backend_->leave(0);
  has_ended_.store(true);
}

}  // namespace takt
