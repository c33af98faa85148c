// What rclcpp has and Takt's layer has not. A program may include it, and does not compile where it
// uses it.
// SPDX-License-Identifier: Apache-2.0
#ifndef RCLCPP__DETAIL__REFUSED_NAMES_HPP_
#define RCLCPP__DETAIL__REFUSED_NAMES_HPP_

#include "rclcpp/detail/refused.hpp"

namespace rclcpp {
RCLCPP_REFUSED_CLASS_(Event, "graph events")
RCLCPP_REFUSED_CLASS_(GenericClient, "generic clients")
RCLCPP_REFUSED_CLASS_(ParameterService, "parameter services of their own")
RCLCPP_REFUSED_CLASS_(ParameterMap, "maps of parameters")
RCLCPP_REFUSED_CLASS_(Waitable, "waitables")
RCLCPP_REFUSED_(create_generic_client, "generic clients")
RCLCPP_REFUSED_(parameter_map_from, "maps of parameters")
RCLCPP_REFUSED_(parameter_map_from_yaml_file, "maps of parameters")
RCLCPP_REFUSED_(parameter_value_from, "maps of parameters")
RCLCPP_REFUSED_(parameters_from_map, "maps of parameters")
RCLCPP_REFUSED_(get_typesupport_library, "type support that is loaded by name")
RCLCPP_REFUSED_(get_typesupport_handle, "type support that is loaded by name")
RCLCPP_REFUSED_(get_message_typesupport_handle, "type support that is loaded by name")
RCLCPP_REFUSED_(get_service_typesupport_handle, "type support that is loaded by name")
}  // namespace rclcpp

namespace rclcpp::experimental::buffers {
RCLCPP_REFUSED_CLASS_(IntraProcessBufferBase, "rclcpp's buffers inside a process")
template <class Message, class...>
class IntraProcessBuffer {
  RCLCPP_REFUSED_FOR_("rclcpp's buffers inside a process", Message);
};
}  // namespace rclcpp::experimental::buffers

namespace rclcpp::strategies::message_pool_memory_strategy {
template <class Message, auto...>
class MessagePoolMemoryStrategy {
  RCLCPP_REFUSED_FOR_("memory strategies", Message);
};
}  // namespace rclcpp::strategies::message_pool_memory_strategy

namespace rclcpp_components {
RCLCPP_REFUSED_CLASS_(ComponentManager, "component managers")
}  // namespace rclcpp_components

#endif  // RCLCPP__DETAIL__REFUSED_NAMES_HPP_
