// A line on the terminal that lives while a command works, so that nobody takes it for dead.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_LIVE_LINE_HPP_
#define TAKT_TOOLS_TAKT_LIVE_LINE_HPP_

#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "takt/base/time.hpp"

namespace takt::tools {

/// What a command does that waits for discovery.
inline constexpr const char* kDiscovering = "looking for it on the DDS domain";

/// "12 s", "3 min", "2.5 h".
std::string rough(Nanoseconds time);

/// Says on stderr what the command does, and for how long, or how much time is left; nothing where
/// stderr is no terminal. It has a thread: what measures in this process uses Progress instead.
/// Thread safety: one thread calls.
/// Real-time: no.
class LiveLine {
 public:
  /// Appears after two seconds.
  explicit LiveLine(std::string what);
  /// Clears the line.
  ~LiveLine();
  LiveLine(const LiveLine&) = delete;
  LiveLine& operator=(const LiveLine&) = delete;

  /// At once: "3 of 24: WHAT, 40 s left". The time is that of the steps so far; at first, what runs
  /// of this duration take.
  void step(const std::string& what, std::size_t done, std::size_t total, Nanoseconds duration);
  /// Until the next step: others write on the terminal.
  void hide();

 private:
  void show() const;  // with the lock held
  void live(const std::stop_token& end);

  const TimePoint start_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::string what_;
  std::optional<TimePoint> end_;  // when it should be over
  bool is_due_ = false;           // to be shown before two seconds are over
  std::jthread thread_;           // only on a terminal
};

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_LIVE_LINE_HPP_
