# SPDX-License-Identifier: Apache-2.0
# class_loader of the workspace, or what stands in for it where there is none: it loads components.
find_package(class_loader QUIET CONFIG)
if(NOT class_loader_FOUND)
  takt_ros2_target(class_loader::class_loader takt::takt_rclcpp takt::ros_messages)
  set_target_properties(class_loader::class_loader PROPERTIES
                        INTERFACE_INCLUDE_DIRECTORIES ${takt_ros2_prefix}/share/takt_ros2/stand_ins)
  takt_ros2_found(class_loader)
endif()
