// SPDX-License-Identifier: Apache-2.0
#include "takt/ros2/rosout.hpp"

#include <algorithm>

namespace takt {
namespace {

std::string logger_name(std::string_view node) {
  std::string name(node.substr(std::min<std::size_t>(node.size(), 1)));
  std::replace(name.begin(), name.end(), '/', '.');
  return name;
}

std::uint8_t level_of(LogLevel level) {
  using rcl_interfaces::msg::Log;
  constexpr std::uint8_t kLevels[] = {Log::DEBUG, Log::INFO, Log::WARN, Log::ERROR};
  return kLevels[static_cast<int>(level)];
}

}  // namespace

Rosout::Rosout(Node& host)
    : host_(logger_name(host.fully_qualified_name())),
      publisher_(host.create_publisher<rcl_interfaces::msg::Log>(
          "/rosout", qos_profile("rosout")->keep_last(100))) {
  Logger::instance().set_listener([this](const LogLine& line) { publish(line); });
}

Rosout::~Rosout() {
  Logger::instance().set_listener({});
}

void Rosout::publish(const LogLine& line) const {
  publisher_->publish(rcl_interfaces::msg::Log()
                          .set__stamp(Time(line.time))
                          .set__level(level_of(line.level))
                          .set__name(line.source.empty() ? host_ : logger_name(line.source))
                          .set__msg(std::string(line.text))
                          .set__file(line.where.file)
                          .set__function(line.where.function)
                          .set__line(line.where.line));
}

}  // namespace takt
