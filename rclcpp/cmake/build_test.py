#!/usr/bin/env python3
"""Packages written for ROS 2 build on Takt, unchanged; what cannot is refused in one sentence.

usage: build_test.py TAKT PACKAGES
SPDX-License-Identifier: Apache-2.0
"""
import contextlib
import glob
import os
import pathlib
import signal
import subprocess
import sys
import tempfile

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../cmake"))
from checks import check, environment, eventually, finish, proves  # noqa: E402

takt, packages = sys.argv[1], pathlib.Path(sys.argv[2])
for variable in ("AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH", "LD_LIBRARY_PATH", "ROS_DISTRO", "ROS_VERSION"):
    environment.pop(variable, None)


def run(*command, **more):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False, timeout=600,
                          env=environment | more)
    return done.returncode, done.stdout, done.stderr


prefix = run(takt, "ros2", "prefix")[1].strip()
check(f"the prefix is a folder: {prefix}", os.path.isdir(prefix))


# What `colcon build` would do: in the order of their needs, each installed for the next.
def test_packages(work):
    status, output, errors = run(takt, "ros2", "build", packages, "--build-base", work / "build", "--install-base",
                                 work / "install", "--cmake-args", "-DBUILD_TESTING=ON")
    check("all packages build", status == 0, output, errors)
    order = [output.find(f"] {name}") for name in ("sky_interfaces", "sky_library", "sky_nodes", "sky_components")]
    check(f"in the order of their package.xml ({order})", order == sorted(order) and order[0] >= 0, output)
    check("extras of a package are there for the next", "from sky_library, version 0.1.0" in output, output)
    status, output, errors = run(work / "install/lib/sky_interfaces/print_sky")
    check("messages are as in ROS 2", status == 0 and output ==
          "two fit in\n1 m sky_interfaces/msg/Sky sky_interfaces::srv::Count\n"
          "{height: 1000.00, kind: 1}\nstamp:\n  sec: 0\n  nanosec: 0\nframe_id: \"earth\"\n", output, errors)
    status, output, errors = run(work / "install/lib/sky_nodes/measure")
    check("a program finds the libraries of other packages without a setup file",
          output == "the lowest cloud is at 1000 m\n", output, errors)
    test_run(work)
    check("folders are installed", (work / "install/share/sky_nodes/launch/sky.launch.yaml").is_file())
    status, output, errors = run(work / "install/lib/sky_components/watch")
    check("a component is a program", status == 0 and "[watcher]: it has 3 clouds" in output + errors, output, errors)
    status, output, errors = run(work / "install/lib/sky_components/load", work / "install/lib/libwatcher.so")
    check("a program loads a component by itself", status == 0 and output.startswith("sky_components::Watcher\n")
          and "[watcher]: it has 3 clouds" in output + errors and "it is libwatcher.so\nrefused, 2" in output, output, errors)
    status, output, errors = run(takt, "component", "types", AMENT_PREFIX_PATH=str(work / "install"))
    check("takt finds the component", "sky_components::Watcher" in output, output, errors)
    status, output, errors = run("ctest", "--test-dir", work / "build/sky_library", "--no-tests=error")
    check("tests of GoogleTest run", status == 0, output, errors)


# With pluginlib everything was refused that loads classes; projects without a package.xml were no packages.
def test_libraries_of_robots(work):
    base = ("--build-base", work / "overlay_build", "--install-base", work / "overlay")
    status, output, errors = run(takt, "ros2", "build", packages.parent / "overlay", *base)
    check("a workspace with its own class_loader and libstatistics_collector builds, these first", status == 0 and
          max(output.index("] class_loader\n"), output.index("] libstatistics_collector\n")) < output.index("] a_sky_plugins\n"),
          output, errors)
    check("a project without a package.xml is built when a package needs it", "] sky_plain\n" in output, output)
    status, output, errors = run(work / "overlay/lib/a_sky_plugins/plugins")
    check("components register with the workspace's class_loader", status == 0 and
          output == "::rclcpp_components::NodeFactoryTemplate<Plugin>\nplain /diagnostics\n", output, errors)
    index = work / "overlay/share/ament_index/resource_index/exported_classes/a_sky_plugins"
    check("a package's extension is included at the end of those that use it",
          index.is_file() and index.read_text() == "Plugin\n")


# A name that follows the program is the program's, also if it looks like an option of the command.
def test_run(work):
    measure = ("run", "--install-base", work / "install", "sky_nodes", "measure")
    status, output, errors = run(takt, "ros2", *measure, "--help", "--ros-args", "-r", "a:=b", "--", "--install-base")
    check("takt ros2 run starts it", status == 0 and output == "the lowest cloud is at 1000 m\n", output, errors)
    status, output, errors = run(takt, "ros2", "run", "sky_nodes", "measure", AMENT_PREFIX_PATH=str(work / "install"))
    check("it is found in AMENT_PREFIX_PATH", status == 0, output, errors)
    for words, message in ((("sky_node", "measure"), "did you mean 'sky_nodes'?"),
                           (("sky_nodes", "mesure"), "package 'sky_nodes' has no program 'mesure'; did you mean 'measure'?")):
        status, _, errors = run(takt, "ros2", *measure[:3], *words)
        check(f"'{message}'", status == 2 and message in errors, errors)
    status, output, errors = run(takt, "ros2", *measure[:3], "sky_components", "watch", "--ros-args", "-r", "__node:=guard")
    check("it gets its arguments", status == 0 and "[guard]: it has 3 clouds" in output + errors, output, errors)


def configure(work, text, *options, **more):
    """Of a package with this CMakeLists.txt: what CMake complains of, in one line."""
    source = work / "bad"
    source.mkdir(exist_ok=True)
    (source / "CMakeLists.txt").write_text("cmake_minimum_required(VERSION 3.8)\nproject(bad LANGUAGES NONE)\n" + text)
    status, _, errors = run("cmake", "-S", source, "-B", source / "build", "--fresh",
                            f"-DCMAKE_PREFIX_PATH={prefix}", *options, **more)
    return "" if status == 0 else " ".join(errors.split()) or "nothing"


def test_refusals(work):
    for text, message in (
            ("find_package(ament_cmake REQUIRED)\nfind_package(tf2_ros REQUIRED)",
             "bad needs the package tf2_ros, which is not part of Takt's layer for rclcpp: build its source"),
            ("find_package(rclcpp REQUIRED)\nfind_package(rosbag2_cpp REQUIRED)",
             "bad needs the package rosbag2_cpp, which Takt's layer for rclcpp can never have"),
            ("find_package(rclcpp REQUIRED)\nset(tinyxml2_DIR none)\nset(CMAKE_FIND_USE_CMAKE_SYSTEM_PATH OFF)\n"
             "set(CMAKE_FIND_USE_PACKAGE_REGISTRY OFF)\nset(CMAKE_FIND_USE_SYSTEM_ENVIRONMENT_PATH OFF)\n"
             "find_package(tinyxml2_vendor REQUIRED)",
             "bad needs tinyxml2_vendor, and CMake does not find tinyxml2: install it."),
            ("find_package(ament_cmake REQUIRED)\nadd_custom_target(x)\nament_target_dependencies(x std_msgs)",
             "std_msgs has not been found before; call find_package(std_msgs REQUIRED)"),
            ("find_package(ament_cmake REQUIRED)\nament_package()", "bad/package.xml; a package of ROS 2 has one")):
        errors = configure(work, text)
        check(f"'{message}'", message in errors, errors)
    errors = configure(work, "find_package(rosidl_default_generators REQUIRED)\n"
                             "rosidl_get_typesupport_target(t bad rosidl_typesupport_c)")
    check(proves("rclcpp_build.md", "for every type support of C++; others are an error"),
          "there are none in C or Python" in errors, errors)


# The library is the system's, whose older versions have no target with a namespace: camera_calibration_parsers.
def test_vendors(work):
    text = ("enable_language(CXX)\nfind_package(yaml_cpp_vendor REQUIRED)\n"
            "if(NOT TARGET yaml-cpp::yaml-cpp)\nmessage(FATAL_ERROR none)\nendif()")
    check("yaml_cpp_vendor finds the system's", configure(work, text) == "", configure(work, text))


# It was built, and its headers stood beside those of the layer.
def test_packages_of_the_layer(work):
    (work / "own/std_msgs").mkdir(parents=True)
    (work / "own/std_msgs/package.xml").write_text("<package><name>std_msgs</name></package>")
    status, output, errors = run(takt, "ros2", "build", work / "own")
    check("a package that the layer has is left out",
          status == 0 and "std_msgs: left out, as Takt's layer has it" in output, output, errors)


# Packages of both languages were refused, though those in C++ need nothing of rclpy: diagnostic_updater.
def test_python(work):
    text = "find_package(rclcpp REQUIRED)\nfind_package(rclpy REQUIRED)"
    check("rclpy is found", configure(work, text) == "", configure(work, text))


# They were left out, and what generates code was missing: generate_parameter_library.
def test_packages_in_python(work):
    if run("python3", "-c", "import setuptools")[0] != 0:
        print("left out: python3 has no setuptools")
        return
    maker, user = work / "python/sky_maker", work / "python/a_sky_user"
    (maker / "sky_maker").mkdir(parents=True)
    user.mkdir()
    for file, text in {
            maker / "package.xml": "<package><name>sky_maker</name><export><build_type>ament_python</build_type></export></package>",
            maker / "setup.py": "from setuptools import setup\nsetup(name='sky_maker', version='0.1.0', packages=['sky_maker'],"
                                "data_files=[('share/sky_maker', ['package.xml'])],"
                                "entry_points={'console_scripts': ['make_sky = sky_maker.make:main']})\n",
            maker / "sky_maker/make.py": "def main():\n    print('blue')\n",
            user / "package.xml": "<package><name>a_sky_user</name><depend>sky_maker</depend></package>",
            user / "CMakeLists.txt": "cmake_minimum_required(VERSION 3.18)\nproject(a_sky_user NONE)\nfind_program(maker make_sky REQUIRED)\n"
                                     "execute_process(COMMAND ${maker} OUTPUT_VARIABLE sky)\n"
                                     "if(NOT sky STREQUAL \"blue\\n\")\nmessage(FATAL_ERROR \"${sky}\")\nendif()\n"}.items():
        file.write_text(text)
    before = sorted(maker.rglob("*"))
    status, output, errors = run(takt, "ros2", "build", work / "python", "--build-base", work / "python_build", "--install-base",
                                 work / "python_install")
    check("a program in Python makes code for the next package, without a setup file", status == 0, output, errors)
    check("its data are installed", (work / "python_install/share/sky_maker/package.xml").is_file())
    check("its sources are left alone", sorted(maker.rglob("*")) == before, sorted(maker.rglob("*")))
    (maker / "setup.py").write_text("raise SystemExit(3)\n")
    status, output, errors = run(takt, "ros2", "build", maker, "--build-base", work / "python_build")
    check("a setup.py that fails is said", status == 1 and "error: sky_maker: setup.py has failed; to repeat it: " in errors, errors)


# Libraries of such a package were static, and could not become parts of shared ones: tf2.
def test_shared_libraries(work):
    text = "find_package(ament_cmake_ros REQUIRED)\nif(NOT BUILD_SHARED_LIBS)\nmessage(FATAL_ERROR static)\nendif()"
    check("ament_cmake_ros makes shared libraries", configure(work, text) == "", configure(work, text))


# Of two packages of one name, CMake would take one from here and another from there.
def test_real_ros2(work):
    other = work / "jazzy" / "share" / "rclcpp" / "cmake"
    other.mkdir(parents=True)
    (other / "rclcppConfig.cmake").write_text("set(rclcpp_FOUND ON)\n")
    root = work / "jazzy"
    text = "find_package(ament_cmake REQUIRED)"
    check("alone it configures", configure(work, text) == "", configure(work, text))
    message = f"A ROS 2 stands in the search path too, in {root}: Takt's layer for rclcpp stands in {prefix}."
    errors = configure(work, text, f"-DCMAKE_PREFIX_PATH={prefix};{root}")
    check("a ROS 2 behind the layer is refused", message in errors, errors)
    errors = configure(work, text, AMENT_PREFIX_PATH=f"{root}:/nowhere")
    check("a ROS 2 in the environment is refused", message in errors, errors)
    errors = configure(work, f"find_package(rclcpp REQUIRED PATHS {root} NO_DEFAULT_PATH)\n{text}")
    check(proves("rclcpp_build.md", "or one that was found before, is an error"),
          "rclcpp of a ROS 2 has been found before" in errors, errors)


# Debian has packages of these names, of ROS 1 or of 2022: headers of both stood side by side.
def test_ros_of_the_system(work):
    for name, tool in (("message_filters", "catkin"), ("octomap", "cmake")):
        for folder, file, text in (("share", "package.xml", f"<package><buildtool_depend>{tool}</buildtool_depend></package>"),
                                   ("lib/cmake", f"{name}Config.cmake", "")):
            (work / "system" / folder / name).mkdir(parents=True)
            (work / "system" / folder / name / file).write_text(text)
    system = f"list(APPEND CMAKE_SYSTEM_PREFIX_PATH {work}/system)\nfind_package(ament_cmake REQUIRED)\n"
    errors = configure(work, system + "find_package(message_filters REQUIRED)")
    check("Debian's packages of ROS are not found",
          "bad needs the package message_filters, which is not part" in errors, errors)
    check("what is not of ROS is found", configure(work, system + "find_package(octomap REQUIRED)") == "")
    known = {name for name in ("tf2", "message_filters", "class_loader", "rcutils", "ament_cmake", "ament_cmake_core",
                               "ament_index_cpp", "rcpputils") if os.path.isfile(f"/usr/share/{name}/package.xml")}
    for name in sorted(known):
        text = (f"enable_language(CXX)\nfind_package(ament_cmake REQUIRED)\nfind_package({name} QUIET)\n"
                f'if("${{{name}_DIR}}" MATCHES "^/(usr|lib)/")\nmessage(FATAL_ERROR "${{{name}_DIR}}")\nendif()')
        check(f"Debian's {name} is not found", configure(work, text) == "", configure(work, text))
    if not known:
        print("no package of Debian's ROS is installed here")


def test_folders(work):
    for folder, message in ((work / "none", "is no folder"), (work / "jazzy", "no package.xml is in it")):
        status, _, errors = run(takt, "ros2", "build", folder)
        check(f"{folder.name}: {message}", status == 2 and message in errors, errors)
    for name, need in (("one", "two"), ("two", "one")):
        (work / "circle" / name).mkdir(parents=True)
        (work / "circle" / name / "package.xml").write_text(
            f"<package><name>{name}</name><depend>{need}</depend></package>")
    status, _, errors = run(takt, "ros2", "build", work / "circle")
    check("packages that need each other are named", status == 2 and "in a circle: " in errors, errors)
    (work / "circle/two/package.xml").write_text("<package><name>one</name></package>")
    status, _, errors = run(takt, "ros2", "build", work / "circle")
    check("two packages of one name are named", status == 2 and "two packages are named one" in errors, errors)
    (work / "circle/one/CMakeLists.txt").write_text("message(FATAL_ERROR broken)\n")
    status, _, errors = run(takt, "ros2", "build", work / "circle/one")
    check(proves("command_line.md", "The exit status is 1 if a package does not build"),
          status == 1 and "one: CMake has failed" in errors, errors)


# They were not read: packages for ROS 1 and 2 asked for what is of the other.
def test_conditions(work):
    script = pathlib.Path(prefix, "share/takt_ros2/cmake/build.py")
    file = work / "package.xml"

    def kept(*conditions, **more):
        elements = "".join(f"<depend condition=\"{condition}\">p{i}</depend>" for i, condition in enumerate(conditions))
        file.write_text(f"<package><name>one</name>{elements}<export><build_type condition=\"$ROS_VERSION == 1\">catkin"
                        "</build_type></export></package>")
        status, output, errors = run(sys.executable, "-I", script, "--applying", file, **more)
        return [f"p{i}" in output for i in range(len(conditions))] if status == 0 and "catkin" not in output else errors

    truths = {"$ROS_VERSION == 2": True, "$ROS_VERSION == 1": False, "$ROS_DISTRO != 'humble'": True, "jazzy == $ROS_DISTRO": True,
              "$ROS_VERSION &gt;= 2 and $ROS_VERSION &lt; 3": True, "$NONE == ''": True, "$NONE == 1 or $ROS_VERSION == 2": True,
              "($ROS_VERSION == 1 or $ROS_VERSION == 2) and $ROS_DISTRO == 'iron'": False}
    check("conditions of package.xml", kept(*truths) == list(truths.values()), kept(*truths))
    check("ROS_DISTRO of the environment counts", kept("$ROS_DISTRO == iron", ROS_DISTRO="iron") == [True])
    for condition, message in (("$ROS_VERSION", "a comparison is missing"), ("($ROS_VERSION == 2", "a ')' is missing"),
                               ("$ROS_VERSION == ", "a word or a variable is missing"), ("1 == 1 2", "ends before its last word"),
                               ("% == 1", "'% == 1' is no part of a condition")):
        errors = kept(condition)
        check(f"a condition that is none: {condition}", isinstance(errors, str) and errors.startswith(f"error: {file}: ")
              and message in errors, errors)


# CMake stopped at the first one, and after each install at the next.
def test_what_is_missing(work):
    for name, needs in (("one", ("std_msgs", "tf2_ros", "rosbag2_cpp", "a_driver")), ("other", ("one", "a_driver", "urdf"))):
        (work / "missing" / name).mkdir(parents=True)
        (work / "missing" / name / "package.xml").write_text(
            f"<package><name>{name}</name>{''.join(f'<depend>{need}</depend>' for need in needs)}</package>")
    status, output, errors = run(takt, "ros2", "build", "--list", work / "missing")
    check("what is missing is listed before anything is built", status == 0 and output == "[1/2] one\n[2/2] other\n", output, errors)
    for message in ("note: one asks for tf2_ros, whose source is to be built before: https://github.com/",
                    "note: one asks for rosbag2_cpp, which Takt's layer for rclcpp can never have\n",
                    "note: other asks for urdf, whose source is to be built before: https://github.com/ros2/urdf, branch ros2\n",
                    "https://index.ros.org/p/NAME: a_driver (for one, other)\n"):
        check(f"'{message.strip()}'", message in errors, errors)
    check("and nothing else", len(errors.splitlines()) == 4, errors)


# SIGTERM ended the command, and its compilers went on.
def test_signal(work):
    (work / "slow").mkdir()
    (work / "slow/package.xml").write_text("<package><name>slow</name></package>")
    waits = ["sleep", str(10**6 + os.getpid())]
    (work / "slow/CMakeLists.txt").write_text(f"execute_process(COMMAND {' '.join(waits)})\n")

    def words_of(process):
        with contextlib.suppress(OSError):  # it has ended
            return pathlib.Path(process, "cmdline").read_text(encoding="utf-8", errors="replace").split("\0")[:2]

    def waiting():
        return waits in map(words_of, glob.glob("/proc/[0-9]*"))
    begun = subprocess.Popen([takt, "ros2", "build", work / "slow", "--build-base", work / "slow_build"], env=environment,
                             stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    check("a package is being built", eventually(waiting))
    begun.terminate()
    check("a signal ends the command", begun.wait(60) == -signal.SIGTERM, begun.returncode)
    check("and all that it has started", eventually(lambda: not waiting()))


with tempfile.TemporaryDirectory() as folder:
    for test in (test_packages, test_libraries_of_robots, test_refusals, test_vendors, test_packages_of_the_layer, test_python,
                 test_packages_in_python, test_shared_libraries, test_real_ros2, test_ros_of_the_system, test_folders, test_conditions,
                 test_what_is_missing, test_signal):
        test(pathlib.Path(folder).resolve())
finish()
