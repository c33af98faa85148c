// Whether a signal is the one before, sent twice.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_SIGNAL_ECHO_HPP_
#define TAKT_BASE_SIGNAL_ECHO_HPP_

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>

namespace takt::detail {

/// `timeout -s INT`, and a launcher that a Ctrl-C reaches, too, send a signal to a process's group
/// and to the process: within a millisecond it comes twice. Two equal signals within half a second
/// count as one.
/// Thread safety: from any thread, and from handlers of signals.
class SignalEcho {
 public:
  /// Whether the signal before was the same, less than half a second ago.
  bool is_echo(int number) noexcept {
    using std::chrono::milliseconds;
    const auto now = std::chrono::steady_clock::now().time_since_epoch();
    const std::int64_t coming = now / milliseconds(1) * kNumbers + number;
    std::int64_t before = last_.load();
    do {
      if (before % kNumbers == number &&
          coming / kNumbers - before / kNumbers < kWindow / milliseconds(1)) {
        return true;
      }
    } while (!last_.compare_exchange_weak(before, coming));
    return false;
  }
  /// The next signal counts.
  void forget() noexcept { last_.store(0); }

 private:
  static constexpr std::chrono::milliseconds kWindow{500};
  static constexpr std::int64_t kNumbers = 128;
  static_assert(std::atomic<std::int64_t>::is_always_lock_free);
  std::atomic<std::int64_t> last_{0};  // time in ms, and number
};

/// In a handler of this signal: ends the process as the signal does that nobody handles.
inline void end_by_signal(int number) noexcept {
  std::signal(number, SIG_DFL);
  raise(number);  // is pending until the handler returns
}

}  // namespace takt::detail

#endif  // TAKT_BASE_SIGNAL_ECHO_HPP_
