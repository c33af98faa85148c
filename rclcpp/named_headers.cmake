# Headers that have only another name for another header: made when the build is configured, as rclcpp has a
# header for each of its names.
# SPDX-License-Identifier: Apache-2.0

# A header, and the names that programs also include for what is in it.
set(takt_named_headers
    "ament_index_cpp/get_resource.hpp ament_index_cpp/get_resources.hpp ament_index_cpp/has_resource.hpp"
    "rclcpp/create_publisher.hpp rclcpp/create_client.hpp rclcpp/create_service.hpp
     rclcpp/create_subscription.hpp rclcpp/create_timer.hpp"
    "rclcpp/exceptions/exceptions.hpp rclcpp/exceptions.hpp"
    "rclcpp/client.hpp rclcpp/future_return_code.hpp"
    "rclcpp/publisher_options.hpp rclcpp/intra_process_setting.hpp"
    "rclcpp/publisher.hpp rclcpp/publisher_base.hpp"
    "rclcpp/event_handler.hpp rclcpp/qos_event.hpp"
    "rclcpp/subscription.hpp rclcpp/subscription_base.hpp"
    "rclcpp/subscription_options.hpp rclcpp/topic_statistics_state.hpp"
    "rclcpp/wait_set.hpp rclcpp/wait_result.hpp rclcpp/wait_result_kind.hpp"
    "rclcpp/context.hpp rclcpp/contexts/default_context.hpp"
    "rclcpp/executor.hpp rclcpp/executor_options.hpp"
    "rclcpp/executors.hpp rclcpp/executors/multi_threaded_executor.hpp
     rclcpp/executors/single_threaded_executor.hpp rclcpp/executors/static_single_threaded_executor.hpp
     rclcpp/experimental/executors/events_executor/events_executor.hpp"
    "rclcpp/node_interfaces/node_interfaces.hpp rclcpp/node_interfaces/get_node_base_interface.hpp
     rclcpp/node_interfaces/get_node_clock_interface.hpp rclcpp/node_interfaces/get_node_graph_interface.hpp
     rclcpp/node_interfaces/get_node_logging_interface.hpp
     rclcpp/node_interfaces/get_node_parameters_interface.hpp
     rclcpp/node_interfaces/get_node_services_interface.hpp
     rclcpp/node_interfaces/get_node_time_source_interface.hpp
     rclcpp/node_interfaces/get_node_timers_interface.hpp rclcpp/node_interfaces/get_node_topics_interface.hpp
     rclcpp/node_interfaces/get_node_waitables_interface.hpp"
    "rclcpp_action/client.hpp rclcpp_action/client_goal_handle.hpp rclcpp_action/create_client.hpp"
    "rclcpp_action/server.hpp rclcpp_action/create_server.hpp rclcpp_action/server_goal_handle.hpp"
    "rclcpp_lifecycle/lifecycle_publisher.hpp rclcpp_lifecycle/managed_entity.hpp"
    "rclcpp_lifecycle/state.hpp rclcpp_lifecycle/transition.hpp"
    "rclcpp/detail/refused_names.hpp rclcpp/create_generic_client.hpp rclcpp/event.hpp
     rclcpp/generic_client.hpp rclcpp/parameter_map.hpp rclcpp/parameter_service.hpp rclcpp/typesupport_helpers.hpp rclcpp/waitable.hpp
     rclcpp/experimental/buffers/intra_process_buffer.hpp rclcpp/strategies/message_pool_memory_strategy.hpp
     rclcpp_components/component_manager.hpp"
    "rmw/types.h rmw/rmw.h")

set(folder ${PROJECT_BINARY_DIR}/named_headers/include)
foreach(words ${takt_named_headers})
  separate_arguments(words UNIX_COMMAND "${words}")  # also at ends of lines
  list(POP_FRONT words header)
  foreach(name ${words})
    set(content "// The name that programs include for what is in ${header}.\n#pragma once\n#include \"${header}\"\n")
    file(CONFIGURE OUTPUT ${folder}/${name} CONTENT "${content}" @ONLY)
  endforeach()
endforeach()
