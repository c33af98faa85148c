// SPDX-License-Identifier: Apache-2.0
#include "rclcpp/logging.hpp"

#include <chrono>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <map>
#include <mutex>
#include <utility>

#include <unistd.h>

#include "takt/base/ros_time.hpp"

#include "rclcpp/clock.hpp"
#include "rosout.hpp"

namespace rclcpp {
namespace detail {
namespace {

/// All loggers. Never destroyed: objects with static storage log, too.
struct Registry {
  std::mutex mutex;  // guards all below
  std::map<std::string, LoggerState> loggers;
  std::map<std::string, std::shared_ptr<RosoutPublisher>> rosout;
};
Registry& registry() {
  static auto* registry = new Registry;
  return *registry;
}

/// "a.b" → "a" → "" → false
bool to_parent(std::string& name) {
  if (name.empty()) return false;
  const auto dot = name.rfind('.');
  name.resize(dot == std::string::npos ? 0 : dot);
  return true;
}

int effective_level(const Registry& all, std::string name) {
  do {
    const auto found = all.loggers.find(name);
    const int own = found != all.loggers.end() ? found->second.own_level.load() : 0;
    if (own != 0) return own;
  } while (to_parent(name));
  return static_cast<int>(Logger::Level::Info);
}

bool is_set(const char* variable) {
  const char* value = std::getenv(variable);
  return value != nullptr && std::string_view(value) == "1";
}

const char* severity_name(int severity) {
  switch (severity) {
    case 10:
      return "DEBUG";
    case 20:
      return "INFO";
    case 30:
      return "WARN";
    case 40:
      return "ERROR";
    default:
      return "FATAL";
  }
}
const char* colour(int severity) {
  switch (severity) {
    case 10:
      return "\033[32m";
    case 20:
      return "\033[0m";
    case 30:
      return "\033[33m";
    default:
      return "\033[31m";
  }
}

struct Line {
  int severity;
  std::chrono::system_clock::time_point time;
  const LogLocation& where;
  const char* logger;
  const std::string& message;
};

std::string value_of(std::string_view token, const Line& line) {
  const auto ns = std::chrono::nanoseconds(line.time.time_since_epoch()).count();
  char text[32];
  if (token == "severity") return severity_name(line.severity);
  if (token == "name") return line.logger;
  if (token == "message") return line.message;
  if (token == "function_name") return line.where.function;
  if (token == "file_name") return line.where.file;
  if (token == "line_number") return std::to_string(line.where.line);
  if (token == "time_as_nanoseconds") return std::to_string(ns);
  if (token == "date_time_with_ms") {
    const std::time_t seconds = ns / 1'000'000'000;
    std::tm parts{};
    localtime_r(&seconds, &parts);
    const auto size = std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S", &parts);
    std::snprintf(text + size, sizeof text - size, ".%03d",
                  static_cast<int>(ns / 1'000'000 % 1000));
    return text;
  }
  if (token == "time") {
    std::snprintf(text, sizeof text, "%lld.%09lld", static_cast<long long>(ns / 1'000'000'000),
                  static_cast<long long>(ns % 1'000'000'000));
    return text;
  }
  return "{" + std::string(token) + "}";
}

/// Replaces escape sequences such as "\
/// " by the characters that they stand for.
std::string unescaped(std::string_view format) {
  constexpr std::string_view kLetters = "abnrt", kMeant = "\a\b\n\r\t";
  std::string text;
  for (std::size_t i = 0; i < format.size(); ++i) {
    const auto known = format[i] == '\\' && i + 1 < format.size() ? kLetters.find(format[i + 1])
                                                                  : std::string_view::npos;
    text += known != std::string_view::npos ? kMeant[known] : format[i];
    if (known != std::string_view::npos) ++i;
  }
  return text;
}

/// Where and how lines are printed, from RCUTILS_CONSOLE_OUTPUT_FORMAT and related variables.
struct Console {
  std::FILE* file = is_set("RCUTILS_LOGGING_USE_STDOUT") ? stdout : stderr;
  bool has_colours = std::getenv("RCUTILS_COLORIZED_OUTPUT") != nullptr
                         ? is_set("RCUTILS_COLORIZED_OUTPUT")
                         : isatty(fileno(file)) != 0;
  std::string format = [] {
    const char* wanted = std::getenv("RCUTILS_CONSOLE_OUTPUT_FORMAT");
    return unescaped(wanted != nullptr ? wanted : "[{severity}] [{time}] [{name}]: {message}");
  }();

  void write(const Line& line) const {
    std::string text = has_colours ? colour(line.severity) : "";
    for (std::string_view rest = format; !rest.empty();) {
      const auto open = rest.find('{');
      const auto close = open == std::string_view::npos ? open : rest.find('}', open);
      text += rest.substr(0, close == std::string_view::npos ? close : open);
      if (close == std::string_view::npos) break;
      text += value_of(rest.substr(open + 1, close - open - 1), line);
      rest.remove_prefix(close + 1);
    }
    text += has_colours ? "\033[0m\n" : "\n";
    std::fwrite(text.data(), 1, text.size(), file);
    if (file == stdout) std::fflush(file);
  }
};

std::shared_ptr<RosoutPublisher> rosout_of(std::string logger) {
  Registry& all = registry();
  const std::lock_guard lock(all.mutex);
  if (all.rosout.empty()) return nullptr;
  do {
    if (const auto found = all.rosout.find(logger); found != all.rosout.end()) {
      return found->second;
    }
  } while (to_parent(logger));
  return nullptr;
}

void publish(RosoutPublisher& publisher, const Line& line) {
  rcl_interfaces::msg::Log message;
  message.stamp = takt::detail::stamp_of<builtin_interfaces::msg::Time>(
      std::chrono::nanoseconds(line.time.time_since_epoch()));
  message.level = static_cast<std::uint8_t>(line.severity);
  message.name = line.logger;
  message.msg = line.message;
  message.file = line.where.file;
  message.function = line.where.function;
  message.line = line.where.line;
  publisher.publish(message);
}

std::string formatted(const char* format, std::va_list arguments) {
  std::va_list again;
  va_copy(again, arguments);
  const int size = std::vsnprintf(nullptr, 0, format, arguments);
  std::string text(size > 0 ? static_cast<std::size_t>(size) : 0, '\0');
  std::vsnprintf(text.data(), text.size() + 1, format, again);
  va_end(again);
  return text;
}

}  // namespace

LoggerState& logger_state(const std::string& name) {
  Registry& all = registry();
  const std::lock_guard lock(all.mutex);
  const auto [found, is_new] = all.loggers.try_emplace(name);
  if (is_new) {
    found->second.name = name;
    found->second.effective_level.store(effective_level(all, name));
  }
  return found->second;
}

LoggerState* known_logger(const std::string& name) {
  Registry& all = registry();
  const std::lock_guard lock(all.mutex);
  const auto found = all.loggers.find(name);
  return found != all.loggers.end() ? &found->second : nullptr;
}

void log(const Logger& logger, int severity, const LogLocation& where, const char* format, ...) {
  static const auto* console = new Console;
  std::va_list arguments;
  va_start(arguments, format);
  const std::string message = formatted(format, arguments);
  va_end(arguments);
  const Line line{severity, detail::system_now(), where, logger.get_name(), message};
  console->write(line);
  if (const auto publisher = rosout_of(logger.get_name())) publish(*publisher, line);
}

void add_rosout(const std::string& logger, std::shared_ptr<RosoutPublisher> publisher) {
  Registry& all = registry();
  const std::lock_guard lock(all.mutex);
  all.rosout[logger].swap(publisher);  // the old publisher is destroyed after the unlock
}
void remove_rosout(const std::string& logger) {
  std::shared_ptr<RosoutPublisher> gone;
  Registry& all = registry();
  const std::lock_guard lock(all.mutex);
  if (const auto found = all.rosout.find(logger); found != all.rosout.end()) {
    gone = std::move(found->second);
    all.rosout.erase(found);
  }
}

}  // namespace detail

void Logger::set_level(Level level) {
  detail::Registry& all = detail::registry();
  const std::lock_guard lock(all.mutex);
  state_->own_level.store(static_cast<int>(level));
  for (auto& [name, state] : all.loggers) {
    state.effective_level.store(detail::effective_level(all, name));
  }
}

std::filesystem::path get_log_directory() {
  if (const char* folder = std::getenv("ROS_LOG_DIR")) return folder;
  const char* home = std::getenv("ROS_HOME");
  const char* user = std::getenv("HOME");
  return (home != nullptr ? std::filesystem::path(home)
                          : std::filesystem::path(user != nullptr ? user : "") / ".ros") /
         "log";
}

}  // namespace rclcpp
