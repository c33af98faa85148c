// The signals that end a run, and the guarantee that they end it in bounded time.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_END_SIGNALS_HPP_
#define TAKT_TOOLS_TAKT_END_SIGNALS_HPP_

#include <chrono>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

#include "takt/base/time.hpp"

namespace takt::tools {

/// Receives the signals that end a run by a file descriptor: SIGINT, SIGTERM, and SIGHUP unless it
/// was ignored when this program started (nohup). SIGUSR1: an executor of this process failed. Two
/// equal signals within half a second count as one, see base/signal_echo.hpp.
class EndSignals {
 public:
  /// Blocks the signals. Construct it before any thread or process exists: all inherit the mask, so
  /// only this descriptor receives the signals.
  EndSignals();
  /// Calls let_through().
  ~EndSignals();
  EndSignals(const EndSignals&) = delete;
  EndSignals& operator=(const EndSignals&) = delete;
  int fd() const noexcept { return fd_; }
  /// Takes and returns the pending signal; 0: none.
  int take() const;
  /// From now on a signal ends this process at once, so that a second signal ends a process that
  /// hangs while it stops.
  void let_through() const;

 private:
  int fd_;
};

/// "SIGINT".
std::string name_of_signal(int signal);

/// Longest time of an end, from its cause to the last destructor: what has not returned then hangs.
inline constexpr std::chrono::seconds kEndLimit(20);
/// The same after a signal during the start, after a second signal, and after the death of the
/// parent.
inline constexpr std::chrono::seconds kHurriedEndLimit(2);

/// Ends this process in bounded time even if a component's constructor, callback or destructor does
/// not return. It has a thread only during the start and the end of the run.
///
/// Thread safety: `making` from any thread, all other functions from one.
class EndGuard {
 public:
  /// Of a process that signals end; the guard takes them while the run starts.
  explicit EndGuard(const EndSignals& signals);
  /// Of a process that its parent ends, through this socket. When the parent has died, it ends
  /// within kHurriedEndLimit.
  explicit EndGuard(int parent);
  ~EndGuard();
  EndGuard(const EndGuard&) = delete;
  EndGuard& operator=(const EndGuard&) = delete;

  /// For ContainerOverrides::on_making.
  void making(std::string_view component);
  /// From now until has_begun(), a signal ends the process after kHurriedEndLimit; a second one
  /// ends it at once.
  void begins();
  /// The signal received since begins(); 0: none.
  int signal() const;
  int has_begun();
  /// From now on, the end must be complete within kEndLimit, and after a signal each constructor
  /// within kHurriedEndLimit. `signal`: why the run ends; 0: its duration is over.
  void ends(int signal);

 private:
  enum class Phase { none, start, end };
  explicit EndGuard(const EndSignals* signals, int parent);
  void start(Phase phase);
  void stop();
  void wake() const;
  void watch();
  void wait(Nanoseconds most);
  std::string unfinished() const;
  [[noreturn]] void end_now() const;

  const EndSignals* const signals_;
  const int parent_;
  const int woken_;
  mutable std::mutex mutex_;  // guards all below but the thread
  Phase phase_ = Phase::none;
  TimePoint end_limit_ = kNever;
  std::string component_;  // the component whose constructor runs
  int signal_ = 0;
  bool has_lost_parent_ = false, is_hurried_ = false;
  std::thread thread_;
};

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_END_SIGNALS_HPP_
