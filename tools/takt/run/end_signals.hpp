// The signals that end a run, and the promise that they do.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_TOOLS_TAKT_END_SIGNALS_HPP_
#define TAKT_TOOLS_TAKT_END_SIGNALS_HPP_

#include <chrono>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

namespace takt::tools {

/// The signals that end a run, as a file descriptor: SIGINT, SIGTERM, and SIGHUP unless it was
/// ignored when this program started (nohup). SIGUSR1: one of our executors has failed.
class EndSignals {
 public:
  /// Blocks them. Before any thread or process exists, so that this descriptor alone takes them.
  EndSignals();
  ~EndSignals();
  EndSignals(const EndSignals&) = delete;
  EndSignals& operator=(const EndSignals&) = delete;
  int fd() const noexcept { return fd_; }
  /// The one that has come; 0: none. It is taken.
  int take() const;
  /// From here on another one has its usual effect: who stops and does not come to an end is ended.
  void let_through() const;

 private:
  int fd_;
};

/// "SIGINT".
std::string name_of_signal(int signal);

/// A component's constructor that has not returned so long after the end of the run was asked for
/// does not hold it up any more.
inline constexpr std::chrono::seconds kConstructorLimit(10);

/// Ends this process in bounded time although a component's constructor does not return. It has a
/// thread while the run begins and while it ends, and none between.
///
/// Thread safety: `making` from any thread, the rest for one.
class EndGuard {
 public:
  EndGuard();
  ~EndGuard();
  EndGuard(const EndGuard&) = delete;
  EndGuard& operator=(const EndGuard&) = delete;

  /// For ContainerOverrides::on_making.
  void making(std::string_view component);
  /// From here until `has_begun`, a signal ends the process when kConstructorLimit is over, and a
  /// second one at once.
  void begins(const EndSignals& signals);
  /// The signal that has come since `begins`; 0: none.
  int signal() const;
  int has_begun();
  /// From here on every constructor has kConstructorLimit. `signal`: why the run ends; 0: its time
  /// is up.
  void ends(int signal);

 private:
  void start(const EndSignals* signals);
  void stop();
  void wake() const;
  void watch(const EndSignals* signals);
  [[noreturn]] void end_now(const std::string& component) const;

  const int woken_;
  mutable std::mutex mutex_;  // guards the next three
  std::string component_;     // whose constructor runs
  int signal_ = 0;
  bool is_over_ = false;
  std::thread thread_;
};

}  // namespace takt::tools

#endif  // TAKT_TOOLS_TAKT_END_SIGNALS_HPP_
