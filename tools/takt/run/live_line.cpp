// SPDX-License-Identifier: Apache-2.0
#include "run/live_line.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <unistd.h>

#include "takt/base/clock.hpp"
#include "takt/measuring/output.hpp"

namespace takt::tools {
namespace {

using namespace std::chrono_literals;

constexpr Nanoseconds kSilence = 2s;
constexpr Nanoseconds kStart = 1s;  // what a run takes besides its duration

}  // namespace

std::string rough(Nanoseconds time) {
  const double seconds = std::chrono::duration<double>(std::max(time, 0ns)).count();
  return seconds < 100    ? fmt::format("{:.0f} s", seconds)
         : seconds < 6000 ? fmt::format("{:.0f} min", seconds / 60)
                          : fmt::format("{:.1f} h", seconds / 3600);
}

LiveLine::LiveLine(std::string what) : start_(Clock::steady().now()), what_(std::move(what)) {
  if (isatty(STDERR_FILENO) == 0) return;
  thread_ = std::jthread([this](const std::stop_token& end) { live(end); });
}

LiveLine::~LiveLine() {
  if (!thread_.joinable()) return;
  thread_.request_stop();
  thread_.join();
  rt::clear_line();
}

void LiveLine::step(const std::string& what, std::size_t done, std::size_t total,
                    Nanoseconds duration) {
  const TimePoint now = Clock::steady().now();
  const Nanoseconds each =
      done == 0 ? duration + kStart : (now - start_) / static_cast<std::int64_t>(done);
  const std::lock_guard lock(mutex_);
  what_ = fmt::format("{} of {}: {}", done + 1, total, what);
  end_ = later(now, each * static_cast<std::int64_t>(total - done));
  is_due_ = true;
  changed_.notify_one();
}

void LiveLine::hide() {
  const std::lock_guard lock(mutex_);
  what_.clear();
  if (thread_.joinable()) rt::clear_line();
}

void LiveLine::show() const {
  if (what_.empty()) return;
  const TimePoint now = Clock::steady().now();
  rt::show_line(end_ ? fmt::format("{}, {} left", what_, rough(*end_ - now))
                     : fmt::format("{}, {}", what_, rough(now - start_)));
}

void LiveLine::live(const std::stop_token& end) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, end, kSilence, [this] { return is_due_; });
  while (!end.stop_requested()) {
    is_due_ = false;
    show();
    changed_.wait_for(lock, end, 1s, [this] { return is_due_; });
  }
}

}  // namespace takt::tools
