# SPDX-License-Identifier: Apache-2.0
from launch import LaunchDescription
from launch.actions import ExecuteProcess, RegisterEventHandler, Shutdown
from launch.event_handlers import OnProcessExit
from launch_ros.actions import LoadComposableNodes, Node
from launch_ros.descriptions import ComposableNode


def generate_launch_description():
    control = ExecuteProcess(cmd=["takt", "run", "control.yaml"], output="screen",
                             sigterm_timeout="10")  # time for destructors: "motors off"
    return LaunchDescription([
        control,
        RegisterEventHandler(OnProcessExit(target_action=control, on_exit=Shutdown())),
        Node(package="joy", executable="joy_node"),
        LoadComposableNodes(target_container="/control", composable_node_descriptions=[
            ComposableNode(package="", plugin="takt::Recorder", name="recorder",
                           parameters=[{"file": "drive.mcap"}])]),
    ])
