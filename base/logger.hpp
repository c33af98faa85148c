// The logger: any thread may log, also in callbacks; a separate thread writes the lines.
// SPDX-License-Identifier: Apache-2.0
#ifndef TAKT_BASE_LOGGER_HPP_
#define TAKT_BASE_LOGGER_HPP_

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>

#include <fmt/core.h>

#include "takt/base/visibility.hpp"

namespace TAKT_PUBLIC takt {

namespace detail {
template <class T>
class NeverDestroyed;
}

enum class LogLevel { debug, info, warn, error };

/// A place in a program: std::source_location, which clang 14 (Debian 12) lacks.
struct SourceLocation {
  const char* file = "";
  const char* function = "";
  std::uint32_t line = 0;

  static constexpr SourceLocation current(const char* file = __builtin_FILE(),
                                          const char* function = __builtin_FUNCTION(),
                                          std::uint32_t line = __builtin_LINE()) {
    return {file, function, line};
  }
};

/// A format, with the place in a program where it is written.
template <class... Arguments>
struct LogFormat {
  template <class Text>
  consteval LogFormat(const Text& text,  // NOLINT(google-explicit-constructor)
                      SourceLocation here = SourceLocation::current())
      : format(text), where(here) {}

  fmt::format_string<Arguments...> format;
  SourceLocation where;
};

/// A log line with its source and time.
struct LogLine {
  LogLevel level;
  std::chrono::system_clock::time_point time;
  std::string_view source;  // a node's full name, or empty
  std::string_view text;
  SourceLocation where;  // of the call
};

/// A bounded logger: a line is formatted and handed, by a queue of fixed capacity, to the thread
/// `log`, which writes to stderr. When the queue is full the line is dropped and counted, and
/// the count is written as soon as there is room. The thread starts with the first line, or before
/// the first callback of an executor, with the default attributes of a thread (SCHED_OTHER, all
/// CPUs), and sleeps on a futex while there is nothing to write. It ends with the process, when
/// static objects are destroyed; those destroyed later write their lines themselves.
///
/// Thread safety: every method may be called from any thread.
/// Real-time: `log` neither blocks nor allocates, except for the first line of a process in which
/// no executor has spun, and for arguments whose formatting allocates.
/// A line has no control characters: line breaks and others are escaped when it is written.
class Logger {
 public:
  static constexpr std::size_t kRecords = 256;
  static constexpr std::size_t kLineBytes = 240;  // longer lines are cut

  static Logger& instance();

  /// Starts the writing thread, unless it runs already.
  void start();
  /// Calls `function` in the writing thread, which starts if it has not yet, and returns
  /// afterwards: so the container gives the thread its attributes. Throws what it throws.
  void run_in_thread(const std::function<void()>& function);

  template <class... Arguments>
  void log(LogLevel level, const std::type_identity_t<LogFormat<Arguments...>>& format,
           Arguments&&... arguments) {
    if (level < this->level()) return;
    write({}, level, format.where, format.format, fmt::make_format_args(arguments...));
  }
  /// A line of whatever level: "source: text" if there is a source.
  void write(std::string_view source, LogLevel level, const SourceLocation& where,
             fmt::string_view format, fmt::format_args arguments);

  LogLevel level() const noexcept { return level_.load(std::memory_order_relaxed); }
  void set_level(LogLevel level) noexcept { level_.store(level, std::memory_order_relaxed); }
  std::uint64_t dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }
  /// Returns when everything that was logged before the call is written.
  void flush();
  /// Called with every line, on the writing thread, after it was written. Empty: none. When this
  /// returns, the previous listener is not called any more.
  void set_listener(std::function<void(const LogLine&)> listener);
  /// Redirects later lines from stderr to a function, on the writing thread; empty: back.
  void set_writer(std::function<void(LogLevel, std::string_view)> writer);

 private:
  struct Record {
    LogLevel level;
    std::chrono::system_clock::time_point time;
    SourceLocation where;
    std::size_t size, source_size = 0;
    char text[kLineBytes];
  };
  struct Output;  // the queue and the thread

  friend class detail::NeverDestroyed<Logger>;
  struct EndOfProcess;

  Logger();
  void stop();
  bool take_room() noexcept;
  void hand_over(LogLevel level, Record& record) noexcept;
  void write_line(const Record& record);
  void write_until_stopped();
  void write_what_waits();

  const std::unique_ptr<Output> output_;
  std::function<void(LogLevel, std::string_view)> writer_;
  std::function<void(const LogLine&)> listener_;  // the thread's
  std::atomic<LogLevel> level_{LogLevel::info};
  std::atomic<std::uint64_t> dropped_{0};
  std::atomic<std::uint64_t> handed_over_{0}, written_{0};
  // Places of the queue, from before formatting to after writing.
  std::atomic<std::size_t> taken_{0};
  std::atomic<std::uint32_t> work_{0};  // changes with every line: what the thread sleeps on
  std::atomic<const std::function<void()>*> function_{nullptr};  // to call in the thread
  std::uint64_t dropped_reported_ = 0;                           // the thread's
  std::mutex starting_;
  std::atomic<bool> started_{false}, stopping_{false}, stopped_{false};
};

/// Limits repeated log lines to one per second, or to `most`.
/// Thread safety: from any thread.
/// Real-time: neither blocks nor allocates.
class LogThrottle {
 public:
  constexpr explicit LogThrottle(std::uint64_t most = 1) noexcept : most_(most) {}
  /// If the line may be logged now, returns the number of suppressed lines since the last one;
  /// otherwise nullopt.
  std::optional<std::uint64_t> may_log() noexcept;

 private:
  const std::uint64_t most_;
  std::atomic<std::int64_t> last_ns_{INT64_MIN / 2};  // the begin of the present second
  std::atomic<std::uint64_t> count_{0};               // of lines in it
  std::atomic<std::uint64_t> left_out_{0};
};

template <class... Arguments>
void log(LogLevel level, const std::type_identity_t<LogFormat<Arguments...>>& format,
         Arguments&&... arguments) {
  Logger::instance().log(level, format, std::forward<Arguments>(arguments)...);
}

}  // namespace takt

#endif  // TAKT_BASE_LOGGER_HPP_
