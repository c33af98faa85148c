#!/usr/bin/env python3
"""Libraries of ROS 2 that robots link build from their sources, unchanged, pass their own tests, and run.

usage: upstream_test.py TAKT PROGRAMS [PACKAGE...] [--work DIR] [--without-tests] [--record FILE]

The folder that TAKT_UPSTREAM names has clones of their repositories; packages that are named are the only ones that are
built. --work keeps what was built; --record writes the list of docs/results, with the tests of the last run that built
them there, and the rows that it had of packages that this run did not build.
SPDX-License-Identifier: Apache-2.0
"""
import argparse
import datetime
import json
import os
import pathlib
import platform
import re
import signal
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path += [str(HERE / "../../cmake"), str(HERE)]
import build as ros2_build  # noqa: E402
from checks import check, environment, finish, skip  # noqa: E402

# In an order in which they can be built. What differs is said where it does.
PACKAGES = {
    "angles": "", "tf2": "", "message_filters": "its tests in Python are left out",
    "tf2_ros": "two of its tests give one name to an action: they fail if they run at the same time on a domain",
    "tf2_eigen": "", "tf2_kdl": "", "tf2_geometry_msgs": "", "tf2_sensor_msgs": "", "tf2_eigen_kdl": "",
    "diagnostic_updater": "its nodes in Python are left out", "self_test": "", "class_loader": "", "pluginlib": "",
    "diagnostic_aggregator": "its tests, which launch needs, are left out", "urdfdom_headers": "it has no package.xml", "urdfdom": "",
    "urdf_parser_plugin": "", "urdf": "", "kdl_parser": "",
    "robot_state_publisher": "its tests, which launch needs, are left out",
    "image_transport": "its tests do not compile: `rclcpp::Event`", "camera_calibration_parsers": "", "camera_info_manager": "",
    "ros2_control_cmake": "", "test_interface_files": "", "test_msgs": "its tests of C are left out",
    "realtime_tools": "`test_async_function_handler` fails as root, where its thread gets a real-time priority and is done too soon; "
                      "`lock_free_queue_tests` passed alone and failed beside compilers",
    "filters": "", "bond": "", "smclib": "", "bondcpp": "",
    "control_msgs": "", "controller_manager_msgs": "", "generate_parameter_library_py": "", "generate_parameter_library": "",
    "tcb_span": "", "rsl": "", "pal_statistics_msgs": "", "pal_statistics": "", "libstatistics_collector": "", "backward_ros": "",
    "ros2_control_test_assets": "", "joint_limits": "",
    "hardware_interface": "it needs `libstatistics_collector`, which its package.xml does not name, and `REGISTER_ENTITY`, which "
                          "`pal_statistics` 2.2.3 has not",
    "controller_interface": "", "transmission_interface": "", "control_toolbox": "it needs `tf2/LinearMath/Vector3.hpp`, which tf2 of 2024 has not",
    "controller_manager": "its spawner, in Python, is left out",
    "forward_command_controller": "", "position_controllers": "", "joint_state_broadcaster": "", "joint_trajectory_controller": "",
    "geographic_msgs": "", "laser_geometry": "", "map_msgs": "", "interactive_markers": "",
    "robot_localization": "", "behaviortree_cpp": "", "nav2_common": "its launch files, in Python, do not run", "nav2_msgs": "", "nav_2d_msgs": "", "dwb_msgs": "",
    "nav2_util": "", "nav2_lifecycle_manager": "", "nav2_voxel_grid": "", "nav2_costmap_2d": "", "nav_2d_utils": "", "costmap_queue": "",
    "nav2_behavior_tree": "compiled at -O0 here, as are the others that it needs or that need it", "nav2_core": "", "nav2_controller": "", "dwb_core": "", "dwb_critics": "", "dwb_plugins": "", "slam_toolbox": "",
    "teleop_twist_joy": "", "wiimote_msgs": "", "joy_linux": "", "sdl2_vendor": "", "joy": "", "spacenav": "", "laser_filters": "it is newer than the sources of `filters`",
    "pointcloud_to_laserscan": "", "imu_filter_madgwick": "", "imu_complementary_filter": "", "twist_mux": "", "topic_tools_interfaces": "",
    "topic_tools": "", "velodyne_msgs": "", "velodyne_laserscan": "", "velodyne_driver": "", "cmd_vel_mux": "", "rplidar_ros": "",
    "cascade_lifecycle_msgs": "", "rclcpp_cascade_lifecycle": "", "asio_cmake_module": "", "udp_msgs": "", "io_context": "", "explore_lite": "",
    "laser_proc": "", "urg_c": "", "urg_node_msgs": "", "urg_node": "", "dynamixel_sdk": "", "gps_msgs": "", "ackermann_msgs": "", "udp_driver": "",
    "serial_driver": ""}
# What they need is not here: the error names all of it.
LACKING = {"slam_toolbox": ["rviz_common", "rviz_default_plugins", "rviz_ogre_vendor", "rviz_rendering"],
           "pointcloud_to_laserscan": ["graph events"], "laser_filters": ["getParam"]}
WITHOUT_TESTS = {"image_transport", "test_msgs"}
MAY_FAIL = {"test_async_function_handler"}
URDF = """<?xml version="1.0"?><robot name="arm"><link name="base"/><link name="tool"/><link name="tip"/>
<joint name="turn" type="revolute"><parent link="base"/><child link="tool"/><origin xyz="1 0 0"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="fixed" type="fixed"><parent link="tool"/><child link="tip"/><origin xyz="0 0 2"/></joint></robot>
"""
CALIBRATION = """image_width: 4
image_height: 2
camera_name: camera
camera_matrix: {rows: 3, cols: 3, data: [42.0, 0, 2, 0, 42.0, 1, 0, 0, 1]}
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}
rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}
projection_matrix: {rows: 3, cols: 4, data: [42.0, 0, 2, 0, 0, 42.0, 1, 0, 0, 0, 1, 0]}
"""
AGGREGATOR = """analyzers: {ros__parameters: {path: Robot, example: {type: diagnostic_aggregator/GenericAnalyzer, path: Example,
  contains: [diagnostic_updater_example]}}}
"""
CONTROLLED = """<?xml version="1.0"?><robot name="arm"><link name="base"/><link name="tool"/>
<joint name="turn" type="revolute"><parent link="base"/><child link="tool"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="1" velocity="9"/></joint>
<ros2_control name="motors" type="system"><hardware><plugin>mock_components/GenericSystem</plugin></hardware>
<joint name="turn"><command_interface name="position"/><state_interface name="position"><param name="initial_value">0.0</param></state_interface>
<state_interface name="velocity"/></joint></ros2_control></robot>
"""
CONTROLLERS = """controller_manager: {ros__parameters: {update_rate: 200, states: {type: joint_state_broadcaster/JointStateBroadcaster},
  arm: {type: joint_trajectory_controller/JointTrajectoryController}}}
arm: {ros__parameters: {joints: [turn], command_interfaces: [position], state_interfaces: [position, velocity]}}
"""
CONTROL_LOOP = """realtime: prefer
threads: {control: {policy: SCHED_FIFO, priority: 80}}
executors: {control: {type: single_threaded, threads: [control]}}
nodes: {/controller_manager: {callback_groups: {group_1: {executor: control}}, callbacks: {timer_5ms: {deadline: 5ms}}}}
"""
FILTER = """ekf_filter_node: {ros__parameters: {frequency: 30.0, two_d_mode: true, world_frame: odom,
  odom0: odom, odom0_config: [false, false, false, false, false, false, true, false, false, false, false, false, false, false, false],
  imu0: imu, imu0_config: [false, false, false, false, false, false, false, false, false, false, false, true, false, false, false]}}
"""
COSTMAP = """lifecycle_manager: {ros__parameters: {autostart: true, node_names: [costmap], bond_timeout: 0.0}}
costmap: {ros__parameters: {global_frame: odom, rolling_window: true, width: 4, height: 4, robot_radius: 0.2,
  plugins: [inflation], inflation: {plugin: "nav2_costmap_2d::InflationLayer"}}}
"""

CONTROLLER = """lifecycle_manager: {ros__parameters: {autostart: true, node_names: [controller_server], bond_timeout: 0.0}}
controller_server: {ros__parameters: {controller_frequency: 10.0, progress_checker_plugins: [progress], goal_checker_plugins: [goal],
  controller_plugins: [FollowPath], progress: {plugin: "nav2_controller::SimpleProgressChecker"},
  goal: {plugin: "nav2_controller::SimpleGoalChecker", xy_goal_tolerance: 0.1, yaw_goal_tolerance: 3.0},
  FollowPath: {plugin: "dwb_core::DWBLocalPlanner", max_vel_x: 0.4, max_speed_xy: 0.4, max_vel_theta: 1.0, acc_lim_x: 2.5, acc_lim_theta: 3.0,
    decel_lim_x: -2.5, decel_lim_theta: -3.0, vx_samples: 10, vtheta_samples: 11, sim_time: 1.0, critics: [GoalDist, PathDist, BaseObstacle]}}}
local_costmap: {local_costmap: {ros__parameters: {global_frame: odom, rolling_window: true, width: 4, height: 4, robot_radius: 0.2,
  plugins: [inflation], inflation: {plugin: "nav2_costmap_2d::InflationLayer"}}}}
"""


class Workspace:
    def __init__(self, takt, work):
        self.takt, self.work, self.results = takt, work, {}

    def build(self, name, folder, *arguments):
        done = subprocess.run([self.takt, "ros2", "build", folder, "--build-base", self.work / "build", "--install-base",
                               self.work / "install", *arguments], capture_output=True, text=True, timeout=1800, env=environment)
        (self.work / f"{name}.log").write_text(done.stdout + done.stderr)
        errors = [line for line in (done.stdout + done.stderr).splitlines() if re.search(r"error:|CMake Error", line)]
        if name in LACKING:
            lacks = LACKING[name]
            check(f"{name} is refused, with all that it lacks", done.returncode != 0 and all(need in done.stdout + done.stderr for need in lacks),
                  done.stderr)
            self.results[name] = [f"it lacks {', '.join(f'`{need}`' for need in lacks)}"]
        else:
            check(f"{name} builds", done.returncode == 0, *errors[:5])
        return done.returncode == 0

    def own_tests(self, name):
        done = subprocess.run(["ctest", "--timeout", "120"], cwd=self.work / "build" / name, capture_output=True, text=True,
                              timeout=1800, env=environment)
        passed = re.findall(r"Test +#\d+: (\S+) \.+ +Passed", done.stdout)
        failed = re.findall(r"Test +#\d+: (\S+) \.*\*\*\*", done.stdout)
        check(f"{name}: {len(passed)} tests of its own pass", set(failed) <= MAY_FAIL, failed)
        return f"{len(passed)} of {len(passed) + len(failed)}" if passed or failed else "none"

    def program(self, package, name, *arguments):
        return [str(self.work / "install/lib" / package / name), *map(str, arguments)]

    def run(self, command, *beside, seconds=20):
        """What the command says, while the others run."""
        others = [subprocess.Popen(other, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) for other in beside]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=seconds, env=environment)
            output = done.stdout + done.stderr + (f"(status {done.returncode})" if done.returncode else "")
        except subprocess.TimeoutExpired as error:
            output = (error.stdout or b"").decode() + (error.stderr or b"").decode()
        for other in others:
            other.send_signal(signal.SIGINT)
        return output, "".join(other.communicate(timeout=20)[0] for other in others)

    def holds(self, packages, what, wanted, said):
        check(f"{', '.join(packages)}: {what}", wanted in said[0] + said[1], wanted, *said)
        for package in packages:
            self.results.setdefault(package, []).append(what if wanted in said[0] + said[1] else f"FAILS: {what}")


def runs(space):
    program, own, work = space.program, "robot_programs", space.work
    for name, text in (("arm.urdf", URDF), ("camera.yaml", CALIBRATION), ("analyzers.yaml", AGGREGATOR)):
        (work / name).write_text(text)
    static = program("tf2_ros", "static_transform_publisher", "--x", "1", "--frame-id", "map", "--child-frame-id", "base")
    space.holds(["tf2", "tf2_ros"], "`tf2_echo` has the transform of another process", "- Translation: [1.000, 0.000, 0.000]",
                space.run(program("tf2_ros", "tf2_echo", "map", "base"), static, seconds=6))
    publisher = program("robot_state_publisher", "robot_state_publisher", work / "arm.urdf")
    space.holds(["robot_state_publisher", "urdf", "urdfdom", "urdf_parser_plugin", "kdl_parser", "realtime_tools", "tf2_eigen", "tf2_geometry_msgs"],
                "a joint that one process turns moves a point in another", "1.00 1.00 2.00\n1.00 1.00 2.00\n",
                space.run(program(own, "look_up", "base", "tip"), publisher, program(own, "joints")))
    space.holds(["message_filters"], "messages are paired by equal and by near stamps", "20 equal, 35 or more near",
                space.run(program(own, "synchronize")))
    space.holds(["pluginlib", "class_loader", "filters"], "a filter is loaded from its library", "mean of the last four: 3.50",
                space.run(program(own, "filter")))
    space.holds(["image_transport", "pluginlib"], "`list_transports` finds its plugin", "image_transport/raw",
                space.run(program("image_transport", "list_transports")))
    space.holds(["image_transport", "camera_info_manager", "camera_calibration_parsers"],
                "images and their calibration come from another process", "4 x 2, fx 42.0",
                space.run(program(own, "images", "receive"), program(own, "images", "send", f"file://{work}/camera.yaml")))
    space.holds(["bondcpp", "bond", "smclib"], "a process sees that another one breaks the bond", "formed\nbroken\n",
                space.run(program(own, "bonded"), program(own, "bonded", "breaks")))
    example = program("diagnostic_updater", "example")
    echo = [str(space.takt), "topic", "echo", "-n", "4", "--duration", "15s"]
    space.holds(["diagnostic_updater"], "`takt topic echo /diagnostics` shows its statuses", 'message: "This is a silly updater."',
                space.run([*echo, "/diagnostics"], example))
    aggregator = program("diagnostic_aggregator", "aggregator_node", "--ros-args", "--params-file", work / "analyzers.yaml")
    space.holds(["diagnostic_aggregator"], "its analyzers are loaded, and group the statuses", 'name: "/Robot/Example',
                space.run([*echo, "/diagnostics_agg"], example, aggregator))
    space.holds(["self_test"], "a node tests itself when it is asked", "Self test",
                space.run(program("self_test", "run_selftest", "self_test_example_node"),
                          program("self_test", "selftest_example")))


def control_runs(space):
    program, own, work = space.program, "robot_control", space.work
    for name, text in (("controlled.urdf", CONTROLLED), ("controllers.yaml", CONTROLLERS), ("control.yaml", CONTROL_LOOP)):
        (work / name).write_text(text)
    description = program("robot_state_publisher", "robot_state_publisher", work / "controlled.urdf")
    arguments = ("--ros-args", "--params-file", work / "controllers.yaml")
    libraries = ["hardware_interface", "controller_interface", "controller_manager", "controller_manager_msgs", "control_msgs",
                 "joint_trajectory_controller", "joint_state_broadcaster", "generate_parameter_library", "rsl", "control_toolbox"]
    moved = "error code 0\nseen on its way, and at 1.00\n"
    space.holds(libraries, "a trajectory moves a joint of mock hardware", moved,
                space.run(program(own, "move"), description, program("controller_manager", "ros2_control_node", *arguments)))
    loop = [str(space.takt), "run", str(work / "control.yaml"), "--", *program(own, "loop", *arguments)]
    said = space.run(program(own, "move"), description, loop)
    space.holds(["controller_manager"], "its loop is a callback whose thread and deadline a file of Takt's gives", moved, said)
    space.holds(["controller_manager"], "Takt measures that callback", "timer_5ms", said)
    fast = program(own, "loop", *arguments, "-p", "update_rate:=100000")
    space.holds(["controller_manager"], "an overrun says how long read, update and write took", "us, Update time : ",
                space.run(["sleep", "5"], description, fast))


def navigation_runs(space):
    program, own, work = space.program, "robot_navigation", space.work
    for name, text in (("filter.yaml", FILTER), ("costmap.yaml", COSTMAP)):
        (work / name).write_text(text)
    localization = program("robot_localization", "ekf_node", "--ros-args", "--params-file", work / "filter.yaml")
    space.holds(["robot_localization"], "it estimates how a robot moves, as a message and as a transform",
                "0.5 m/s, 0.2 rad/s, its transform is near\n", space.run(program(own, "drive"), localization))
    arguments = ("--ros-args", "--params-file", work / "costmap.yaml")
    space.holds(["nav2_lifecycle_manager", "nav2_util", "nav2_costmap_2d", "nav2_msgs"], "the manager configures and activates a costmap with a plugin",
                "Managed nodes are active", space.run(program("nav2_lifecycle_manager", "lifecycle_manager", *arguments),
                                                      program("nav2_costmap_2d", "nav2_costmap_2d", *arguments),
                                                      program("tf2_ros", "static_transform_publisher", "--frame-id", "odom",
                                                              "--child-frame-id", "base_link"), seconds=15))


def controller_runs(space):
    program, work = space.program, space.work
    (work / "controller.yaml").write_text(CONTROLLER)
    arguments = ("--ros-args", "--params-file", work / "controller.yaml")
    space.holds(["nav2_controller", "nav2_core", "costmap_queue", "dwb_core", "dwb_plugins", "dwb_critics"], "a robot follows a path of 1 m",
                "error code 0, at its end\n", space.run(program("robot_path", "follow"), program("nav2_controller", "controller_server", *arguments),
                                                        program("nav2_lifecycle_manager", "lifecycle_manager", *arguments), seconds=60))


def commit_of(folder):
    def git(*words):
        done = subprocess.run(["git", "-C", folder, *words], capture_output=True, text=True, check=False)
        return done.stdout.strip()
    repository = re.sub(r"^https://|\.git$", "", git("remote", "get-url", "origin")) or "?"
    return repository, git("log", "-1", "--format=%h of %cs") or "?"


def rows(space, packages, built, tests, record):
    """A row for each package that this run built; others are those that the list had."""
    earlier = {name: row for row, name in re.findall(r"^(\| (\w+) \| .*)$", record.read_text(), re.MULTILINE)} if record.exists() else {}
    for name, differs in PACKAGES.items():
        if name in built:
            repository, commit = commit_of(packages[name].folder)
            yield (f"| {name} | [{repository.removeprefix('github.com/')}](https://{repository}) | {commit} | "
                   f"{'yes' if built[name] else '**no**'} | {tests.get(name, 'not built')} | "
                   f"{'; '.join(space.results.get(name, ['what needs it builds']))} | {differs} |")
        elif name in earlier:
            yield earlier[name]


def page(table, built):
    here = subprocess.run(["git", "-C", HERE, "rev-parse", "--short=9", "HEAD"], capture_output=True, text=True, check=False)
    return f"""# Libraries that robots link, from their sources

{sum('| yes |' in row for row in table)} of {len(table)} packages build unchanged with `takt ros2 build`, of the sources named here. Their own tests are those that
GoogleTest runs, one after the other, in the last runs that built them.

Made on {datetime.date.today()} at {here.stdout.strip()} by `rclcpp/cmake/upstream_test.py --record`, which tried {len(built)} of them, on
{os.cpu_count()} CPUs, {platform.system()} {platform.release()}; other rows are of runs before. No ROS 2 was there: that they talk with one was not tried.

| package | repository | commit | builds | own tests pass | runs | what differs |
|---|---|---|---|---|---|---|
""" + "\n".join(table) + "\n"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("takt", type=pathlib.Path)
    parser.add_argument("programs", type=pathlib.Path)
    parser.add_argument("names", metavar="PACKAGE", nargs="*")
    parser.add_argument("--work", type=pathlib.Path)
    parser.add_argument("--record", type=pathlib.Path)
    parser.add_argument("--without-tests", action="store_true")
    options = parser.parse_args()
    upstream = os.environ.get("TAKT_UPSTREAM", "")
    if not upstream:
        skip("TAKT_UPSTREAM names no folder with clones of the libraries (docs/results/workspace.md lists them)")
    with tempfile.TemporaryDirectory() as folder:
        space = Workspace(options.takt.resolve(), (options.work or pathlib.Path(folder)).resolve())
        space.work.mkdir(exist_ok=True)
        packages = ros2_build.find_packages([pathlib.Path(upstream).resolve()])
        known = space.work / "tests.json"
        built, tests = {}, json.loads(known.read_text()) if known.exists() else {}
        for name in [name for name in PACKAGES if not options.names or name in options.names]:
            if name not in packages:
                print(f"left out: {name}, as it is not in {upstream}")
                continue
            with_tests = not options.without_tests and name not in WITHOUT_TESTS
            built[name] = space.build(name, packages[name].folder, "--cmake-args", f"-DBUILD_TESTING={'ON' if with_tests else 'OFF'}")
            if built[name] and with_tests:
                tests[name] = space.own_tests(name)
                known.write_text(json.dumps(tests))
        for name, needed, what in (("robot_programs", "tf2_ros", runs), ("robot_control", "controller_manager", control_runs),
                                   ("robot_navigation", "nav2_costmap_2d", navigation_runs), ("robot_path", "dwb_critics", controller_runs)):
            if built.get(needed) and space.build(name, options.programs / name):
                what(space)
        if options.record:
            options.record.write_text(page(list(rows(space, packages, built, tests, options.record)), built))
    finish()


main()
