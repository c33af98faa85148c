# SPDX-License-Identifier: Apache-2.0
# The packages of the layer, by the function of TaktRos2.cmake that their package file calls, with the
# versions that Jazzy has, as some packages ask for them.

# NAME VERSION LIBRARY: ROS 2 brings the library for systems without it.
set(takt_ros2_packages_vendor
    "console_bridge_vendor 1.7.1 console_bridge" "eigen3_cmake_module 0.3.0 Eigen3"
    "orocos_kdl_vendor 0.5.1 orocos_kdl" "tinyxml2_vendor 0.9.2 tinyxml2" "yaml_cpp_vendor 9.0.1 yaml-cpp")

# NAME VERSION [TARGETS name…] [USES package…] [MAY_USE package…]
set(takt_ros2_packages_library
    "rclcpp 28.1.6 USES rcl rcl_interfaces rcl_yaml_param_parser rcpputils rcutils rmw rosgraph_msgs \
rosidl_runtime_cpp rosidl_typesupport_cpp statistics_msgs MAY_USE libstatistics_collector"
    "rclcpp_action 28.1.6 USES action_msgs rcl_action rclcpp"
    "rclcpp_components 28.1.6 TARGETS component component_manager USES ament_index_cpp class_loader \
composition_interfaces rclcpp"
    "rclcpp_lifecycle 28.1.6 USES lifecycle_msgs rcl_lifecycle rclcpp"
    "rcl 9.2.5"
    "rcl_action 9.2.5"
    "rcl_lifecycle 9.2.5"
    "rcl_yaml_param_parser 9.2.5"
    "rcpputils 2.11.1"
    "rcutils 6.7.2"
    "rmw 7.3.2"
    "ament_index_cpp 1.8.1"
    "rosidl_runtime_cpp 4.6.5"
    "rosidl_typesupport_cpp 3.2.2"
    "rosidl_typesupport_introspection_cpp 4.6.5")

set(takt_ros2_packages_messages
    "builtin_interfaces 2.0.2" "unique_identifier_msgs 2.5.0" "lifecycle_msgs 2.0.2" "std_srvs 5.3.7"
    "type_description_interfaces 2.0.2" "action_tutorials_interfaces 0.33.5" "example_interfaces 0.12.0"
    "rosgraph_msgs 2.0.2" "action_msgs 2.0.2" "rcl_interfaces 2.0.2" "composition_interfaces 2.0.2"
    "service_msgs 2.0.2" "statistics_msgs 2.0.2" "std_msgs 5.3.7" "diagnostic_msgs 5.3.7"
    "geometry_msgs 5.3.7" "nav_msgs 5.3.7" "sensor_msgs 5.3.7" "shape_msgs 5.3.7" "stereo_msgs 5.3.7"
    "tf2_msgs 0.36.7" "trajectory_msgs 5.3.7" "visualization_msgs 5.3.7")

set(takt_ros2_packages_tool
    "ament_cmake 2.5.4" "ament_cmake_auto 2.5.4" "ament_cmake_core 2.5.4" "ament_cmake_export_definitions 2.5.4"
    "ament_cmake_export_dependencies 2.5.4" "ament_cmake_export_include_directories 2.5.4"
    "ament_cmake_export_interfaces 2.5.4" "ament_cmake_export_libraries 2.5.4"
    "ament_cmake_export_link_flags 2.5.4" "ament_cmake_export_targets 2.5.4"
    "ament_cmake_include_directories 2.5.4" "ament_cmake_libraries 2.5.4" "ament_cmake_python 2.5.4"
    "ament_cmake_target_dependencies 2.5.4" "ament_cmake_gen_version_h 2.5.4" "ament_cmake_version 2.5.4"
    "ament_cmake_test 2.5.4" "ament_cmake_gtest 2.5.4" "ament_cmake_gmock 2.5.4" "ament_cmake_pytest 2.5.4"
    "ament_cmake_google_benchmark 2.5.4" "ament_cmake_ros 0.12.0" "ament_lint_auto 0.17.2"
    "ament_lint_common 0.17.2" "ament_cmake_clang_format 0.17.2" "ament_cmake_clang_tidy 0.17.2"
    "ament_cmake_copyright 0.17.2" "ament_cmake_cppcheck 0.17.2" "ament_cmake_cpplint 0.17.2"
    "ament_cmake_flake8 0.17.2" "ament_cmake_lint_cmake 0.17.2" "ament_cmake_mypy 0.17.2"
    "ament_cmake_pep257 0.17.2" "ament_cmake_uncrustify 0.17.2" "ament_cmake_xmllint 0.17.2"
    "launch_testing_ament_cmake 3.4.5" "ros_testing 0.6.0" "rmw_implementation_cmake 7.3.2"
    "rosidl_cmake 4.6.5" "rosidl_default_generators 1.6.0" "rosidl_default_runtime 1.6.0"
    "python_cmake_module 0.11.1" "ros_environment 4.1.1" "rosidl_generator_cpp 4.6.5" "rosidl_generator_dds_idl 0.11.1"
    "rclpy 7.1.3")  # for packages that also have nodes in Python: these do not run on Takt
