// The signals that end a run, and the guarantee that they end it in bounded time.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_END_SIGNALS_HPP_
#define TAKT_TOOLS_TAKT_END_SIGNALS_HPP_

#include <chrono>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

namespace takt::tools {

/// Receives the signals that end a run by a file descriptor: SIGINT, SIGTERM, and SIGHUP unless it
/// was ignored when this program started (nohup). SIGUSR1: an executor of this process failed.
class EndSignals {
 public:
  /// Blocks the signals. Construct it before any thread or process exists: all inherit the mask, so
  /// only this descriptor receives the signals.
  EndSignals();
  ~EndSignals();
  EndSignals(const EndSignals&) = delete;
  EndSignals& operator=(const EndSignals&) = delete;
  int fd() const noexcept { return fd_; }
  /// Takes and returns the pending signal; 0: none.
  int take() const;
  /// Restores the default effect of the signals, so that a second signal ends a process that hangs
  /// while it stops.
  void let_through() const;

 private:
  int fd_;
};

/// "SIGINT".
std::string name_of_signal(int signal);

/// Longest time that the end of a run waits for a component's constructor.
inline constexpr std::chrono::seconds kConstructorLimit(10);

/// Ends this process in bounded time even if a component's constructor does not return. It has a
/// thread only during the start and the end of the run.
///
/// Thread safety: `making` from any thread, all other functions from one.
class EndGuard {
 public:
  EndGuard();
  ~EndGuard();
  EndGuard(const EndGuard&) = delete;
  EndGuard& operator=(const EndGuard&) = delete;

  /// For ContainerOverrides::on_making.
  void making(std::string_view component);
  /// From now until has_begun(), a signal ends the process after kConstructorLimit; a second one
  /// ends it at once.
  void begins(const EndSignals& signals);
  /// The signal received since begins(); 0: none.
  int signal() const;
  int has_begun();
  /// From now on, constructors must return within kConstructorLimit. `signal`: why the run ends; 0:
  /// its duration is over.
  void ends(int signal);

 private:
  void start(const EndSignals* signals);
  void stop();
  void wake() const;
  void watch(const EndSignals* signals);
  [[noreturn]] void end_now(const std::string& component) const;

  const int woken_;
  mutable std::mutex mutex_;  // guards the next three
  std::string component_;     // the component whose constructor runs
  int signal_ = 0;
  bool is_over_ = false;
  std::thread thread_;
};

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_END_SIGNALS_HPP_
