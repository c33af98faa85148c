#!/usr/bin/env python3
"""Builds packages written for ROS 2, with what they need first: `takt ros2 build` runs it.

SPDX-License-Identifier: Apache-2.0
"""
import argparse
import configparser
import contextlib
import graphlib
import importlib.util
import operator
import os
import pathlib
import re
import signal
import subprocess
import sys
import xml.etree.ElementTree as xml

HERE = pathlib.Path(__file__).parent  # in the prefix, not where a link leads
LAYER = pathlib.Path(os.path.abspath(HERE.parents[2]))
IGNORED = ("COLCON_IGNORE", "AMENT_IGNORE", "CATKIN_IGNORE")
NEEDED_TO_BUILD = ("depend", "build_depend", "build_export_depend", "buildtool_depend",
                   "buildtool_export_depend")


class Wrong(Exception):
    """What is wrong with the words or files, where, what to do."""
    status = 2


class Failed(Wrong):
    """A package does not build."""
    status = 1


class Package:
    def __init__(self, file):
        self.folder = file.parent
        root = applying(file)
        self.name = (root.findtext("name") or "").strip()
        if not re.fullmatch(r"[A-Za-z][\w-]*", self.name):
            raise Wrong(f"{file}: '{self.name}' is no name of a package")
        self.type = (root.findtext("export/build_type") or "ament_cmake").strip()
        self.needs = [element.text.strip() for element in root
                      if element.tag in NEEDED_TO_BUILD and element.text]


class Project:
    """A project of CMake without a package.xml, such as urdfdom_headers: what it looks for is what it needs."""
    type = "cmake"

    def __init__(self, file):
        self.folder = file.parent
        try:
            text = re.sub(r"#.*", "", file.read_text(errors="replace"))
        except OSError as error:
            raise Wrong(f"{file}: {error}") from None
        name = re.search(r"^\s*project\s*\(\s*([A-Za-z][\w-]*)", text, re.MULTILINE | re.IGNORECASE)
        self.name = name[1] if name else None
        self.needs = re.findall(r"\bfind_package\s*\(\s*([\w-]+)", text, re.IGNORECASE)


COMPARISONS = {"==": operator.eq, "!=": operator.ne, "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge}


class Condition:
    """REP 149: comparisons of variables and words, with `and`, `or` and brackets."""
    TOKEN = re.compile(r"""\s*(?:(\(|\)|==|!=|<=|>=|<|>)|"([^"]*)"|'([^']*)'|(\$?[\w.-]+))""")

    def __init__(self, text):
        self.words, place = [], 0
        while text[place:].strip():
            match = self.TOKEN.match(text, place)
            if match is None:
                raise ValueError(f"'{text[place:].strip()}' is no part of a condition")
            self.words.append(match.groups())
            place = match.end()

    def holds(self):
        value = self.any()
        if self.words:
            raise ValueError("a condition ends before its last word")
        return value

    def any(self):
        value = self.all()
        while self.take(3, "or"):
            value = self.all() or value
        return value

    def all(self):
        value = self.one()
        while self.take(3, "and"):
            value = self.one() and value
        return value

    def one(self):
        if self.take(0, "("):
            value = self.any()
            if not self.take(0, ")"):
                raise ValueError("a ')' is missing")
            return value
        left, how = self.value(), self.words.pop(0)[0] if self.words else None
        if how not in COMPARISONS:
            raise ValueError(f"a comparison is missing: {', '.join(COMPARISONS)}")
        return COMPARISONS[how](left, self.value())

    def take(self, kind, word):
        found = bool(self.words) and self.words[0][kind] == word
        if found:
            self.words.pop(0)
        return found

    def value(self):
        if not self.words or self.words[0][0]:
            raise ValueError("a word or a variable is missing")
        _, double, single, word = self.words.pop(0)
        if word is None:
            return double if double is not None else single
        return os.environ.get(word[1:], "") if word.startswith("$") else word


# What a setup file of ROS 2 sets, which packages ask for before they find anything.
for variable, value in {"ROS_VERSION": "2", "ROS_DISTRO": "jazzy", "ROS_PYTHON_VERSION": "3"}.items():
    os.environ[variable] = os.environ.get(variable) or value


def applying(file):
    """package.xml without the elements whose condition does not hold."""
    try:
        root = xml.parse(file).getroot()
        for parent in root.iter():
            for element in list(parent):
                if not Condition(element.get("condition") or "1 == 1").holds():
                    parent.remove(element)
    except (OSError, xml.ParseError, ValueError) as error:
        raise Wrong(f"{file}: {error}") from None
    return root


def add_once(packages, package):
    other = packages.setdefault(package.name, package)
    if other.folder.resolve() != package.folder.resolve():
        raise Wrong(f"two packages are named {package.name}: {other.folder} and {package.folder}; give one of them")


def find_packages(folders):
    packages, projects = {}, {}
    for folder in folders:
        if not folder.is_dir():
            raise Wrong(f"{folder} is no folder")
        before = len(packages)
        for place, folders_inside, files in os.walk(folder):
            if any(name in files for name in IGNORED):
                folders_inside.clear()
            elif "package.xml" in files:
                folders_inside.clear()
                add_once(packages, Package(pathlib.Path(place, "package.xml")))
            elif "CMakeLists.txt" in files and not any(pathlib.Path(place).rglob("package.xml")):
                folders_inside.clear()
                project = Project(pathlib.Path(place, "CMakeLists.txt"))
                if project.name and pathlib.Path(place) == folder:
                    add_once(packages, project)
                elif project.name:
                    projects[project.name] = project
        if len(packages) == before and not any(
                folder.resolve() in (p.folder.resolve(), *p.folder.resolve().parents)
                for p in packages.values()):
            raise Wrong(f"{folder}: no package.xml is in it")
    while needed := [need for package in packages.values() for need in package.needs
                     if need in projects and need not in packages]:
        for need in needed:
            add_once(packages, projects[need])
    return packages


# What packages of the layer use when a workspace has it.
USED_BY_THE_LAYER = {"rclcpp": ["libstatistics_collector"], "rclcpp_action": ["libstatistics_collector"],
                     "rclcpp_lifecycle": ["libstatistics_collector"], "rclcpp_components": ["class_loader", "libstatistics_collector"]}


def in_order(packages):
    graph = {name: [one for need in package.needs for one in (need, *USED_BY_THE_LAYER.get(need, ()))
                    if one in packages and one != name]
             for name, package in packages.items()}
    try:
        return [packages[name] for name in graphlib.TopologicalSorter(graph).static_order()]
    except graphlib.CycleError as error:
        raise Wrong("these packages need each other in a circle: " + " -> ".join(error.args[1])) from None


def list_of(kind):
    text = (HERE / "absent.cmake").read_text()
    return re.search(rf"set\(takt_ros2_absent_{kind}\s+([^)]*)\)", text)[1]


def sources():
    """Package -> the place of its source, and the branch that was tried."""
    return {name: words.split()[0].replace("@", ", branch ") for words in re.findall(r'"([^"]*)"', list_of("source"))
            for name in words.split()[1:]}


def is_there(name, options):
    prefixes = [str(LAYER), str(options.install_base)]
    for variable in ("CMAKE_PREFIX_PATH", "AMENT_PREFIX_PATH"):
        prefixes += re.split("[:;]", os.environ.get(variable, ""))
    return any(prefix and pathlib.Path(prefix, place, name).is_dir()
               for prefix in prefixes for place in ("share", "lib", "lib/cmake"))


def check_needs(packages, options):
    """All that is missing is reported before anything is built, with where it is to be had. What CMake
    finds all the same, or does not ask for, is no error."""
    reasons = {name: f"whose source is to be built before: https://{place}" for name, place in sources().items()}
    reasons |= dict.fromkeys(list_of("never").split(), "which Takt's layer for rclcpp can never have")
    asked, others = {}, {}
    for package in packages.values():
        if "catkin" in package.needs:
            raise Wrong(f"{package.folder}: {package.name} is a package of ROS 1; take its branch for ROS 2")
        if package.type not in BUILDERS:
            continue
        for need in dict.fromkeys(package.needs):
            if need not in packages and not is_there(need, options):
                (asked if need in reasons else others).setdefault(need, []).append(package.name)
    for need, names in asked.items():
        print(f"note: {', '.join(names)} asks for {need}, {reasons[need]}", file=sys.stderr, flush=True)
    if others:
        print("note: of the system (apt), or of https://index.ros.org/p/NAME: "
              + ", ".join(f"{need} (for {', '.join(names)})" for need, names in others.items()), file=sys.stderr, flush=True)


SIGNALS = {signal.SIGINT, signal.SIGTERM, signal.SIGHUP}
running = None  # in a group of its own: CMake leaves its compilers alone, and a signal is to end all


def end(number, _):
    if running is not None:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(running.pid, number)
    signal.signal(number, signal.SIG_DFL)
    os.kill(os.getpid(), number)  # a shell sees what has ended it


def run(package, what, command, folder=None):
    global running
    signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)  # until it is known
    running = subprocess.Popen(command, start_new_session=True, cwd=folder,
                               preexec_fn=lambda: signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS))
    signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
    status, running = running.wait(), None
    if status != 0:
        raise Failed(f"{package.name}: {what} has failed; to repeat it: {' '.join(map(str, command))}")


def build(package, options):
    folder = options.build_base / package.name
    prefixes = f"{LAYER};{options.install_base}"
    if more := os.environ.get("CMAKE_PREFIX_PATH"):
        prefixes += ";" + more.replace(":", ";")
    run(package, "CMake", ["cmake", "-S", package.folder, "-B", folder, f"-DCMAKE_PREFIX_PATH={prefixes}",
                           f"-DCMAKE_INSTALL_PREFIX={options.install_base}", "-DCMAKE_BUILD_TYPE=Release",
                           *options.cmake_args])
    jobs = str(options.jobs or os.cpu_count() or 1)
    run(package, "the compiler", ["cmake", "--build", folder, "-j", jobs])
    run(package, "installation", ["cmake", "--install", folder])


# A program finds its modules without a setup file.
PROGRAM = """#!{python}
import sys
sys.path.insert(0, {modules!r})
from {module} import {function}
sys.exit({function}())
"""


def build_python(package, options):
    """By Python's setuptools, into lib/python, with its programs in bin: generators of code, such as generate_parameter_library."""
    if importlib.util.find_spec("setuptools") is None:
        raise Failed(f"{package.name}: {sys.executable} has no setuptools, which its setup.py needs (apt-get install python3-setuptools)")
    folder, modules = options.build_base / package.name, options.install_base / "lib/python"
    folder.mkdir(parents=True, exist_ok=True)
    run(package, "setup.py", [sys.executable, "-B", "setup.py", "-q", "egg_info", "--egg-base", folder, "build", "--build-base", folder,
                              "install_lib", "--install-dir", modules, "install_data", "--install-dir", options.install_base],
        package.folder)
    for file in folder.glob("*.egg-info/entry_points.txt"):
        entries = configparser.ConfigParser(delimiters="=")
        entries.optionxform = str
        entries.read(file)
        for name, place in entries["console_scripts"].items() if "console_scripts" in entries else ():
            module, function = place.split(":")
            program = options.install_base / "bin" / name
            program.parent.mkdir(exist_ok=True)
            program.write_text(PROGRAM.format(python=sys.executable, modules=str(modules), module=module, function=function))
            program.chmod(0o755)


BUILDERS = {"ament_cmake": build, "cmake": build, "ament_python": build_python}


def main():
    for number in SIGNALS:
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, end)
    if sys.argv[1:2] == ["--applying"]:  # for ament_package_xml()
        try:
            print(xml.tostring(applying(pathlib.Path(sys.argv[2])), encoding="unicode"))
        except Wrong as error:
            sys.exit(f"error: {error}")
        return 0
    parser = argparse.ArgumentParser(
        prog="takt ros2 build", description="Builds packages written for ROS 2, in the order of their package.xml.")
    parser.add_argument("folders", metavar="DIR", nargs="+", type=pathlib.Path,
                        help="a package, or a folder of packages")
    parser.add_argument("--build-base", metavar="DIR", type=pathlib.Path, default="build",
                        help="where they are built (default: build)")
    parser.add_argument("--install-base", metavar="DIR", type=pathlib.Path, default="install",
                        help="where they are installed, all together (default: install)")
    parser.add_argument("-j", "--jobs", metavar="N", type=int, help="how many compilers run at once")
    parser.add_argument("--list", action="store_true", help="print the order, and build nothing")
    parser.add_argument("--cmake-args", metavar="ARG", nargs=argparse.REMAINDER, default=[],
                        help="all arguments behind it are given to CMake")
    options = parser.parse_args()
    options.build_base = options.build_base.absolute()
    options.install_base = options.install_base.absolute()
    try:
        packages = find_packages(options.folders)
        order = in_order(packages)
        check_needs(packages, options)
        for number, package in enumerate(order, 1):
            if package.type not in BUILDERS:
                print(f"[{number}/{len(order)}] {package.name}: left out, as it is of type {package.type}", flush=True)
                continue
            if (LAYER / "share" / package.name).is_dir():
                print(f"[{number}/{len(order)}] {package.name}: left out, as Takt's layer has it", flush=True)
                continue
            print(f"[{number}/{len(order)}] {package.name}", flush=True)
            if not options.list:
                BUILDERS[package.type](package, options)
    except Wrong as error:
        print(f"error: {error}", file=sys.stderr)
        return error.status
    return 0


if __name__ == "__main__":
    sys.exit(main())
