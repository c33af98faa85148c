// SPDX-License-Identifier: Apache-2.0
#include "takt/executors/spin.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <mutex>
#include <vector>

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "takt/base/signal_echo.hpp"
#include "takt/sched/threads/realtime_thread.hpp"

namespace takt {
namespace {

constexpr int kSignals[] = {SIGINT, SIGTERM};
// Never closed, because a signal handler may still be running.
std::atomic<int> signalled_fd{-1};
std::atomic<bool> is_signalled{false};
detail::SignalEcho echo;

// It may interrupt any thread in any state, so it calls only what is async-signal-safe: it wakes
// the thread that cancels. The next signal ends the process.
void on_signal(int number) {
  if (echo.is_echo(number)) return;
  if (is_signalled.exchange(true)) return detail::end_by_signal(number);
  const int error = errno;
  const eventfd_t one = 1;
  [[maybe_unused]] const ssize_t written = write(signalled_fd.load(), &one, sizeof one);
  errno = error;
}

/// From the first CancelOnSignals to the last: the handlers, and the thread that cancels.
class SignalThread {
 public:
  SignalThread()
      : fd_(open()), thread_({.name = "takt_signals"}, Realtime::off, [this] { run(); }) {
    is_signalled.store(false);
    echo.forget();
    struct sigaction action {};
    action.sa_handler = on_signal;
    action.sa_flags = SA_RESTART;
    for (std::size_t i = 0; i < std::size(kSignals); ++i) {
      sigaction(kSignals[i], &action, &before_[i]);
    }
  }
  ~SignalThread() {
    for (std::size_t i = 0; i < std::size(kSignals); ++i) {
      // The echo of the signal that has ended the spin must not end what follows it.
      if (is_signalled.load() && before_[i].sa_handler == SIG_DFL) continue;
      sigaction(kSignals[i], &before_[i], nullptr);
    }
    ends_.store(true);
    eventfd_write(fd_, 1);
    thread_.join();
    eventfd_t count = 0;
    eventfd_read(fd_, &count);  // left over, if a signal's event has ended the thread
  }
  SignalThread(const SignalThread&) = delete;
  SignalThread& operator=(const SignalThread&) = delete;

  void add(Executor& executor) {
    const std::lock_guard lock(mutex_);
    executors_.push_back(&executor);
  }
  /// True when that was the last one.
  bool remove(Executor& executor) {
    const std::lock_guard lock(mutex_);
    executors_.erase(std::find(executors_.begin(), executors_.end(), &executor));
    return executors_.empty();
  }

 private:
  static int open() {
    if (signalled_fd.load() < 0) signalled_fd.store(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
    if (signalled_fd.load() < 0) {
      throw Error("signals cannot be waited for: " + errno_message(errno),
                  "let the process open more files (ulimit -n)");
    }
    return signalled_fd.load();
  }
  void run() {
    pollfd waited{.fd = fd_, .events = POLLIN, .revents = 0};
    while (!ends_.load()) {
      eventfd_t count = 0;
      if (poll(&waited, 1, -1) < 0 || eventfd_read(fd_, &count) != 0 || ends_.load()) continue;
      const std::lock_guard lock(mutex_);
      for (Executor* executor : executors_) executor->cancel();
    }
  }

  const int fd_;
  std::atomic<bool> ends_{false};
  std::mutex mutex_;  // guards executors_
  std::vector<Executor*> executors_;
  struct sigaction before_[std::size(kSignals)]{};
  RealtimeThread thread_;  // the last, because it uses the others
};

std::mutex signal_thread_mutex;
std::unique_ptr<SignalThread> signal_thread;  // guarded by the mutex above

}  // namespace

CancelOnSignals::CancelOnSignals(Executor& executor) : executor_(executor) {
  const std::lock_guard lock(signal_thread_mutex);
  if (signal_thread == nullptr) signal_thread = std::make_unique<SignalThread>();
  signal_thread->add(executor_);
}

CancelOnSignals::~CancelOnSignals() {
  const std::lock_guard lock(signal_thread_mutex);
  if (signal_thread->remove(executor_)) signal_thread.reset();
}

void spin(const std::shared_ptr<Node>& node) {
  const auto executor = executors().make("single_threaded", {});
  executor->add_node(node);
  const CancelOnSignals signals(*executor);
  executor->spin();
}

}  // namespace takt
