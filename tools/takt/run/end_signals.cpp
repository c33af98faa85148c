// SPDX-License-Identifier: Apache-2.0
#include "run/end_signals.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>

#include <fmt/format.h>
#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include "takt/base/clock.hpp"
#include "takt/base/error.hpp"
#include "takt/base/logger.hpp"
#include "takt/base/signal_echo.hpp"
#include "takt/measuring/output.hpp"

namespace takt::tools {
namespace {

constexpr std::array kEndSignals{SIGINT, SIGTERM, SIGHUP};
detail::SignalEcho echo;

bool is_ignored(int signal) {
  struct sigaction action {};
  sigaction(signal, nullptr, &action);
  return signal == SIGHUP && action.sa_handler == SIG_IGN;
}

sigset_t end_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : kEndSignals) {
    if (!is_ignored(signal)) sigaddset(&signals, signal);
  }
  return signals;
}

void end_unless_echo(int signal) {
  if (!echo.is_echo(signal)) detail::end_by_signal(signal);
}

}  // namespace

std::string name_of_signal(int signal) {
  return fmt::format("SIG{}", sigabbrev_np(signal));
}

EndSignals::EndSignals() {
  sigset_t signals = end_signals();
  sigaddset(&signals, SIGUSR1);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  fd_ = signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK);
  if (fd_ < 0) throw Error("cannot create a signalfd: " + errno_message(errno));
}

EndSignals::~EndSignals() {
  let_through();
  close(fd_);
}

int EndSignals::take() const {
  signalfd_siginfo signal{};
  while (read(fd_, &signal, sizeof signal) > 0) {
    const auto number = static_cast<int>(signal.ssi_signo);
    if (!echo.is_echo(number)) return number;
  }
  return 0;
}

void EndSignals::let_through() const {
  for (const int signal : kEndSignals) {
    if (!is_ignored(signal)) std::signal(signal, end_unless_echo);
  }
  const sigset_t signals = end_signals();
  pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
}

EndGuard::EndGuard(const EndSignals& signals) : EndGuard(&signals, -1) {
}

EndGuard::EndGuard(int parent) : EndGuard(nullptr, parent) {
}

EndGuard::EndGuard(const EndSignals* signals, int parent)
    : signals_(signals), parent_(parent), woken_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (woken_ < 0) throw Error("cannot create an eventfd: " + errno_message(errno));
}

EndGuard::~EndGuard() {
  stop();
  close(woken_);
}

void EndGuard::making(std::string_view component) {
  {
    const std::lock_guard lock(mutex_);
    component_ = component;
  }
  wake();
}

void EndGuard::wake() const {
  eventfd_write(woken_, 1);
}

void EndGuard::begins() {
  start(Phase::start);
}

int EndGuard::signal() const {
  const std::lock_guard lock(mutex_);
  return signal_;
}

int EndGuard::has_begun() {
  stop();
  return signal();
}

void EndGuard::ends(int signal) {
  {
    const std::lock_guard lock(mutex_);
    signal_ = signal;
    end_limit_ = std::min(end_limit_, later(Clock::steady().now(), kEndLimit));
  }
  start(Phase::end);
}

void EndGuard::start(Phase phase) {
  {
    const std::lock_guard lock(mutex_);
    phase_ = phase;
  }
  wake();
  if (!thread_.joinable()) thread_ = std::thread([this] { watch(); });
}

void EndGuard::stop() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    phase_ = Phase::none;
  }
  wake();
  thread_.join();
}

void EndGuard::watch() {
  TimePoint hurried_limit = kNever;
  for (;;) {
    TimePoint limit = kNever;
    const TimePoint now = Clock::steady().now();
    {
      const std::lock_guard lock(mutex_);
      if (phase_ == Phase::none) return;
      const bool hurries = signal_ != 0 || has_lost_parent_;
      // The run ends without a signal: wait only for constructors.
      if (!has_lost_parent_ && (phase_ == Phase::start ? !hurries : component_.empty())) {
        hurried_limit = kNever;
      } else if (hurried_limit == kNever) {
        const std::chrono::seconds most = hurries ? kHurriedEndLimit : kEndLimit;
        hurried_limit = later(now, most);
        rt::to_stderr("takt: {}; waiting for {}, {} s at most\n",
                      has_lost_parent_ ? "the process that controls this one has died"
                      : signal_ != 0   ? name_of_signal(signal_)
                                       : "the run is over",
                      unfinished(), most.count());
      }
      limit = std::min(end_limit_, hurried_limit);
      if (now >= limit) end_now();
    }
    wait(limit - now);
  }
}

// Until there is something new, at most this long.
void EndGuard::wait(Nanoseconds most) {
  int signals_fd = -1, parent_fd = -1;
  {
    const std::lock_guard lock(mutex_);
    if (signals_ != nullptr && phase_ == Phase::start) signals_fd = signals_->fd();
    if (!has_lost_parent_) parent_fd = parent_;
  }
  // The parent has died when it neither sends nor receives any more.
  std::array<pollfd, 3> events{{{woken_, POLLIN, 0}, {signals_fd, POLLIN, 0}, {parent_fd, 0, 0}}};
  const timespec time{most / std::chrono::seconds(1), (most % std::chrono::seconds(1)).count()};
  ppoll(events.data(), events.size(), &time, nullptr);
  eventfd_t ignored = 0;
  eventfd_read(woken_, &ignored);
  const std::lock_guard lock(mutex_);
  if ((events[2].revents & POLLHUP) != 0) has_lost_parent_ = true;
  const int signal = events[1].revents != 0 ? signals_->take() : 0;
  if (signal == 0) return;
  if (signal_ != 0) end_now();  // it is the second
  signal_ = signal;
}

// With the lock held.
std::string EndGuard::unfinished() const {
  if (!component_.empty()) return fmt::format("the constructor of component '{}'", component_);
  return phase_ == Phase::start ? "the set-up of the run" : "a callback or a destructor";
}

// End by the signal itself, so that the parent process sees it.
void EndGuard::end_now() const {
  rt::to_stderr("takt: {} did not return; ending the process without destructors\n", unfinished());
  Logger::instance().flush();
  const sigset_t signals = end_signals();
  if (signal_ != 0 && sigismember(&signals, signal_) == 1) {
    std::signal(signal_, SIG_DFL);
    pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
    raise(signal_);
  }
  _exit(1);
}

}  // namespace takt::tools
