// Shows the progress of a run.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_PROGRESS_HPP_
#define TAKT_TOOLS_TAKT_PROGRESS_HPP_

#include <algorithm>
#include <chrono>
#include <ctime>

#include <fmt/format.h>
#include <unistd.h>

#include "takt/base/clock.hpp"
#include "takt/measuring/output.hpp"

#include "run/live_line.hpp"
#include "run/service_manager.hpp"

namespace takt::tools {

inline timespec to_timespec(Nanoseconds time) {
  using namespace std::chrono_literals;
  time = std::max(time, Nanoseconds::zero());
  return {time / 1s, (time % 1s).count()};
}

/// Prints the elapsed time of a run, and what is left of it, if stderr is a terminal, and reports
/// to a service manager. A duration of zero: it has no end of its own.
class Progress {
 public:
  explicit Progress(Nanoseconds duration)
      : duration_(duration),
        is_shown_(isatty(STDERR_FILENO) != 0 &&
                  (duration == Nanoseconds::zero() || duration > std::chrono::seconds(2))) {}
  ~Progress() {
    if (is_shown_) rt::clear_line();
  }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  TimePoint end() const {
    return duration_ == Nanoseconds::zero() ? kNever : later(start_, duration_);
  }
  /// Prints the progress; returns the time until the next call.
  Nanoseconds show(TimePoint now) {
    Nanoseconds step = end() == kNever ? std::chrono::hours(24) : end() - now;
    step = std::min(step, service_manager_.go_on(now));
    if (is_shown_) {
      const std::string so_far = rough(now - start_);
      rt::show_line(end() == kNever ? fmt::format("running, {}; Ctrl-C ends it", so_far)
                                    : fmt::format("{} of {}, {} left", so_far, rough(duration_),
                                                  rough(end() - now)));
      step = std::min<Nanoseconds>(step, std::chrono::seconds(1));
    }
    return step;
  }

 private:
  const Nanoseconds duration_;
  const TimePoint start_ = Clock::steady().now();
  const bool is_shown_;
  ServiceManager service_manager_;
};

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_PROGRESS_HPP_
