// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <string>
#include <utility>

#include "takt/messages/entries.hpp"
#include "takt/messages/rcl_interfaces/srv/get_logger_levels.hpp"
#include "takt/messages/rcl_interfaces/srv/set_logger_levels.hpp"

#include "arguments.hpp"
#include "rclcpp/node_interfaces/node_logging_interface.hpp"
#include "rosout.hpp"

namespace rclcpp::node_interfaces {
namespace {

using rcl_interfaces::srv::GetLoggerLevels;
using rcl_interfaces::srv::SetLoggerLevels;

/// "/front/camera" → "front.camera"
std::string logger_name(const takt::Node& node) {
  std::string name = node.fully_qualified_name().substr(1);
  std::replace(name.begin(), name.end(), '/', '.');
  return name;
}

// Unknown loggers are refused: otherwise requests of other processes could fill the memory.

void get_levels(const GetLoggerLevels::Request& request, GetLoggerLevels::Response& response) {
  if (!takt::why_too_long(request).empty()) return;
  for (const std::string& name : request.names) {
    const detail::LoggerState* logger = detail::known_logger(name);
    response.levels.emplace_back();
    response.levels.back().name = name;
    response.levels.back().level =
        static_cast<std::uint32_t>(logger != nullptr ? logger->own_level.load() : 0);
  }
}
void set_levels(const SetLoggerLevels::Request& request, SetLoggerLevels::Response& response) {
  if (std::string why = takt::why_too_long(request); !why.empty()) {
    response.results.emplace_back();
    response.results.back().reason = std::move(why);
    return;
  }
  for (const auto& asked : request.levels) {
    response.results.emplace_back();
    auto& result = response.results.back();
    result.successful = detail::known_logger(asked.name) != nullptr && asked.level % 10 == 0 &&
                        asked.level <= static_cast<std::uint32_t>(Logger::Level::Fatal);
    if (result.successful) {
      rclcpp::get_logger(asked.name).set_level(static_cast<Logger::Level>(asked.level));
    } else {
      result.reason = "no logger has this name, or there is no such level";
    }
  }
}

}  // namespace

NodeLoggingInterface::NodeLoggingInterface(NodeBaseInterface& node)
    : logger_(rclcpp::get_logger(logger_name(*node.takt_node()))),
      has_rosout_(node.options().enable_rosout() && node.get_context()->arguments().rosout) {
  if (node.options().enable_logger_service()) {
    const std::string path = node.takt_node()->fully_qualified_name();
    get_levels_ =
        node.takt_node()->create_service<GetLoggerLevels>(path + "/get_logger_levels", get_levels);
    set_levels_ =
        node.takt_node()->create_service<SetLoggerLevels>(path + "/set_logger_levels", set_levels);
  }
  if (!has_rosout_) return;
  detail::add_rosout(logger_.get_name(),
                     node.takt_node()->create_publisher<rcl_interfaces::msg::Log>(
                         "/rosout", node.options().rosout_qos().to_takt(false)));
}
NodeLoggingInterface::~NodeLoggingInterface() {
  if (has_rosout_) detail::remove_rosout(logger_.get_name());
}

}  // namespace rclcpp::node_interfaces
