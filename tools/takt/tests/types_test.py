#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Types that takt knows from a library alone: no node describes them, and no definition is found.

usage: types_test.py TAKT LIBRARY OTHER_LIBRARY COMPONENTS: messages/testdata/weather.cpp, the same with
                     another layout of one type, and a library without types
"""
import json
import pathlib
import signal
import subprocess
import sys
import tempfile

from command import as_json, run, seen, takt
from checks import check, environment, finish

folder = pathlib.Path(tempfile.mkdtemp())
library, other, components = (str(pathlib.Path(path).resolve()) for path in sys.argv[2:5])
environment.pop("AMENT_PREFIX_PATH", None)
KNOWN = ("--library", library)


def system_file(name, *components):
    """Of a container with these components, of which none describes its types."""
    file = folder / f"{name}.yaml"
    lines = "".join(f"    - {{{component}, executor: one}}\n" for component in components)
    file.write_text(f"dds: {{domain: {environment['ROS_DOMAIN_ID']}, shared_memory: off, "
                    "parameter_services: false}\n"
                    f"executors: {{one: {{type: events}}}}\n"
                    f"container:\n  name: {name}\n  components:\n{lines}")
    return str(file)


class System:
    """It runs while the object lives."""

    def __init__(self, *what):
        self.process = subprocess.Popen([takt, "run", system_file(*what)], env=environment,
                                        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGINT)
        errors = self.process.communicate(timeout=60)[1]
        check("the system ends well", self.process.returncode == 0, errors)


ROOF = f"component: weather::Roof, library: {library}, name: roof"


def echoed(topic, *arguments):
    out = run("topic", "echo", topic, "-n", "1", "--json", "-", "--duration", "30s", *arguments).stdout
    return json.loads(out.splitlines()[0]) if out else None


def test_a_system_is_used():
    with System("robot", ROOF):
        seen(lambda rows: {"/station", "/wind"} <= {row["topic"] for row in rows}, "topic", "list")
        station = echoed("/station", *KNOWN)
        check("echo of a .msg", station["name"] == "roof" and station["celsius"] == [18.5, 19.0] and
              station["header"]["frame_id"] == "", station)
        wind = echoed("/wind", *KNOWN)
        check("echo of a struct", wind == {"speed": 2.5, "from": "west"}, wind)
        run("topic", "pub", "/wind_in", "weather/msg/Wind", "{speed: 7.5, from: north}", *KNOWN)
        for _ in range(20):  # it sends on what it receives
            wind = echoed("/wind", *KNOWN)
            if wind["speed"] == 7.5:
                break
        check("pub of a struct", wind == {"speed": 7.5, "from": "north"}, wind)
        answer = as_json("service", "call", "/calibrate", "{offset: 0.5}", *KNOWN)
        check("service call", answer == {"is_done": True, "celsius": 20.5}, answer)
        unknown = run("topic", "echo", "/wind", status=2).stderr
        check("without, the error says what can be done", "does not know the type weather/msg/Wind" in unknown
              and all(word in unknown for word in ("--library", "AMENT_PREFIX_PATH", "a node")), unknown)
        done = as_json("bag", "record", "/wind", "-o", str(folder / "wind.mcap"), "--duration", "2s", *KNOWN)
        check("record", done["messages"] > 10, done)
        rows = as_json("bag", "info", str(folder / "wind.mcap"))["topics"]
        check("with its definition", rows[0]["has_definition"], rows)


def test_a_recording_is_described():
    play = subprocess.Popen([takt, "bag", "play", str(folder / "wind.mcap"), "--loop", *KNOWN],
                            env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    seen(lambda rows: any(row["topic"] == "/wind" for row in rows), "topic", "list")
    wind = echoed("/wind")
    check("a player describes the type to a command that does not know it", wind["from"] == "north", wind)
    play.send_signal(signal.SIGINT)
    play.wait(60)


# The recorder knows the type from the library of another component.
def test_a_containers_recorder_knows_its_libraries():
    recorder = (f"component: takt::Recorder, name: recorder, parameters: {{file: {folder}/own.mcap, "
                "topics: [/there/wind]}")
    with System("there", ROOF + ", remap: {/wind: /there/wind}"):
        run("run", system_file("black_box", ROOF, recorder), "--duration", "3s")
    rows = as_json("bag", "info", str(folder / "own.mcap"))["topics"]
    check("so the recording has the definition", [row["has_definition"] for row in rows] == [True], rows)


def test_what_is_shown_and_refused():
    lines = run("interface", "show", "weather/msg/Wind", *KNOWN).stdout
    check("interface show", lines == "float64 speed\nstring from\n", lines)
    for words, message in {
            ("/nowhere/libnone.so",): "library '/nowhere/libnone.so' cannot be loaded",
            (components,): "registers no message type",
            (library, other): "register the message type weather/msg/Wind with different layouts"}.items():
        options = [word for path in words for word in ("--library", path)]
        wrong = run("topic", "echo", "/wind", *options, status=2)
        check(message, message in wrong.stderr, wrong.stderr)
    for command in (("topic", "echo"), ("topic", "pub"), ("service", "call"), ("bag", "play"),
                    ("bag", "record"), ("action", "send_goal"), ("interface", "show")):
        help_text = run(*command, "--help").stdout
        check(f"{' '.join(command)} --help", "--library" in help_text, help_text)
    check("with an example", "--library libweather.so" in run("topic", "--help").stdout)


test_a_system_is_used()
test_a_recording_is_described()
test_a_containers_recorder_knows_its_libraries()
test_what_is_shown_and_refused()
finish()
