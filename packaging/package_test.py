#!/usr/bin/env python3
"""Debian packages as a user has them: in a clean Debian 12 they are installed, used and removed, after
which nothing of them is left. Takes root, and the network, from which apt has what they depend on.

usage: package_test.py FOLDER   (with the packages; the clean Debian stays there for the next time)
"""
# SPDX-License-Identifier: Apache-2.0
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "cmake"))
import abi  # noqa: E402
from checks import check, environment, finish, skip  # noqa: E402

folder = pathlib.Path(sys.argv[1]).resolve()
clean, root, archives = folder / "bookworm.tar", folder / "root", folder / "archives"
DOMAIN = environment["ROS_DOMAIN_ID"]
VERSION = next(line.split('"')[1] for line in (HERE.parent / "base/version.hpp").read_text().splitlines()
               if "define TAKT_VERSION" in line)
# Namespaces of their own, so that whatever goes wrong, no mount and no process is left.
ENTER = """
mount -t proc proc $1/proc; mount -t sysfs sysfs $1/sys; mount --rbind /dev $1/dev; mount -t tmpfs tmpfs $1/dev/shm
mount -t tmpfs tmpfs $1/tmp; mount --bind $2 $1/mnt; mount --bind $3 $1/var/cache/apt/archives
exec chroot $1 env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive \\
  ROS_DOMAIN_ID=$4 sh -c "$5"
"""
# What apt, dpkg and their kin write about themselves.
THEIRS = ("/var/lib/dpkg/", "/var/lib/apt/", "/var/cache/", "/var/log/", "/var/lib/systemd/", "/etc/ld.so.cache")
COPIES = tuple(f"/etc/{name}" for name in  # of what adds users
               ("passwd-", "group-", "shadow-", "gshadow-", "subuid-", "subgid-", ".pwd.lock"))


def inside(command, most=900):
    return subprocess.run(["unshare", "--mount", "--pid", "--fork", "--kill-child", "sh", "-c", ENTER, "sh", root,
                           folder, archives, DOMAIN, command], text=True, capture_output=True, timeout=most)


def step(what, command, says="", status=0):
    done = inside(command)
    check(what, done.returncode == status and says in done.stdout + done.stderr, done.returncode, done.stdout[-3000:],
          done.stderr[-3000:])
    return done.stdout


def unpack():
    if not clean.exists():
        made = subprocess.run(["mmdebstrap", "--variant=minbase", "--mode=root", "bookworm", clean], text=True,
                              capture_output=True)
        if made.returncode != 0:
            clean.unlink(missing_ok=True)
            check("mmdebstrap makes a clean Debian 12", False, made.stderr)
            finish()
    shutil.rmtree(root, ignore_errors=True)
    root.mkdir(parents=True)
    archives.mkdir(exist_ok=True)
    subprocess.run(["tar", "-C", root, "-xf", clean, "--exclude=./dev/*"], check=True)
    shutil.copy("/etc/resolv.conf", root / "etc/resolv.conf")


def files():
    paths = inside("find / -xdev \\( -path /proc -o -path /sys -o -path /dev -o -path /tmp -o -path /mnt -o -path /run "
                   "\\) -prune -o -print").stdout.splitlines()
    return {path for path in paths if not path.startswith(THEIRS) and path not in COPIES}


class Packages:
    """Installed from files, and purged. `beside`: what the steps need besides."""

    def __init__(self, names, beside=""):
        self.names = names
        self.paths = " ".join(f"/mnt/{path.name}" for path in sorted(folder.glob("*.deb"))
                              if path.name.split("_")[0] in names)
        self.beside = beside

    def __enter__(self):
        step("apt knows what there is", "apt-get update -q")
        simulated = step("apt finds what they depend on", f"apt-get install -s {self.paths} {self.beside}")
        others = [line.split()[1] for line in simulated.splitlines() if line.startswith("Inst ")]
        others = [name for name in others if name not in self.names]
        step(f"the others are there: {len(others)}", f"apt-get install -yq {' '.join(others)} && apt-mark auto "
             f"{' '.join(others)}")
        self.before = files()
        step(f"apt installs {', '.join(self.names)}", f"apt-get install -yq {self.paths}")
        return self

    def __exit__(self, *_):
        step("apt removes them", f"apt-get purge -yq {' '.join(self.names)}")
        after = files()
        check("nothing is left", after <= self.before, "\n".join(sorted(after - self.before)[:30]))
        check("nothing else is gone", self.before <= after, "\n".join(sorted(self.before - after)[:30]))


def use_command():
    robot = "/usr/share/doc/takt/examples/03_robot/robot.yaml"
    step("takt says its version", "takt --version", VERSION)
    step("takt checks an example", f"takt check {robot}", "valid")
    step("takt runs it", f"takt run {robot} --duration 2s", "callbacks")
    step("takt repeats a bundle", f"cd /tmp; takt compare {robot} --executors events,single_threaded --duration 500ms --repeat 6 --bundle "
         "robot.tar.zst && takt bundle robot.tar.zst --run --as-root", "(before)")
    step("takt finds RouDi", "takt doctor --json -; true", "RouDi is not running")  # or: iox-roudi is not installed
    step("there are pages for man", "zcat /usr/share/man/man1/takt-run.1.gz", "takt run [OPTIONS] [FILE]")
    step("a real-time test starts", "rt_no_allocation --rounds 1; test $? != 127")
    step("bash completes", "bash -c '. /usr/share/bash-completion/completions/takt; COMP_LINE=\"takt compo\"; "
         "COMP_POINT=10; _takt; echo ${COMPREPLY[@]}'", "component")


def use_service():
    step("the service's user is no one else", "id takt; getent passwd takt", "(realtime)")
    step("systemd understands the service", "systemd-analyze verify --man=no takt@robot.service")
    if inside("prlimit --rtprio=95:95 true").returncode != 0:
        print("skipped: limits; root itself may not raise them here, as in containers without CAP_SYS_RESOURCE")
    else:
        step("who logs in has the limits of the group",
             "useradd -G realtime alice; su alice -c 'ulimit -r; ulimit -l'; userdel alice", "95\nunlimited")
    step("the service's user runs a robot", "printf 'container: {components: [{component: takt::Workload}]}' "
         ">/etc/takt/robot.yaml; setpriv --reuid takt --regid takt --init-groups takt run /etc/takt/robot.yaml "
         "--duration 500ms; status=$?; rm /etc/takt/robot.yaml; exit $status", "processes")


def build(what, files, options=""):
    """A project of these files in /tmp/app, whose program is `robot`."""
    make = "".join(f"mkdir -p $(dirname /tmp/app/{name}); cat >/tmp/app/{name} <<'END'\n{text}\nEND\n"
                   for name, text in files.items())
    step(what, f"{make} cmake -S /tmp/app -B /tmp/build {options} && cmake --build /tmp/build -j2 && /tmp/build/robot",
         "hello 5")


PROJECT = "cmake_minimum_required(VERSION 3.25)\nproject(app LANGUAGES CXX)\n"
RCLCPP = """#include <chrono>
#include <iostream>
#include "rclcpp/rclcpp.hpp"
#include "std_msgs/msg/int32.hpp"
int main(int argc, char** argv) {
  rclcpp::init(argc, argv);
  auto node = std::make_shared<rclcpp::Node>("app");
  auto publisher = node->create_publisher<std_msgs::msg::Int32>("count", 10);
  auto subscription = node->create_subscription<std_msgs::msg::Int32>("count", 10, [](const std_msgs::msg::Int32& said) {
    std::cout << "hello " << said.data << std::endl;
    if (said.data == 5) rclcpp::shutdown();
  });
  int count = 0;
  auto timer = node->create_wall_timer(std::chrono::milliseconds(10), [&] {
    publisher->publish(std_msgs::msg::Int32().set__data(++count));
  });
  rclcpp::spin(node);
}
"""


def build_programs():
    hello = (HERE.parent / "examples/01_hello/main.cpp").read_text()
    program = "add_executable(robot main.cpp)\n"
    build("two lines of CMake build a program", {"main.cpp": hello, "CMakeLists.txt": PROJECT + program
          + "find_package(takt REQUIRED)\ntarget_link_libraries(robot PRIVATE takt::takt)\n"})
    build("a message of one's own takes one more", {
        "msg/Count.msg": "int32 number", "CMakeLists.txt": PROJECT + program
        + "find_package(takt REQUIRED)\ntarget_link_libraries(robot PRIVATE takt::takt)\n"
          "takt_add_messages(robot msg/Count.msg PACKAGE app)\n",
        "main.cpp": "#include <app/msg/count.hpp>\n#include <cstdio>\nint main() { app::msg::Count count; "
                    "count.number = 5; std::printf(\"hello %d\\n\", count.number); }"})
    build("an executor passes Takt's suite", {
        "main.cpp": (HERE.parent / "examples/15_executor/events_pool.cpp").read_text(),
        "run.cpp": "#include <cstdlib>\nint main() { return std::system(\"/tmp/build/suite --gtest_brief=1 "
                   "--gtest_filter='*/events_pool_*' && echo hello 5\"); }",
        "CMakeLists.txt": PROJECT + "find_package(GTest REQUIRED)\nfind_package(takt REQUIRED)\n"
        "add_executable(suite main.cpp)\nset_target_properties(suite PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 0)\n"
        "target_link_libraries(suite PRIVATE takt::conformance)\nadd_executable(robot run.cpp)\n"})
    build("a program for rclcpp builds and runs", {"main.cpp": RCLCPP, "CMakeLists.txt": PROJECT + program
          + "find_package(rclcpp REQUIRED)\nfind_package(std_msgs REQUIRED)\n"
            "target_link_libraries(robot PRIVATE rclcpp::rclcpp std_msgs::std_msgs)\n"},
          "-D CMAKE_PREFIX_PATH=$(takt ros2 prefix)")


def compare_symbols():
    """With those stored for this minor version."""
    library = next(folder.glob("libtakt0.1_*.deb"))
    with tempfile.TemporaryDirectory() as unpacked:
        subprocess.run(["dpkg-deb", "--extract", library, unpacked], check=True)
        may_be, why = abi.compare(next(pathlib.Path(unpacked).rglob("libtakt.so.*.*.*")))
    check("public symbols are as they were in this minor version", may_be, why)


compare_symbols()
if os.geteuid() != 0:
    skip("a clean Debian takes root: sudo ./dev package --test")
unpack()
RUN_TIME = ["takt", "libtakt0.1", "takt-doc"]
with Packages(RUN_TIME, "iceoryx systemd"):
    use_command()
    use_service()
with Packages([*RUN_TIME, "libtakt-rclcpp0.1", "libtakt-dev", "libtakt-rclcpp-dev", "takt-lttng"], "g++ cmake"):
    build_programs()
finish()
