# SPDX-License-Identifier: Apache-2.0
# Packages that are often asked for and are not in the layer: whether they can be had. Each name becomes
# a FindNAME.cmake, which CMake asks first; takt ros2 build reads the same lists.

# Written in C++ upon rclcpp, or upon nothing of ROS 2: they are built as any other package.
set(takt_ros2_absent_source
    ackermann_msgs actuator_msgs angles apriltag_msgs bond bondcpp camera_calibration_parsers
    camera_info_manager control_msgs control_toolbox controller_manager_msgs cv_bridge
    diagnostic_updater foxglove_msgs generate_parameter_library geodesy geographic_msgs gps_msgs
    grid_map_msgs image_geometry imu_tools interactive_markers joint_limits joy laser_geometry
    libstatistics_collector map_msgs mavros_msgs message_filters moveit_common moveit_msgs nav2_common
    nav2_msgs nav2_util nav_2d_msgs octomap_msgs pal_statistics parameter_traits pcl_conversions
    pcl_msgs pcl_ros performance_test_fixture px4_msgs radar_msgs rclcpp_cascade_lifecycle
    realtime_tools resource_retriever robot_localization ros2_control_cmake rosbag2_interfaces rsl
    sensor_msgs_py sophus tcb_span tf2 tf2_bullet tf2_eigen tf2_eigen_kdl tf2_geometry_msgs tf2_kdl
    tf2_ros tf2_sensor_msgs tl_expected topic_tools_interfaces turtlesim udp_msgs urdf_parser_plugin
    vision_msgs)

# They load classes by pluginlib, which stands upon another class_loader than the layer has.
set(takt_ros2_absent_plugins
    controller_interface controller_manager diagnostic_aggregator depth_image_proc filters
    hardware_interface image_transport joint_trajectory_controller kdl_parser moveit_core nav2_core
    nav2_costmap_2d pluginlib point_cloud_transport robot_state_publisher rviz_common srdfdom urdf)

# They are parts of ROS 2 whose place Takt takes, or that need a part of ROS 2 that it does not have.
set(takt_ros2_absent_never
    connext_cmake_module fastrtps fastrtps_cmake_module launch_ros python_cmake_module python_qt_binding
    rcl_logging_interface rcl_logging_noop rcl_logging_spdlog rclc rmw_connextdds rmw_cyclonedds_cpp
    rmw_dds_common rmw_fastrtps_cpp rmw_fastrtps_dynamic_cpp rmw_fastrtps_shared_cpp rmw_implementation
    rmw_zenoh_cpp rosbag2_cpp rosbag2_storage rosbag2_transport rosidl_adapter rosidl_default_generators_py
    rosidl_dynamic_typesupport rosidl_generator_c rosidl_generator_py rosidl_parser rosidl_runtime_c
    rosidl_typesupport_c rosidl_typesupport_fastrtps_c rosidl_typesupport_fastrtps_cpp
    rosidl_typesupport_interface rosidl_typesupport_introspection_c rqt_gui rqt_gui_cpp rttest test_msgs
    tlsf tlsf_cpp tracetools)
