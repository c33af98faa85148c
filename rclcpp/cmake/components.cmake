# SPDX-License-Identifier: Apache-2.0
# Components of rclcpp: libraries of nodes that a container loads by name, and programs of one such node.

# An entry of ROS 2's index, which takt reads as well. ament_package() writes them.
function(takt_ros2_index_component class target)
  get_property(known GLOBAL PROPERTY takt_ros2_${PROJECT_NAME}_components)
  set_property(GLOBAL PROPERTY takt_ros2_${PROJECT_NAME}_components "${known}${class};lib/$<TARGET_FILE_NAME:${target}>\n")
endfunction()

# rclcpp_components_register_nodes(target class… [RESOURCE_INDEX name])
function(rclcpp_components_register_nodes target)
  cmake_parse_arguments(PARSE_ARGV 1 ARG "" "RESOURCE_INDEX" "")
  takt_ros2_check_component_library(rclcpp_components_register_nodes ${target})
  foreach(class ${ARG_UNPARSED_ARGUMENTS})
    takt_ros2_index_component(${class} ${target})
  endforeach()
endfunction()

# rclcpp_components_register_node(target PLUGIN class EXECUTABLE name [EXECUTOR class] [RESOURCE_INDEX name])
function(rclcpp_components_register_node target)
  cmake_parse_arguments(PARSE_ARGV 1 ARG "NO_UNDEFINED_SYMBOLS" "PLUGIN;EXECUTABLE;EXECUTOR;RESOURCE_INDEX" "")
  if(ARG_UNPARSED_ARGUMENTS OR NOT ARG_PLUGIN OR NOT ARG_EXECUTABLE)
    message(FATAL_ERROR "rclcpp_components_register_node(${target} PLUGIN class EXECUTABLE name [EXECUTOR class]) "
                        "is what it takes")
  endif()
  takt_ros2_check_component_library(rclcpp_components_register_node ${target})
  takt_ros2_index_component(${ARG_PLUGIN} ${target})
  set(executor ${ARG_EXECUTOR})
  if(NOT executor)
    set(executor rclcpp::executors::SingleThreadedExecutor)
  endif()
  set(class ${ARG_PLUGIN})
  set(main ${CMAKE_CURRENT_BINARY_DIR}/rclcpp_components/node_main_${ARG_EXECUTABLE}.cpp)
  configure_file(${takt_ros2_templates}/component_main.cpp.in ${main} @ONLY)
  add_executable(${ARG_EXECUTABLE} ${main})
  # The class registers itself when its library is loaded, of which nothing else is used here.
  target_link_libraries(${ARG_EXECUTABLE} PRIVATE -Wl,--no-as-needed ${target} rclcpp_components::component)
  install(TARGETS ${ARG_EXECUTABLE} DESTINATION lib/${PROJECT_NAME})
endfunction()

function(takt_ros2_check_component_library call target)
  if(NOT TARGET ${target})
    message(FATAL_ERROR "${call}(${target} …): there is no target of that name")
  endif()
  get_target_property(type ${target} TYPE)
  if(NOT type STREQUAL SHARED_LIBRARY)
    message(FATAL_ERROR "${call}(${target} …): components are in a shared library; write add_library(${target} SHARED …)")
  endif()
endfunction()
