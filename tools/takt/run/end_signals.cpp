// SPDX-License-Identifier: Apache-2.0
#include "run/end_signals.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <climits>
#include <csignal>
#include <exception>
#include <mutex>
#include <semaphore>
#include <string>
#include <thread>
#include <utility>

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
  enum class Phase { none, start, end };  // of a run

  Watch(Command of, int its_parent, std::function<void()> function)
      : command(of), parent(its_parent), on_signal(std::move(function)) {
    stop_events = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (stop_events < 0 || pipe2(handed_on.data(), O_CLOEXEC | O_NONBLOCK) != 0) fail();
    if (parent >= 0) return;  // it gets the signals
    sigset_t signals = end_signals();
    sigaddset(&signals, SIGUSR1);
    pthread_sigmask(SIG_BLOCK, &signals, nullptr);
    received = signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK);
    if (received < 0) fail();
  }
  ~Watch() {
    for (const int fd : {received, stop_events, handed_on[0], handed_on[1]}) {
      if (fd >= 0) close(fd);
    }
  }
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;
  [[noreturn]] static void fail() {
    throw Error("cannot wait for signals: " + errno_message(errno));
  }

  void begin(const std::shared_ptr<Watch>& own) {
    thread = std::thread([own] {
      pthread_setname_np(pthread_self(), "signals");
      while (own->look()) {
      }
    });
  }
  void wake() const { eventfd_write(stop_events, 1); }
  /// Does it on the thread.
  void order(std::function<void()> function) {
    {
      const std::lock_guard lock(mutex);
      ordered = std::move(function);
    }
    wake();
    is_done.acquire();
  }
  /// Stops the thread, unless a signal has set a limit to the rest of this process, too.
  void leave() {
    order([this] { is_stopped = true; });
    stays ? thread.detach() : thread.join();
  }

  // ---- The thread ----

  /// False: it is to stop.
  bool look() {
    TimePoint next = kNever;
    int parent_fd = -1;
    {
      const std::lock_guard lock(mutex);
      next = std::min(limit, bound_constructor());
      if (Clock::steady().now() >= next) next = time_is_over();
      // It has died when it neither sends nor receives any more.
      if (phase != Phase::none && !has_lost_parent) parent_fd = parent;
    }
    const Nanoseconds left = std::max(next - Clock::steady().now(), Nanoseconds::zero());
    const timespec time{left / std::chrono::seconds(1), (left % std::chrono::seconds(1)).count()};
    std::array<pollfd, 3> events{
        {{received, POLLIN, 0}, {stop_events, POLLIN, 0}, {parent_fd, 0, 0}}};
    ppoll(events.data(), events.size(), next == kNever ? nullptr : &time, nullptr);
    eventfd_t ignored = 0;
    eventfd_read(stop_events, &ignored);
    const std::lock_guard lock(mutex);
    if ((events[2].revents & POLLHUP) != 0) lose_parent();
    for (signalfd_siginfo each{}; received >= 0 && read(received, &each, sizeof each) > 0;) {
      take(static_cast<int>(each.ssi_signo));
    }
    if (const auto function = std::exchange(ordered, nullptr)) {
      function();
      stays = count > (command == Command::looks ? 0 : 1);
      is_done.release();
    }
    return !is_stopped || stays;
  }

  // All below with the lock held.

  void take(int came) {
    if (echo.is_echo(came) || (phase == Phase::end && came == SIGUSR1)) return;
    if (came != SIGUSR1) {
      last = came;
      ++count;
      const bool is_hurried = command == Command::looks || phase != Phase::none || count > 1;
      bound(is_hurried ? kHurriedEndLimit : kEndLimit);
      if (count > 2) bound(std::chrono::seconds(0));
    }
    if (phase == Phase::none) {
      ++untaken;
      [[maybe_unused]] const ssize_t written = ::write(handed_on[1], &came, sizeof came);
      if (on_signal) on_signal();
    } else if (phase == Phase::start && signal != 0) {
      end_now();  // it is the second
    } else {
      if (phase == Phase::start) {
        bound(kHurriedEndLimit);
        say_what_is_waited_for(name_of_signal(came), kHurriedEndLimit);
      }
      signal = came;
    }
  }
  void lose_parent() {
    has_lost_parent = true;
    bound(kHurriedEndLimit);
    say_what_is_waited_for("the process that controls this one has died", kHurriedEndLimit);
  }
  void bound(std::chrono::seconds most) {
    limit = std::min(limit, later(Clock::steady().now(), most));
  }
  /// A run that ends waits for a constructor that runs.
  TimePoint bound_constructor() {
    if (phase != Phase::end || component.empty()) {
      constructor_limit = kNever;
    } else if (constructor_limit == kNever) {
      const auto most = signal != 0 ? kHurriedEndLimit : kEndLimit;
      constructor_limit = later(Clock::steady().now(), most);
      say_what_is_waited_for(signal != 0 ? name_of_signal(signal) : "the run is over", most);
    }
    return constructor_limit;
  }
  /// Does not return, or returns the next limit.
  TimePoint time_is_over() {
    const bool is_taken = untaken.load() == 0;
    if (phase == Phase::none && command == Command::runs && count < 2 && is_taken) {
      return limit = kNever;  // the end of a run has a bound of its own
    }
    end_now();
  }
  void enter(Phase next) {
    phase = next;
    // A second signal stays in force until the process has ended.
    if (phase == Phase::none && count < 2) limit = kNever;
    if (phase == Phase::end) bound(kEndLimit);
  }
  std::string unfinished() const {
    if (!component.empty()) return fmt::format("the constructor of component '{}'", component);
    return phase == Phase::start ? "the set-up of the run" : "a callback or a destructor";
  }
  void say_what_is_waited_for(const std::string& why, std::chrono::seconds most) const {
    say(fmt::format("takt: {}; waiting for {}, {} s at most\n", why, unfinished(), most.count()));
  }
  [[noreturn]] void end_now() const {
    say(phase == Phase::none
            ? fmt::format("takt: {} did not end this in time; ending without destructors\n",
                          name_of_signal(last))
            : fmt::format("takt: {} did not return; ending the process without destructors\n",
                          unfinished()));
    end_by(phase == Phase::none ? last : signal);
  }

  const Command command;
  const int parent;
  const std::function<void()> on_signal;
  int received = -1, stop_events = -1;
  std::array<int, 2> handed_on{-1, -1};
  std::atomic<int> untaken{0};
  std::binary_semaphore is_done{0};
  std::thread thread;
  mutable std::mutex mutex;  // guards all below
  std::function<void()> ordered;
  bool is_stopped = false, stays = false, has_lost_parent = false;
  Phase phase = Phase::none;
  TimePoint limit = kNever, constructor_limit = kNever;
  std::string component;  // whose constructor runs
  int count = 0, last = 0;
  int signal = 0;  // that came while the run started or ended, or has ended it
};

EndSignals::EndSignals(Command command, std::function<void()> on_signal)
    : watch_(std::make_shared<Watch>(command, -1, std::move(on_signal))) {
  watch_->begin(watch_);
}

EndSignals::EndSignals(int parent)
    : watch_(std::make_shared<Watch>(Command::runs, parent, nullptr)) {
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

void EndSignals::run_in_thread(const std::function<void()>& function) const {
  std::exception_ptr thrown;
  watch_->order([&] {
    try {
      function();
    } catch (...) {
      thrown = std::current_exception();
    }
  });
  if (thrown) std::rethrow_exception(thrown);
}

void EndSignals::end() {
  if (!watch_->thread.joinable()) return;
  watch_->leave();
  if (watch_->parent < 0) let_through();
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

EndGuard::EndGuard(EndSignals& signals) : watch_(*signals.watch_) {
  const std::lock_guard lock(watch_.mutex);
  watch_.enter(EndSignals::Watch::Phase::start);
  watch_.wake();
}

EndGuard::~EndGuard() {
  const std::lock_guard lock(watch_.mutex);
  watch_.enter(EndSignals::Watch::Phase::none);
  watch_.wake();
}

void EndGuard::making(std::string_view component) {
  const std::lock_guard lock(watch_.mutex);
  watch_.component = component;
  if (watch_.phase == EndSignals::Watch::Phase::end) watch_.wake();
}

int EndGuard::signal() const {
  const std::lock_guard lock(watch_.mutex);
  return watch_.signal;
}

int EndGuard::has_begun() {
  const std::lock_guard lock(watch_.mutex);
  watch_.enter(EndSignals::Watch::Phase::none);
  watch_.wake();
  return watch_.signal;
}

void EndGuard::ends(int signal) {
  const std::lock_guard lock(watch_.mutex);
  watch_.signal = signal;
  watch_.enter(EndSignals::Watch::Phase::end);
  watch_.wake();
}

}  // namespace takt::tools
