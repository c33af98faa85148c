#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""takt param, action and interface, between processes.

usage: ros2_commands_test.py TAKT PEERS_LIBRARY
"""
import json
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

from command import as_json, run, seen, takt
from checks import check, environment, finish, proves

library = str(pathlib.Path(sys.argv[2]).resolve())
folder = pathlib.Path(tempfile.mkdtemp())
SYSTEM = """
dds: {{domain: {domain}, shared_memory: off, parameter_services: {serves}}}
executors: {{one: {{type: events}}}}
container:
  name: {name}
  load: index
  components:
{components}
"""
ACTION = ("/fibonacci", "example_interfaces/action/Fibonacci")


class System:
    """A container that runs while the object lives: a name for each class."""

    def __init__(self, name, components, serves="true"):
        file = folder / f"{name}.yaml"
        lines = [f"    - {{component: peers::{kind}, library: {library}, name: {node}, "
                 f"namespace: {space}, executor: one}}" for kind, space, node in components]
        file.write_text(SYSTEM.format(domain=environment["ROS_DOMAIN_ID"], name=name, serves=serves,
                                      components="\n".join(lines)))
        self.names = {f"{space.rstrip('/')}/{node}" for _, space, node in components}
        self.process = subprocess.Popen([takt, "run", str(file)], env=environment,
                                        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def __enter__(self):
        seen(lambda rows: self.names <= {row["node"] for row in rows}, "node", "list")
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGINT)
        self.process.wait(20)


def parameters():
    return System("robot", [("Parameters", "/front", "lidar"), ("Parameters", "/", "other")])


def test_values_are_shown_as_ros2_shows_them():
    with parameters():
        for name, line in {
                "flag": "Boolean value is: True", "count": "Integer value is: 3",
                "gain.p": "Double value is: 1.0", "gain.i": "Double value is: 1e+20",
                "limit": "Double value is: inf", "word": "String value is: it's on",
                "bytes": "Byte values are: [0, 255]",
                "use_sim_time": "Boolean value is: False",
                "flags": "Boolean values are: [True, False]", "counts": "Integer values are: [1, 2]",
                "gains": "Double values are: [0.5, 2.0]",
                "words": "String values are: ['a', 'yes']"}.items():
            done = run("param", "get", "/front/lidar", name)
            check(f"{name}: {line}", done.stdout == line + "\n", done.stdout)
        hidden = run("param", "get", "front/lidar", "count", "--hide-type")
        check("only the value", hidden.stdout == "3\n", hidden.stdout)
        row = as_json("param", "get", "/front/lidar", "counts")
        check("as JSON", row == {"node": "/front/lidar", "name": "counts", "type": "integer array",
                                 "value": [1, 2]}, row)

        names = run("param", "list", "/front/lidar").stdout.splitlines()
        check("names, indented and sorted", "  count" in names and names == sorted(names), names)
        rows = seen(lambda rows: len(rows) == 3, "param", "list")
        check("of all nodes", [row["node"] for row in rows] == ["/front/lidar", "/other", "/robot"],
              rows)
        text = run("param", "list").stdout
        check("under the names of the nodes", text.startswith("/front/lidar:\n  "), text)

        text = run("param", "describe", "/front/lidar", "count", "fixed").stdout
        check("described", text ==
              "Parameter name: count\n  Type: integer\n  Description: how many\n  Constraints:\n"
              "    Min value: 0\n    Max value: 10\n"
              "Parameter name: fixed\n  Type: string\n  Constraints:\n    Read only: true\n", text)
        row = as_json("param", "describe", "/front/lidar", "count")[0]
        check("described as JSON", row["range"] == {"from_value": 0, "to_value": 10, "step": 0} and
              row["read_only"] is False and row["dynamic_typing"] is False, row)
        text = run("param", "describe", "/front/lidar", "any", "bytes").stdout
        check("what callbacks check, and bytes", text ==
              "Parameter name: any\n  Type: integer\n  Constraints:\n"
              "    Additional constraints: no list\n"
              "Parameter name: bytes\n  Type: byte array\n  Constraints:\n", text)
        row = as_json("param", "describe", "/front/lidar", "any")[0]
        check("of any type", row["dynamic_typing"] is True, row)


def test_values_are_set():
    with parameters():
        value = lambda name: as_json("param", "get", "/other", name)["value"]
        for name, text, expected in [
                ("flag", "false", False), ("count", "7", 7), ("gain.p", "2.5", 2.5),
                ("word", "hello", "hello"), ("word", "'5'", "5"), ("word", "", ""),
                ("word", "off", "off"), ("word", " ", " "), ("word", "a: b", "a: b"), ("word", "-x", "-x"),
                ("word", "!!str 010", "010"), ("flag", "on", True), ("flag", "off", False), ("count", "007", 7),
                ("counts", "[]", []), ("counts", "[4]", [4]),
                ("bytes", "[1, 2]", [1, 2]), ("any", "text", "text"), ("any", "[0.5]", [0.5]),
                ("use_sim_time", "true", True), ("use_sim_time", "false", False), ("words", "['5', b]", ["5", "b"])]:
            done = run("param", "set", "/other", name, text)
            check("and says so", done.stdout == "Set parameter successful\n", done.stdout)
            check(f"{name} is {expected}", value(name) == expected, value(name))
        for name, text, reason in [
                ("count", "high", "count"), ("count", "[1", "the value"), ("count", "11", "10"),
                ("count", "{a: 1}", "count"), ("flags", "[1, true]", "flags"),
                ("bytes", "[256]", "give a byte array"),
                ("fixed", "off", "fixed"), ("no_such", "1", "no_such")]:
            wrong = run("param", "set", "/other", name, text, status=2 if text[:1] in "[{" and text != "[256]" else 1)
            check(f"{name} {text}: the reason", reason in wrong.stderr and not wrong.stdout,
                  wrong.stderr)
        check("unchanged", value("count") == 7, value("count"))
        result = as_json("param", "set", "/other", "count", "8")
        check("set with JSON", result == {"successful": True, "reason": ""}, result)


# There was no `delete`.
def test_values_are_deleted():
    with parameters():
        done = run("param", "delete", "/other", "any")
        check("and says so", done.stdout == "Deleted parameter successfully\n", done.stdout)
        check("it is gone", "any" not in run("param", "list", "/other").stdout.split())
        for name in ("count", "fixed", "no_such"):
            wrong = run("param", "delete", "/other", name, status=1)
            check(f"{name}: the reason", "deleting parameter failed: " in wrong.stderr and name in wrong.stderr,
                  wrong.stderr)


def test_a_dump_is_loaded():
    with parameters():
        text = run("param", "dump", "/front/lidar").stdout
        check("ROS 2's form", text.startswith("/front/lidar:\n  ros__parameters:\n    ") and
              "\n    gain:\n      i: 1.0e+20\n      p: 1.0\n" in text and
              "\n    limit: .inf\n" in text, text)
        document = as_json("param", "dump", "/front/lidar")
        check("as JSON", document["/front/lidar"]["ros__parameters"]["gain"]["p"] == 1.0, document)
        run("param", "set", "/front/lidar", "counts", "[]")
        text = run("param", "dump", "/front/lidar").stdout
        # `fixed` can only be given at the start.
        file = folder / "dump.yaml"
        file.write_text("".join(line for line in text.splitlines(True) if "fixed" not in line))
        run("param", "set", "/front/lidar", "words", "[changed]")
        run("param", "set", "/front/lidar", "gain.i", "0.5")
        loaded = run("param", "load", "/front/lidar", str(file))
        check("a line for each", "Set parameter gain.p successful\n" in loaded.stdout, loaded.stdout)
        check("all is as it was", run("param", "dump", "/front/lidar").stdout == text)

        file.write_text(text)
        wrong = run("param", "load", "/front/lidar", str(file), status=1)
        check(proves("command_line.md", "If a parameter cannot be set, the others are set, and the exit status is 1"),
              wrong.returncode == 1 and "Set parameter fixed failed: " in wrong.stderr and
              "Set parameter words successful\n" in wrong.stdout, wrong.stderr)
        wrong = run("param", "load", "/other", str(file), status=2)
        check("a file for another node", "/front/lidar" in wrong.stderr, wrong.stderr)

        file.write_text("/front/lidar: {ros__parameters: {count: 2}}\n"
                        "front: {lidar: {ros__parameters: {gain: {p: 3.0}}}}\n"
                        "/**: {ros__parameters: {count: 1, word: all}}\n"
                        "/front/*: {ros__parameters: {gain.i: 4.0}}\n"
                        "/*: {ros__parameters: {word: wrong}}\n")
        rows = as_json("param", "load", "/front/lidar", str(file))
        check("its sections", {row["name"] for row in rows} == {"count", "word", "gain.i", "gain.p"},
              rows)
        for name, expected in {"count": 2, "word": "all", "gain.i": 4.0, "gain.p": 3.0}.items():
            value = as_json("param", "get", "/front/lidar", name)["value"]
            check(f"{name} is {expected}", value == expected, value)
        file.write_text("/front/lidar:\n  ros__parameters: [\n")
        wrong = run("param", "load", "/front/lidar", str(file), status=2)
        check("no YAML: the line", "dump.yaml:" in wrong.stderr, wrong.stderr)
        wrong = run("param", "load", "/front/lidar", str(folder / "none.yaml"), status=2)
        check("no file", "none.yaml" in wrong.stderr, wrong.stderr)


def test_who_has_no_parameters():
    with parameters(), System("silent", [("Mute", "/", "mute")], serves="false"):
        lost = run("param", "get", "/front/lidra", "count", status=1)
        check("an unknown node", "did you mean '/front/lidar'" in lost.stderr, lost.stderr)
        unknown = run("param", "get", "/front/lidar", "cout", status=1)
        check("an unknown parameter", "did you mean 'count'" in unknown.stderr, unknown.stderr)
        wrong = run("param", "describe", "/front/lidar", "count", "cout", status=1)
        check("one of two", "no parameter 'cout'" in wrong.stderr, wrong.stderr)

        seen(lambda rows: any(row["service"] == "/mute/list_parameters" for row in rows), "service",
             "list")
        mute = run("param", "list", "/mute", "--timeout", "500ms", status=1)
        check("no answer", "no response from node '/mute' within 500ms" in mute.stderr, mute.stderr)
        check(proves("command_line.md", "or a node does not answer, the error names it, and the exit status is 1"),
              [each.returncode for each in (lost, unknown, mute)] == [1, 1, 1])
        wrong = run("param", "list", "--timeout", "1s", status=1)
        check("the others are shown", "/front/lidar:\n" in wrong.stdout and "/other:\n" in wrong.stdout
              and "no response from node '/mute' within 1s" in wrong.stderr,
              wrong.stdout, wrong.stderr)


# One container that did not answer held up the list of all others, and so did a lifecycle node.
def test_one_that_does_not_answer():
    with System("robot", [("Stateful", "/", "stateful")]), System("silent", [("Mute", "/", "mute")], serves="false"):
        seen(lambda rows: any(row["service"] == "/mute/change_state" for row in rows), "service", "list")
        wrong = run("component", "list", status=1)
        check(proves("command_line.md", "Containers that do not answer `list` within 5 s are named after the others, and the exit status is 1"),
              wrong.returncode == 1 and "/stateful" in wrong.stdout and "silent" in wrong.stdout
              and "no response from container 'mute' within 5s" in wrong.stderr, wrong.stdout, wrong.stderr)
        wrong = run("graph", "--json", "-", status=1)
        drawn = [node["name"] for process in json.loads(wrong.stdout)["processes"] for node in process["nodes"]]
        check(proves("command_line.md", "If a container does not answer within 5 s, it is drawn as another program, and the exit status is 1"),
              wrong.returncode == 1 and "/stateful" in drawn and "no response from container 'mute' within 5s" in wrong.stderr,
              wrong.stdout, wrong.stderr)
        wrong = run("lifecycle", "list", status=1)
        check(proves("command_line.md", "Nodes that do not answer `list` within 5 s are named after the others, and the exit status is 1"),
              wrong.returncode == 1 and "/stateful" in wrong.stdout and "configure" in wrong.stdout
              and "no response from lifecycle node 'mute' within 5s" in wrong.stderr,
              wrong.stdout, wrong.stderr)


# What was not discovered in half a second or so was said not to be there: once in 65 times.
def test_an_empty_answer_is_believed_late():
    begin = time.monotonic()
    for listing in [subprocess.Popen([takt, *words], env=environment, stderr=subprocess.DEVNULL,
                                     stdout=subprocess.DEVNULL)
                    for words in (("lifecycle", "list"), ("component", "list"), ("param", "list"),
                                  ("service", "list"), ("action", "list"), ("node", "list"),
                                  ("topic", "list"), ("node", "info", "/lidar"))]:
        listing.wait(60)
        waited = time.monotonic() - begin
        check(f"takt {' '.join(listing.args[1:])} looks for 3 s", waited > 3, waited)


def goal(*arguments, status=0):
    return run("action", "send_goal", *ACTION, *arguments, status=status)


def test_actions():
    with System("server", [("Counter", "/", "counter")]):
        rows = seen(lambda rows: rows and "?" not in rows[0]["servers"], "action", "list")
        check("action list", rows == [{"action": "/fibonacci", "types": [ACTION[1]],
                                       "servers": ["/counter"], "clients": []}], rows)
        text = run("action", "list").stdout
        check("a name on each line", text == "/fibonacci\n", text)
        text = run("action", "list", "-t").stdout
        check("with its type", text == f"/fibonacci [{ACTION[1]}]\n", text)
        text = run("action", "info", "fibonacci", "-t").stdout
        check("action info", text == "Action: /fibonacci\nAction clients: 0\nAction servers: 1\n"
              f"    /counter [{ACTION[1]}]\n", text)
        check("action type", run("action", "type", "/fibonacci").stdout == ACTION[1] + "\n")
        wrong = run("action", "info", "/fibonaci", status=1)
        check("no such action", "did you mean '/fibonacci'" in wrong.stderr, wrong.stderr)

        text = goal("{order: 5}", "--feedback").stdout
        sequence = "    sequence: [0, 1, 1, 2, 3, 5]\n"
        lines = text.splitlines()
        check("the goal", lines[:3] == ["Waiting for an action server to become available...",
                                        "Sending goal:", "     order: 5"], text)
        check("its id", "Goal accepted with ID: " in text, text)
        check("its feedback", f"Feedback:\n{sequence}\n" in text, text)
        check("its result",
              text.endswith(f"Result:\n{sequence}\nGoal finished with status: SUCCEEDED\n"), text)
        row = as_json("action", "send_goal", *ACTION, "{order: 3}", "-f")
        check("as JSON", row["status"] == "SUCCEEDED" and row["result"] == {"sequence": [0, 1, 1, 2]}
              and row["feedback"] == [row["result"]] and len(row["goal_id"]) == 32, row)
        aborted = goal("{order: 10}", status=1)
        check("aborted", aborted.stdout.endswith("Goal finished with status: ABORTED\n"), aborted.stdout)
        wrong = goal("{order: 13}", status=1)
        check("rejected", "action '/fibonacci' rejected the goal" in wrong.stderr, wrong.stderr)
        check(proves("command_line.md", "The exit status is 1 if the goal is rejected, aborted or canceled"),
              wrong.returncode == aborted.returncode == 1)
        wrong = goal("{oder: 1}", status=2)
        check("a field that is none", "did you mean 'order'" in wrong.stderr, wrong.stderr)
        wrong = goal("{order: [", status=2)
        check("no YAML", "the message" in wrong.stderr, wrong.stderr)
        wrong = run("action", "send_goal", "/fibonacci", ACTION[1] + "s", "{}", status=2)
        check("a type that is none", "does not know the type" in wrong.stderr, wrong.stderr)
        wrong = run("action", "send_goal", "/fibonaci", ACTION[1], "{}", "--timeout", "500ms", status=1)
        check("no such server", "did you mean '/fibonacci'" in wrong.stderr, wrong.stderr)


class LongGoal:
    """A goal that is executed until it is canceled."""

    def __init__(self, order):
        self.process = subprocess.Popen([takt, "action", "send_goal", *ACTION, f"{{order: {order}}}"],
                                        env=environment, text=True, stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE)
        for line in self.process.stdout:
            if line.startswith("Goal accepted"):
                break

    def end(self):
        out, error = self.process.communicate(timeout=60)
        return self.process.returncode, out, error


def test_a_goal_is_canceled():
    with System("server", [("Counter", "/", "counter")]) as server:
        for sent, name in ((signal.SIGINT, "Ctrl-C"), (signal.SIGTERM, "SIGTERM")):
            long_goal = LongGoal(11)
            long_goal.process.send_signal(sent)
            status, out, error = long_goal.end()
            check(f"{name} cancels", status == 128 + sent and
                  out.endswith("Canceling goal...\nGoal canceled.\n"), status, out, error)
        long_goal = LongGoal(12)
        long_goal.process.send_signal(signal.SIGINT)
        status, out, error = long_goal.end()
        check("a server may refuse", status == 1 and
              "did not cancel the goal" in error, status, out, error)
        long_goal = LongGoal(12)
        server.__exit__()
        status, out, error = long_goal.end()
        # It aborts its goals; whether it still says so before it is gone is decided by the network.
        check("the server goes", status == 1 and out.endswith("Goal finished with status: ABORTED\n") or
              status == 1 and "the server of action '/fibonacci' has gone" in error, status, out, error)


def test_help():
    for command, sub in (("topic", "pub"), ("param", "set"), ("action", "info")):
        text = run(command, sub, "--help").stdout
        check("its example is of this command", f"\n  takt {command} " in text
              and "takt compare" not in text, text)
    text = run("component", "load", "--help").stdout
    check("load takes a package, perhaps, and a class", "CONTAINER [PACKAGE] CLASS\n" in text
          and "COMPONENT" not in text, text)


def test_interfaces():
    text = run("interface", "show", "geometry_msgs/msg/TwistStamped").stdout
    check("nested types are indented", text == (
        "std_msgs/Header header\n\tbuiltin_interfaces/Time stamp\n\t\tint32 sec\n\t\tuint32 nanosec\n"
        "\tstring frame_id\nTwist twist\n\tVector3 linear\n"
        "\t\tfloat64 x\n\t\tfloat64 y\n\t\tfloat64 z\n\tVector3 angular\n"
        "\t\tfloat64 x\n\t\tfloat64 y\n\t\tfloat64 z\n"), text)
    text = run("interface", "show", ACTION[1]).stdout
    check("an action", text == "int32 order\n---\nint32[] sequence\n---\nint32[] sequence\n", text)
    text = run("interface", "show", "std_srvs/srv/SetBool").stdout
    check("a service", text == "bool data\n---\nbool success\nstring message\n", text)
    rows = as_json("interface", "show", "std_srvs/srv/SetBool")
    check("as JSON", rows["response"]["fields"] == [{"name": "success", "type": "bool"},
                                                    {"name": "message", "type": "string"}], rows)
    rows = as_json("interface", "show", "action_msgs/msg/GoalStatus")
    check("constants", {"name": "STATUS_ABORTED", "type": "int8", "value": "6"} in rows["constants"],
          rows)
    nested = {field["name"]: field for field in rows["fields"]}["goal_info"]["definition"]
    check("nested", nested["type"] == "action_msgs/msg/GoalInfo" and
          [field["name"] for field in nested["fields"]] == ["goal_id", "stamp"], nested)
    rows = as_json("interface", "show", "geometry_msgs/msg/Quaternion")
    check("defaults", rows["fields"][3] == {"name": "w", "type": "float64", "default": "1"}, rows)
    text = run("interface", "show", "takt/msg/Workload").stdout
    check("a type of Takt's own", text != "" and "---" not in text and "===" not in text, text)
    wrong = run("interface", "show", "std_msgs/msg/Strin", status=2)
    check("no such type", "did you mean 'std_msgs/msg/String'" in wrong.stderr, wrong.stderr)
    wrong = run("interface", "show", "no_msgs/msg/Strin", status=2)
    check("no such package", "std_msgs" in wrong.stderr, wrong.stderr)


def test_a_component_is_loaded_into_a_container_of_ros2():
    load = ("component", "load", "/ros2_container")
    with System("robot", [("Ros2Container", "/", "ros2_container")]):
        loaded = run(*load, "demo_nodes_cpp", "demo_nodes_cpp::Talker")
        check("with its package", loaded.stdout == "1 demo_nodes_cpp/demo_nodes_cpp::Talker\n",
              loaded.stdout)
        wrong = run(*load, "demo_nodes_cpp::Talker", status=1)
        check("not without, which would end the container",
              "PACKAGE demo_nodes_cpp::Talker" in wrong.stderr, wrong.stderr)
        wrong = run(*load, "demo_nodes_cpp", "demo_nodes_cpp::Talker", "--executor", "fast", status=1)
        check("and without what it does not know", "leave out --executor" in wrong.stderr, wrong.stderr)
        loaded = run("component", "load", "robot", "any_package", "takt::Workload", "--name", "load")
        check("a container of Takt needs no package", loaded.stdout.endswith("/load\n"), loaded.stdout)
        wrong = run(*load, "any_package", "Crash", status=1)
        check("a container that ends is not waited for", "has gone without a response" in wrong.stderr,
              wrong.stderr)


def test_lifecycle_nodes():
    file = folder / "lifecycle.yaml"
    file.write_text(f"dds: {{domain: {environment['ROS_DOMAIN_ID']}, shared_memory: off}}\n"
                    "executors: {one: {type: events}}\ncontainer:\n  name: robot\n  components:\n"
                    "    - {component: takt::LifecycleWorkload, name: map, executor: one}\n"
                    "    - {component: takt::LifecycleWorkload, name: _hidden, executor: one}\n")
    robot = subprocess.Popen([takt, "run", str(file)], env=environment,
                             stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    seen(lambda rows: len(rows) == 2, "lifecycle", "list")
    check("lifecycle nodes", run("lifecycle", "nodes").stdout == "/map\n")
    check("hidden ones", run("lifecycle", "nodes", "-a", "-c").stdout == "2\n")
    text = run("lifecycle", "list", "map").stdout
    check("the transitions of one", "- configure [1]\n\tStart: unconfigured\n\tGoal: configuring\n" in text and
          "activate" not in text, text)
    robot.send_signal(signal.SIGINT)
    robot.wait(20)


def spider(serves="true"):
    return System("robot", [("Spider", "/", "spider")], serves)


def test_types_of_others_are_described_by_their_nodes():
    with spider():
        rows = as_json("topic", "echo", "/out", "-n", "1")
        check("a message", rows == {"name": "left", "note": "€",
                                    "joints": [{"angle": 1.0}, {"angle": 2.5}]}, rows)
        run("topic", "pub", "/in", "peer_msgs/msg/Leg", "{name: right, joints: [{angle: 7}]}")
        for _ in range(10):
            rows = as_json("topic", "echo", "/out", "-n", "1")
            if rows["name"] == "right":
                break
        check("published", rows == {"name": "right", "note": "", "joints": [{"angle": 7.0}]}, rows)
        wrong = run("topic", "pub", "/in", "peer_msgs/msg/Leg", "{nam: x}", status=2)
        check("a field that is none", "did you mean 'name'" in wrong.stderr, wrong.stderr)
        rows = as_json("service", "call", "/turn", "{by: [{angle: 1}, {angle: 2}]}")
        check("a service", rows == {"sum": {"angle": 3.0}}, rows)
        for _ in range(5):  # DDS orders what one topic carries: the result may come before the feedback
            rows = as_json("action", "send_goal", "/walk", "peer_msgs/action/Walk", "{to: {angle: 4}}", "-f")
            if rows["feedback"]:
                break
        check("an action", rows["result"] == {"said": "done"} and rows["feedback"] == [
            {"now": {"name": "left", "note": "ü", "joints": [{"angle": 4.0}]}}], rows)


# ROS 2 announces the hashes of a service's request and response, but describes neither: takt asked for the
# service by its request's hash, and the page said that this works.
def test_services_of_ros2_are_described_by_their_events_only():
    with System("robot", [("Ros2Turner", "/", "turner")], "false"):
        wrong = run("service", "call", "/turn", "{by: [{angle: 1}, {angle: 2}]}", status=2)
        check("the service is not described", "does not know the type peer_msgs/srv/Turn;" in wrong.stderr
              and "nodes of ROS 2 describe messages only" in wrong.stderr, wrong.stderr)
    with System("robot", [("IntrospectedTurner", "/", "turner")], "false"):
        rows = as_json("service", "call", "/turn", "{by: [{angle: 1}, {angle: 2}]}")
        check("its events are", rows == {"sum": {"angle": 3.0}}, rows)


def test_types_of_others_are_defined_by_files():
    with spider(serves="false"):
        wrong = run("topic", "echo", "/out", "-n", "1", status=2)
        check("neither described nor defined", "does not know the type peer_msgs/msg/Leg" in wrong.stderr
              and "AMENT_PREFIX_PATH" in wrong.stderr, wrong.stderr)
        for file, text in {"msg/Joint.msg": "float64 angle 0.5 # rad\n",
                           "msg/Leg.msg": "string name\nwstring note\nJoint[] joints\n",
                           "srv/Turn.srv": "Joint[2] by\n---\nJoint sum\n"}.items():
            path = folder / "install/share/peer_msgs" / file
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        environment["AMENT_PREFIX_PATH"] = str(folder / "install")
        rows = as_json("topic", "echo", "/out", "-n", "1")
        check("a message", rows["joints"] == [{"angle": 1.0}, {"angle": 2.5}], rows)
        rows = as_json("service", "call", "/turn", "{by: [{angle: 1}, {angle: 2}]}")
        check("a service", rows == {"sum": {"angle": 3.0}}, rows)
        text = run("interface", "show", "peer_msgs/msg/Leg").stdout
        check("is shown", text == "string name\nwstring note\nJoint[] joints\n\tfloat64 angle 0.5\n", text)
        del environment["AMENT_PREFIX_PATH"]


test_help()
test_interfaces()
test_types_of_others_are_described_by_their_nodes()
test_services_of_ros2_are_described_by_their_events_only()
test_lifecycle_nodes()
test_types_of_others_are_defined_by_files()
test_a_component_is_loaded_into_a_container_of_ros2()
test_values_are_shown_as_ros2_shows_them()
test_values_are_set()
test_values_are_deleted()
test_a_dump_is_loaded()
test_who_has_no_parameters()
test_one_that_does_not_answer()
test_an_empty_answer_is_believed_late()
test_actions()
test_a_goal_is_canceled()
finish()
