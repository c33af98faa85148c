// Reports a missed deadline when it is missed, not when the callback returns.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_EXECUTORS_WATCHDOG_HPP_
#define TAKT_EXECUTORS_WATCHDOG_HPP_

#include <atomic>
#include <memory>
#include <optional>
#include <vector>

#include "takt/base/clock.hpp"
#include "takt/base/pi_mutex.hpp"
#include "takt/base/visibility.hpp"
#include "takt/executors/wait_backends/sleepers.hpp"
#include "takt/executors/wait_backends/wait_backend.hpp"
#include "takt/sched/threads/realtime_thread.hpp"

namespace TAKT_PUBLIC takt {

/// A thread that sleeps until the first deadline of all executors that use it, and calls the
/// handlers of callbacks that have not ended by then. It costs about one wake-up for each release
/// of a callback with a deadline. Give its thread more urgency than those that it watches.
/// Thread safety: every method from any thread, handlers included.
/// Real-time: expect() costs a load, and a wake-up when the deadline is the first. Handlers run on
/// the watchdog's thread, at the same time as the callback that is late.
class Watchdog {
 public:
  /// An executor, whose callbacks are watched.
  class Watched {
   public:
    /// Reports a deadline that has passed, if there is one, and returns nothing: the handler may
    /// have destroyed this object. Otherwise returns the next deadline.
    virtual std::optional<TimePoint> report_miss(TimePoint now) noexcept = 0;

   protected:
    ~Watched() = default;
  };

  /// Throws Error when the thread's attributes are refused and required.
  explicit Watchdog(const ThreadAttributes& thread, Realtime realtime = Realtime::prefer,
                    Clock& clock = Clock::steady());
  ~Watchdog();

  /// What its thread was granted.
  const ThreadState& state() const noexcept { return thread_->state(); }

  // For executors.

  void add(Watched& watched);
  /// When it returns, no handler of this executor runs, except one that has called it or waits for
  /// the thread that has (WaitInCallback).
  void remove(Watched& watched) noexcept;
  /// An execution must have ended by this time: wakes the watchdog up if it would sleep longer.
  void expect(TimePoint deadline) noexcept {
    if (deadline < wakes_at_.load()) sleeper_.wake([this] { backend_->post(); });
  }

 private:
  void run() noexcept;
  TimePoint report_misses(Watched& watched) noexcept;

  Clock& clock_;
  const std::unique_ptr<WaitBackend> backend_;
  detail::Sleepers sleeper_;  // the thread
  std::atomic<TimePoint> wakes_at_{kNever};
  std::atomic<bool> stopping_{false}, has_ended_{false};
  std::atomic<Watched*> calling_{nullptr};
  PiMutex mutex_;  // guards what follows; handlers run without it
  std::vector<Watched*> watched_;
  std::unique_ptr<RealtimeThread> thread_;
};

}  // namespace takt

#endif  // TAKT_EXECUTORS_WATCHDOG_HPP_
