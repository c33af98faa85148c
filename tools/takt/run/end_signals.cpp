// SPDX-License-Identifier: Apache-2.0
#include "run/end_signals.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <climits>
#include <csignal>
#include <semaphore>
#include <string>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include "takt/base/clock.hpp"
#include "takt/base/error.hpp"
#include "takt/base/printable.hpp"
#include "takt/base/signal_echo.hpp"

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

/// Unless nobody reads stderr, for which an end does not wait.
void say(const std::string& text) {
  pollfd event{STDERR_FILENO, POLLOUT, 0};
  const std::string line = printable(text, Lines::keep).substr(0, PIPE_BUF);
  if (poll(&event, 1, 0) != 1 || (event.revents & POLLOUT) == 0) return;
  [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, line.data(), line.size());
}

void end_unless_echo(int signal) {
  if (!echo.is_echo(signal)) detail::end_by_signal(signal);
}

std::atomic<void (*)()> last_act{nullptr};

/// By the signal itself, so that the parent process sees it.
[[noreturn]] void end_by(int signal) {
  if (const auto act = last_act.load()) act();
  const sigset_t signals = end_signals();
  if (signal != 0 && sigismember(&signals, signal) == 1) {
    std::signal(signal, SIG_DFL);
    pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
    raise(signal);
  }
  _exit(1);
}

}  // namespace

std::string name_of_signal(int signal) {
  return fmt::format("SIG{}", sigabbrev_np(signal));
}

struct EndSignals::Watch {
  explicit Watch(Command of) : command(of) {
    sigset_t signals = end_signals();
    sigaddset(&signals, SIGUSR1);
    pthread_sigmask(SIG_BLOCK, &signals, nullptr);
    received = signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK);
    stop = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (received < 0 || stop < 0 || pipe2(handed_on.data(), O_CLOEXEC | O_NONBLOCK) != 0) {
      throw Error("cannot create a signalfd: " + errno_message(errno));
    }
  }
  ~Watch() {
    for (const int fd : {received, stop, handed_on[0], handed_on[1]}) close(fd);
  }
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  void begin(const std::shared_ptr<Watch>& own) {
    thread = std::thread([own] {
      pthread_setname_np(pthread_self(), "signals");
      while (own->look()) {
      }
    });
  }

  /// Stops the thread, unless a signal has set a limit to the rest of this process, too.
  void leave() {
    eventfd_write(stop, 1);
    is_stopped.acquire();
    stays ? thread.detach() : thread.join();
  }

  /// False: it is to stop.
  bool look() {
    const TimePoint now = Clock::steady().now();
    if (now >= limit) {
      const bool is_taken = untaken.load() == 0;
      if (command == Command::looks || count > 1 || !is_taken) {
        say(fmt::format("takt: {} did not end this in time; ending without destructors\n",
                        name_of_signal(last)));
        end_by(last);
      }
      limit = kNever;  // its own bounds count
    }
    const Nanoseconds left = limit - now;
    const timespec time{left / std::chrono::seconds(1), (left % std::chrono::seconds(1)).count()};
    std::array<pollfd, 2> events{{{received, POLLIN, 0}, {stop, POLLIN, 0}}};
    ppoll(events.data(), events.size(), limit == kNever ? nullptr : &time, nullptr);
    for (signalfd_siginfo signal{}; read(received, &signal, sizeof signal) > 0;) {
      take(static_cast<int>(signal.ssi_signo));
    }
    if (eventfd_t asked = 0; eventfd_read(stop, &asked) == 0) {
      stays = count > (command == Command::looks ? 0 : 1);
      is_stopped.release();
      return stays;
    }
    return true;
  }

  void take(int signal) {
    if (echo.is_echo(signal)) return;
    if (signal != SIGUSR1) {
      last = signal;
      ++count;
      const bool is_hurried = command == Command::looks || count > 1;
      const TimePoint now = Clock::steady().now();
      limit =
          count > 2 ? now : std::min(limit, later(now, is_hurried ? kHurriedEndLimit : kEndLimit));
    }
    ++untaken;
    [[maybe_unused]] const ssize_t written = ::write(handed_on[1], &signal, sizeof signal);
  }

  const Command command;
  int received = -1, stop = -1;
  std::array<int, 2> handed_on{-1, -1};
  std::atomic<int> untaken{0};
  std::binary_semaphore is_stopped{0};
  bool stays = false;
  // The thread's.
  TimePoint limit = kNever;
  int count = 0, last = 0;
  std::thread thread;
};

EndSignals::EndSignals(Command command) : watch_(std::make_shared<Watch>(command)) {
  watch_->begin(watch_);
}

EndSignals::~EndSignals() {
  end();
}

int EndSignals::fd() const noexcept {
  return watch_->handed_on[0];
}

int EndSignals::take() const {
  int signal = 0;
  if (read(fd(), &signal, sizeof signal) != sizeof signal) return 0;
  --watch_->untaken;
  return signal;
}

void EndSignals::end() {
  if (!watch_->thread.joinable()) return;
  watch_->leave();
  let_through();
}

void EndSignals::let_through() {
  for (const int signal : kEndSignals) {
    if (!is_ignored(signal)) std::signal(signal, end_unless_echo);
  }
  const sigset_t signals = end_signals();
  pthread_sigmask(SIG_UNBLOCK, &signals, nullptr);
}

void EndSignals::set_last_act(void (*act)()) noexcept {
  last_act.store(act);
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
        say(fmt::format("takt: {}; waiting for {}, {} s at most\n",
                        has_lost_parent_ ? "the process that controls this one has died"
                        : signal_ != 0   ? name_of_signal(signal_)
                                         : "the run is over",
                        unfinished(), most.count()));
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
    if (signals_ != nullptr) signals_fd = signals_->fd();
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
  if (signal == 0 || (phase_ == Phase::end && signal == SIGUSR1)) return;
  if (phase_ == Phase::end) {
    end_limit_ = std::min(end_limit_, later(Clock::steady().now(), kHurriedEndLimit));
    signal_ = signal;
  } else if (signal_ != 0) {
    end_now();  // it is the second
  } else {
    signal_ = signal;
  }
}

// With the lock held.
std::string EndGuard::unfinished() const {
  if (!component_.empty()) return fmt::format("the constructor of component '{}'", component_);
  return phase_ == Phase::start ? "the set-up of the run" : "a callback or a destructor";
}

void EndGuard::end_now() const {
  say(fmt::format("takt: {} did not return; ending the process without destructors\n",
                  unfinished()));
  end_by(signal_);
}

}  // namespace takt::tools
