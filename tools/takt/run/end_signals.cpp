// SPDX-License-Identifier: Apache-2.0
#include "run/end_signals.hpp"

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
#include "takt/measuring/output.hpp"

namespace takt::tools {
namespace {

sigset_t end_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGINT, SIGTERM}) sigaddset(&signals, signal);
  struct sigaction hang_up {};
  sigaction(SIGHUP, nullptr, &hang_up);
  if (hang_up.sa_handler != SIG_IGN) sigaddset(&signals, SIGHUP);
  return signals;
}

std::string constructor_of(const std::string& component) {
  return component.empty() ? "the set-up of the run"
                           : fmt::format("the constructor of component '{}'", component);
}

}  // namespace

std::string name_of_signal(int signal) {
  return fmt::format("SIG{}", sigabbrev_np(signal));
}

EndSignals::EndSignals() {
  sigset_t signals = end_signals();
  sigaddset(&signals, SIGUSR1);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  fd_ = signalfd(-1, &signals, SFD_CLOEXEC);
  if (fd_ < 0) throw Error("cannot create a signalfd: " + errno_message(errno));
}

EndSignals::~EndSignals() {
  close(fd_);
}

int EndSignals::take() const {
  signalfd_siginfo signal{};
  pollfd events{fd_, POLLIN, 0};
  const bool has_come = poll(&events, 1, 0) == 1 && read(fd_, &signal, sizeof signal) > 0;
  return has_come ? static_cast<int>(signal.ssi_signo) : 0;
}

void EndSignals::let_through() const {
  while (take() != 0) {
  }
  const sigset_t signals = end_signals();
  pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
}

EndGuard::EndGuard() : woken_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
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

void EndGuard::begins(const EndSignals& signals) {
  start(&signals);
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
  signal_ = signal;
  start(nullptr);
}

void EndGuard::start(const EndSignals* signals) {
  if (thread_.joinable()) return;
  is_over_ = false;
  thread_ = std::thread([this, signals] { watch(signals); });
}

void EndGuard::stop() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    is_over_ = true;
  }
  wake();
  thread_.join();
}

// The run ends without a signal: wait only for constructors.
void EndGuard::watch(const EndSignals* signals) {
  TimePoint limit = kNever;
  for (;;) {
    std::string component;
    bool waits = false;
    {
      const std::lock_guard lock(mutex_);
      if (is_over_) return;
      component = component_;
      waits = signals != nullptr ? signal_ != 0 : !component_.empty();
    }
    const TimePoint now = Clock::steady().now();
    if (!waits) {
      limit = kNever;
    } else if (limit == kNever) {
      limit = later(now, kConstructorLimit);
      rt::to_stderr("takt: {}; waiting for {}, {} s at most\n",
                    signal_ != 0 ? name_of_signal(signal_) : "the run is over",
                    constructor_of(component), kConstructorLimit.count());
    } else if (now >= limit) {
      end_now(component);
    }
    std::array<pollfd, 2> events{
        {{woken_, POLLIN, 0}, {signals != nullptr ? signals->fd() : -1, POLLIN, 0}}};
    const Nanoseconds rest = limit == kNever ? Nanoseconds::zero() : limit - now;
    const timespec time{rest / std::chrono::seconds(1), (rest % std::chrono::seconds(1)).count()};
    ppoll(events.data(), events.size(), limit == kNever ? nullptr : &time, nullptr);
    eventfd_t ignored = 0;
    eventfd_read(woken_, &ignored);
    if (const int signal = signals != nullptr ? signals->take() : 0; signal != 0) {
      if (limit != kNever) end_now(component);
      const std::lock_guard lock(mutex_);
      signal_ = signal;
    }
  }
}

// End by the signal itself, so that the parent process sees it.
void EndGuard::end_now(const std::string& component) const {
  rt::to_stderr("takt: {} did not return; ending the process without destructors\n",
                constructor_of(component));
  Logger::instance().flush();
  if (signal_ == SIGINT || signal_ == SIGTERM || signal_ == SIGHUP) {
    const sigset_t signals = end_signals();
    pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
    ::signal(signal_, SIG_DFL);
    raise(signal_);
  }
  _exit(1);
}

}  // namespace takt::tools
