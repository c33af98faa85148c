// What ends a process of a command, and the guarantee that this takes bounded time.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_END_SIGNALS_HPP_
#define TAKT_TOOLS_TAKT_END_SIGNALS_HPP_

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace takt::tools {

/// Longest time of an end, from its cause to the last destructor: what has not returned then hangs.
inline constexpr std::chrono::seconds kEndLimit(20);
/// The same after a signal during the start, after a second signal, and after the death of the
/// parent; and of a command that only looks, after the first signal.
inline constexpr std::chrono::seconds kHurriedEndLimit(2);

/// Receives what ends a process of a command, and ends that when its time is over: SIGINT, SIGTERM,
/// and SIGHUP unless it was ignored when this program started (nohup); of a process that another
/// one controls, that one's death. SIGUSR1: an executor of this process failed. Two equal signals
/// within half a second count as one, see base/signal_echo.hpp.
///
/// 1. The thread `signals` receives them, so that one is never deaf: neither while this process
///    computes, nor while it waits for another, or for a pipe that nobody reads. A file of a system
///    gives it attributes by this name.
/// 2. It hands each on by a file descriptor, for loops that wait for something else, too; but not
///    while a run starts or ends, see EndGuard.
/// 3. One limit says when it ends the process, by the signal, and without destructors: 2 s after a
///    second signal, and of a command that only looks after the first one; kEndLimit after a first
///    one that nobody has taken; and what EndGuard adds.
/// 4. The destructor leaves the process to its signals again. A limit that a signal has set stays.
///
/// Thread safety: one thread calls. Real-time: its thread sleeps until a signal comes.
class EndSignals {
 public:
  enum class Command { runs, looks };
  /// Blocks the signals. Construct it before any thread or process exists: all inherit the mask, so
  /// only its thread receives them. `on_signal` is called there, for loops that look at a variable.
  explicit EndSignals(Command command = Command::runs, std::function<void()> on_signal = {});
  /// Of a process that its parent ends, through this socket.
  explicit EndSignals(int parent);
  /// Calls end().
  ~EndSignals();
  EndSignals(const EndSignals&) = delete;
  EndSignals& operator=(const EndSignals&) = delete;
  /// Readable when there is a signal to take.
  int fd() const noexcept;
  /// Takes and returns the pending signal; 0: none.
  int take() const;
  /// Calls it on the thread, and returns afterwards: so the thread gets its attributes. Throws what
  /// it throws.
  void run_in_thread(const std::function<void()>& function) const;
  /// From now on a signal ends this process at once.
  void end();
  /// In a process that was forked: signals are as in a new one.
  static void let_through();
  /// What makes the terminal usable again, for an end in the middle of everything: it may call only
  /// what a handler of a signal may. nullptr: nothing.
  static void set_last_act(void (*act)()) noexcept;

 private:
  friend class EndGuard;
  struct Watch;
  std::shared_ptr<Watch> watch_;
};

/// "SIGINT".
std::string name_of_signal(int signal);

/// A run, which ends in bounded time even if a component's constructor, callback or destructor does
/// not return: it tells EndSignals whether the run starts, runs or ends. While it starts or ends,
/// signals are not handed on.
///
/// Thread safety: `making` from any thread, all other functions from one.
class EndGuard {
 public:
  /// The run starts: until has_begun(), a signal, or the death of the parent, ends the process
  /// after kHurriedEndLimit, and a second one at once.
  explicit EndGuard(EndSignals& signals);
  ~EndGuard();
  EndGuard(const EndGuard&) = delete;
  EndGuard& operator=(const EndGuard&) = delete;

  /// For ContainerOverrides::on_making.
  void making(std::string_view component);
  /// The signal received since the start; 0: none.
  int signal() const;
  int has_begun();
  /// From now on, the end must be complete within kEndLimit, after a further signal or the death of
  /// the parent within kHurriedEndLimit, and after a signal each constructor within the latter.
  /// `signal`: why the run ends; 0: its duration is over.
  void ends(int signal);

 private:
  EndSignals::Watch& watch_;
};

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_END_SIGNALS_HPP_
