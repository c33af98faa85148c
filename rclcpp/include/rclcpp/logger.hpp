// Named loggers with levels.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__LOGGER_HPP_
#define RCLCPP__LOGGER_HPP_

#include <atomic>
#include <filesystem>
#include <memory>
#include <string>

namespace rclcpp {

namespace detail {
/// The name and levels of a logger. Never destroyed.
struct LoggerState {
  std::string name;
  std::atomic<int> own_level{0}, effective_level{20};
};
LoggerState& logger_state(const std::string& name);
/// nullptr: the program has no logger of this name.
LoggerState* known_logger(const std::string& name);
}  // namespace detail

/// Writes lines of its level and above. Logger "a.b" has the level of "a" unless it has a level of
/// its own. It may be used before init, and after shutdown.
/// Thread safety: every method from any thread. Real-time: is_enabled.
class Logger {
 public:
  enum class Level { Unset = 0, Debug = 10, Info = 20, Warn = 30, Error = 40, Fatal = 50 };

  Logger(const Logger&) = default;
  Logger& operator=(const Logger&) = default;
  ~Logger() {}  // NOLINT: not trivial, see Time

  const char* get_name() const { return state_->name.c_str(); }
  Logger get_child(const std::string& suffix) const {
    return Logger(
        detail::logger_state(state_->name.empty() ? suffix : state_->name + "." + suffix));
  }
  void set_level(Level level);
  Level get_effective_level() const { return static_cast<Level>(state_->effective_level.load()); }

  bool is_enabled(int severity) const noexcept {
    return severity >= state_->effective_level.load(std::memory_order_relaxed);
  }

 private:
  friend Logger get_logger(const std::string& name);
  explicit Logger(detail::LoggerState& state) : state_(&state) {}
  detail::LoggerState* state_;
};

inline Logger get_logger(const std::string& name) {
  return Logger(detail::logger_state(name));
}
std::filesystem::path get_log_directory();

}  // namespace rclcpp

#endif  // RCLCPP__LOGGER_HPP_
