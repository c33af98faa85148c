// Filters a parameter event by names of parameters and kinds of changes.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__PARAMETER_EVENTS_FILTER_HPP_
#define RCLCPP__PARAMETER_EVENTS_FILTER_HPP_

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "takt/messages/rcl_interfaces/msg/parameter_event.hpp"

#include "rclcpp/macros.hpp"

namespace rclcpp {

/// Keeps the event alive. New parameters come first, then changed ones, then deleted ones.
/// Thread safety: immutable. Real-time: no.
class ParameterEventsFilter {
 public:
  RCLCPP_SMART_PTR_DEFINITIONS(ParameterEventsFilter)
  enum class EventType { NEW, DELETED, CHANGED };
  using EventPair = std::pair<EventType, const rcl_interfaces::msg::Parameter*>;

  ParameterEventsFilter(std::shared_ptr<const rcl_interfaces::msg::ParameterEvent> event,
                        const std::vector<std::string>& names, const std::vector<EventType>& types)
      : event_(std::move(event)) {
    const auto add = [&](EventType type, const auto& parameters) {
      if (std::find(types.begin(), types.end(), type) == types.end()) return;
      for (const rcl_interfaces::msg::Parameter& one : parameters) {
        if (std::find(names.begin(), names.end(), one.name) != names.end()) {
          events_.emplace_back(type, &one);
        }
      }
    };
    add(EventType::NEW, event_->new_parameters);
    add(EventType::CHANGED, event_->changed_parameters);
    add(EventType::DELETED, event_->deleted_parameters);
  }
  const std::vector<EventPair>& get_events() const { return events_; }

 private:
  const std::shared_ptr<const rcl_interfaces::msg::ParameterEvent> event_;
  std::vector<EventPair> events_;
};

}  // namespace rclcpp

#endif  // RCLCPP__PARAMETER_EVENTS_FILTER_HPP_
