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
  constexpr std::uint8_t kLevels[] = {10, 20, 30, 40};  // rcl_interfaces/msg/Log
  return kLevels[static_cast<int>(level)];
}

}  // namespace

Rosout::Rosout(Node& host)
    : host_(logger_name(host.fully_qualified_name())),
      publisher_(host.create_publisher<rcl_interfaces::Log>(
          "/rosout", qos_profile("rosout")->keep_last(100))) {
  Logger::instance().set_listener([this](const LogLine& line) { publish(line); });
}

Rosout::~Rosout() {
  Logger::instance().set_listener({});
}

void Rosout::publish(const LogLine& line) const {
  publisher_->publish(
      rcl_interfaces::Log{.stamp = wire_time(line.time),
                          .level = level_of(line.level),
                          .name = line.source.empty() ? host_ : logger_name(line.source),
                          .msg = std::string(line.text)});
}

}  // namespace takt
