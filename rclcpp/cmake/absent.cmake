# SPDX-License-Identifier: Apache-2.0
# Packages that are often asked for and are not in the layer: whether they can be had. Each name becomes
# a FindNAME.cmake, which CMake asks first; takt ros2 build reads the same lists.

# Written in C++ upon rclcpp, or upon nothing of ROS 2: they are built as any other package. Each line is
# the place of a repository, the branch of it that was tried, and its packages.
set(takt_ros2_absent_source
    "github.com/christianrauch/apriltag_msgs apriltag_msgs"
    "github.com/clalancette/sophus sophus"
    "github.com/BehaviorTree/BehaviorTree.CPP@master behaviortree_cpp"
    "github.com/cra-ros-pkg/robot_localization@jazzy-devel robot_localization"
    "github.com/fmrico/cascade_lifecycle rclcpp_cascade_lifecycle"
    "github.com/flynneva/udp_msgs@main udp_msgs"
    "github.com/foxglove/foxglove-sdk foxglove_msgs"
    "github.com/mavlink/mavros mavros_msgs"
    "github.com/moveit/moveit2 moveit_common moveit_core"
    "github.com/moveit/moveit_msgs moveit_msgs"
    "github.com/moveit/srdfdom srdfdom"
    "github.com/ros-navigation/navigation2@jazzy costmap_queue dwb_core dwb_critics dwb_msgs dwb_plugins nav2_behavior_tree nav2_common nav2_controller nav2_core nav2_costmap_2d nav2_lifecycle_manager nav2_msgs nav2_util nav2_voxel_grid nav_2d_msgs nav_2d_utils"
    "github.com/pal-robotics/backward_ros@foxy-devel backward_ros"
    "github.com/pal-robotics/pal_statistics pal_statistics pal_statistics_msgs"
    "github.com/ros-controls/control_msgs@jazzy control_msgs"
    "github.com/ros-controls/control_toolbox@jazzy control_toolbox"
    "github.com/ros-controls/realtime_tools@jazzy realtime_tools"
    "github.com/ros-controls/ros2_control@jazzy controller_interface controller_manager controller_manager_msgs hardware_interface joint_limits ros2_control_test_assets transmission_interface"
    "github.com/ros-controls/ros2_controllers@jazzy forward_command_controller joint_state_broadcaster joint_trajectory_controller position_controllers"
    "github.com/ros-controls/ros2_control_cmake@master ros2_control_cmake"
    "github.com/ros-drivers/ackermann_msgs ackermann_msgs"
    "github.com/ros-drivers/joystick_drivers@ros2 joy sdl2_vendor wiimote_msgs"
    "github.com/ros-geographic-info/geographic_info@ros2 geodesy geographic_msgs"
    "github.com/ros-perception/image_common@jazzy camera_calibration_parsers camera_info_manager image_transport"
    "github.com/ros-perception/image_pipeline depth_image_proc image_proc"
    "github.com/ros-perception/laser_geometry@rolling laser_geometry"
    "github.com/ros-perception/pcl_msgs pcl_msgs"
    "github.com/ros-perception/perception_pcl pcl_conversions pcl_ros"
    "github.com/ros-perception/point_cloud_transport point_cloud_transport"
    "github.com/ros-perception/radar_msgs radar_msgs"
    "github.com/ros-perception/vision_msgs vision_msgs"
    "github.com/ros-perception/vision_opencv cv_bridge image_geometry"
    "github.com/ros-planning/navigation_msgs@ros2 map_msgs"
    "github.com/ros-tooling/libstatistics_collector@jazzy libstatistics_collector"
    "github.com/ros-tooling/topic_tools@jazzy topic_tools topic_tools_interfaces"
    "github.com/ros-visualization/interactive_markers@ros2 interactive_markers"
    "github.com/ros/angles@ros2 angles"
    "github.com/ros/bond_core@jazzy bond bondcpp smclib"
    "github.com/ros/diagnostics@ros2-jazzy diagnostic_aggregator diagnostic_updater self_test"
    "github.com/ros/filters@ros2 filters"
    "github.com/ros/kdl_parser@rolling kdl_parser"
    "github.com/ros/pluginlib@rolling pluginlib"
    "github.com/ros/resource_retriever resource_retriever"
    "github.com/ros/robot_state_publisher@rolling robot_state_publisher"
    "github.com/ros/ros_tutorials turtlesim"
    "github.com/ros2/common_interfaces sensor_msgs_py"
    "github.com/ros2/geometry2@jazzy tf2 tf2_bullet tf2_eigen tf2_eigen_kdl tf2_geometry_msgs tf2_kdl tf2_ros tf2_sensor_msgs"
    "github.com/ros2/message_filters@jazzy message_filters"
    "github.com/ros2/performance_test_fixture performance_test_fixture"
    "github.com/ros2/rosbag2 rosbag2_interfaces"
    "github.com/ros2/rcl_interfaces@jazzy test_msgs"
    "github.com/ros2/rviz rviz_common rviz_default_plugins rviz_ogre_vendor rviz_rendering"
    "github.com/ros2/test_interface_files@jazzy test_interface_files"
    "github.com/ros2/urdf@ros2 urdf urdf_parser_plugin"
    "github.com/rudislabs/actuator_msgs actuator_msgs"
    "github.com/swri-robotics/gps_umd gps_msgs"
    "github.com/ANYbotics/grid_map grid_map_msgs"
    "github.com/CCNYRoboticsLab/imu_tools imu_tools"
    "github.com/OctoMap/octomap_msgs octomap_msgs"
    "github.com/PX4/px4_msgs px4_msgs"
    "github.com/PickNikRobotics/RSL@main rsl"
    "github.com/PickNikRobotics/cpp_polyfills@main tcb_span"
    "github.com/PickNikRobotics/generate_parameter_library@main generate_parameter_library generate_parameter_library_py")

# They are parts of ROS 2 whose place Takt takes, or that need a part of ROS 2 that it does not have.
set(takt_ros2_absent_never
    connext_cmake_module fastrtps fastrtps_cmake_module launch_ros python_qt_binding
    rcl_logging_interface rcl_logging_noop rcl_logging_spdlog rclc rmw_connextdds rmw_cyclonedds_cpp
    rmw_dds_common rmw_fastrtps_cpp rmw_fastrtps_dynamic_cpp rmw_fastrtps_shared_cpp rmw_implementation
    rmw_zenoh_cpp rosbag2_cpp rosbag2_storage rosbag2_transport rosidl_adapter rosidl_default_generators_py
    rosidl_dynamic_typesupport rosidl_generator_c rosidl_generator_py rosidl_parser rosidl_runtime_c
    rosidl_typesupport_c rosidl_typesupport_fastrtps_c rosidl_typesupport_fastrtps_cpp
    rosidl_typesupport_interface rosidl_typesupport_introspection_c rqt_gui rqt_gui_cpp rttest
    tlsf tlsf_cpp tracetools)
