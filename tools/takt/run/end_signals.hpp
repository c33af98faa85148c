// The signals that end a run, and the guarantee that they end it in bounded time.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_END_SIGNALS_HPP_
#define TAKT_TOOLS_TAKT_END_SIGNALS_HPP_

#include <chrono>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

#include "takt/base/time.hpp"

namespace takt::tools {

/// Longest time of an end, from its cause to the last destructor: what has not returned then hangs.
inline constexpr std::chrono::seconds kEndLimit(20);
/// The same after a signal during the start, after a second signal, and after the death of the
/// parent; and of a command that only looks, after the first signal.
inline constexpr std::chrono::seconds kHurriedEndLimit(2);

/// Receives the signals that end a command: SIGINT, SIGTERM, and SIGHUP unless it was ignored when
/// this program started (nohup). SIGUSR1: an executor of this process failed. Two equal signals
/// within half a second count as one, see base/signal_echo.hpp.
///
/// 1. A thread receives them, so that one is never deaf: neither while this process computes, nor
///    while it waits for another, or for a pipe that nobody reads.
/// 2. It hands each on by a file descriptor, for loops that wait for something else, too.
/// 3. It ends the process, by the signal, if that has not ended when its time is over: 2 s after a
///    second signal, and of a command that only looks after the first one. A command that runs
///    something has bounds of its own as soon as it has taken the signal (EndGuard, Supervisor),
///    for which it has kEndLimit.
/// 4. The destructor leaves the process to its signals again. A limit that a signal has set stays.
///
/// Thread safety: one thread calls. Real-time: its thread sleeps until a signal comes.
class EndSignals {
 public:
  enum class Command { runs, looks };
  /// Blocks the signals. Construct it before any thread or process exists: all inherit the mask, so
  /// only its thread receives them.
  explicit EndSignals(Command command = Command::runs);
  /// Calls end().
  ~EndSignals();
  EndSignals(const EndSignals&) = delete;
  EndSignals& operator=(const EndSignals&) = delete;
  /// Readable when there is a signal to take.
  int fd() const noexcept;
  /// Takes and returns the pending signal; 0: none.
  int take() const;
  /// From now on a signal ends this process at once.
  void end();
  /// In a process that was forked: signals are as in a new one.
  static void let_through();
  /// What makes the terminal usable again, for an end in the middle of everything: it may call only
  /// what a handler of a signal may. nullptr: nothing.
  static void set_last_act(void (*act)()) noexcept;

 private:
  struct Watch;
  std::shared_ptr<Watch> watch_;
};

/// "SIGINT".
std::string name_of_signal(int signal);

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
  /// From now on, the end must be complete within kEndLimit, after a further signal within
  /// kHurriedEndLimit, and after a signal each constructor within the latter. `signal`: why the run
  /// ends; 0: its duration is over.
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
