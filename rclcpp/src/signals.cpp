// SPDX-License-Identifier: Apache-2.0
#include "signals.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <system_error>
#include <thread>
#include <utility>

#include <sys/eventfd.h>
#include <unistd.h>

#include "takt/base/error.hpp"
#include "takt/base/logger.hpp"
#include "takt/base/same_owner.hpp"

#include "rclcpp/utilities.hpp"

// A signal shuts down in these steps:
// 1. The handler, which may interrupt any thread in any state, writes to an event file, and calls
//    the handler that was there before.
// 2. A thread that waits for the file shuts down every context; their callbacks run on it.
namespace rclcpp {
namespace {

constexpr int kSignals[] = {SIGINT, SIGTERM};

struct Handled {
  std::mutex mutex;  // guards all below but `fd` and `before`
  SignalHandlerOptions installed = SignalHandlerOptions::None;
  std::vector<std::weak_ptr<Context>> contexts;
  bool has_thread = false;

  std::atomic<int> fd{-1};
  std::array<struct sigaction, std::size(kSignals)> before{};  // valid while our handler is set
};
/// Never destroyed: a signal may come while the process exits.
Handled& handled() {
  static auto* handled = new Handled;
  return *handled;
}

void on_signal(int number, siginfo_t* info, void* context) {
  const int error = errno;
  Handled& all = handled();
  const eventfd_t one = 1;
  [[maybe_unused]] const ssize_t written = write(all.fd.load(), &one, sizeof one);
  const struct sigaction& before = all.before[number == SIGINT ? 0 : 1];
  if ((before.sa_flags & SA_SIGINFO) != 0) {
    if (before.sa_sigaction != nullptr) before.sa_sigaction(number, info, context);
  } else if (before.sa_handler != SIG_DFL && before.sa_handler != SIG_IGN) {
    before.sa_handler(number);
  }
  errno = error;
}

void shut_down_when_signalled() {
  Handled& all = handled();
  for (;;) {
    eventfd_t count = 0;
    if (eventfd_read(all.fd.load(), &count) != 0) continue;
    std::vector<std::shared_ptr<Context>> contexts;
    {
      const std::lock_guard lock(all.mutex);
      for (const auto& context : all.contexts) contexts.push_back(context.lock());
    }
    for (const auto& context : contexts) {
      if (context == nullptr || !context->get_init_options().shutdown_on_signal) continue;
      try {
        context->shutdown("signal handler");
      } catch (...) {
        takt::log(takt::LogLevel::error, "a shutdown callback threw: {}",
                  takt::text_of(std::current_exception()));
      }
    }
  }
}

// With the mutex held.
void start_thread(Handled& all) {
  if (std::exchange(all.has_thread, true)) return;
  all.fd.store(eventfd(0, EFD_CLOEXEC));
  if (all.fd.load() < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
  sigset_t every, before;
  sigfillset(&every);
  pthread_sigmask(SIG_SETMASK, &every, &before);  // inherited: signals interrupt other threads
  std::thread(shut_down_when_signalled).detach();
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

bool is_among(SignalHandlerOptions options, int number) {
  return options == SignalHandlerOptions::All ||
         options ==
             (number == SIGINT ? SignalHandlerOptions::SigInt : SignalHandlerOptions::SigTerm);
}

}  // namespace

namespace detail {

void shut_down_on_signal(Context& context) {
  Handled& all = handled();
  const std::lock_guard lock(all.mutex);
  all.contexts.push_back(context.weak_from_this());
}
void forget_on_signal(Context& context) {
  Handled& all = handled();
  const std::lock_guard lock(all.mutex);
  std::erase_if(all.contexts, [gone = context.weak_from_this()](const auto& known) {
    return known.expired() || takt::is_same_owner(known, gone);
  });
}

}  // namespace detail

bool install_signal_handlers(SignalHandlerOptions signals) {
  Handled& all = handled();
  const std::lock_guard lock(all.mutex);
  if (all.installed != SignalHandlerOptions::None || signals == SignalHandlerOptions::None) {
    return false;
  }
  start_thread(all);
  struct sigaction action {};
  action.sa_sigaction = on_signal;
  action.sa_flags = SA_RESTART | SA_SIGINFO;
  for (std::size_t i = 0; i < std::size(kSignals); ++i) {
    if (!is_among(signals, kSignals[i])) continue;
    sigaction(kSignals[i], nullptr, &all.before[i]);  // set first: our handler reads it
    sigaction(kSignals[i], &action, nullptr);
  }
  all.installed = signals;
  return true;
}
bool signal_handlers_installed() {
  return get_current_signal_handler_options() != SignalHandlerOptions::None;
}
SignalHandlerOptions get_current_signal_handler_options() {
  Handled& all = handled();
  const std::lock_guard lock(all.mutex);
  return all.installed;
}
bool uninstall_signal_handlers() {
  Handled& all = handled();
  const std::lock_guard lock(all.mutex);
  if (all.installed == SignalHandlerOptions::None) return false;
  for (std::size_t i = 0; i < std::size(kSignals); ++i) {
    if (is_among(all.installed, kSignals[i])) sigaction(kSignals[i], &all.before[i], nullptr);
  }
  all.installed = SignalHandlerOptions::None;
  return true;
}

}  // namespace rclcpp
