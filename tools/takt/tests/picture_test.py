#!/usr/bin/env python3
"""`takt graph` draws what a file describes, and what runs: boxes, edges, chains in colour, and in red what does not match.

usage: picture_test.py TAKT ROS2_PEER
"""
# SPDX-License-Identifier: Apache-2.0
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../cmake"))
from checks import check, environment, eventually, finish  # noqa: E402

takt = os.path.abspath(sys.argv[1])
folder = tempfile.TemporaryDirectory()
robot = os.path.join(folder.name, "robot.yaml")
with open(robot, "w") as file:
    file.write("""\
threads:
  urgent: {policy: SCHED_FIFO, priority: 80, affinity: [0]}
executors:
  hot: {type: events, scheduler: edf, threads: [urgent]}
chains:
  - {name: drive, path: [/lidar/scan_timer, /filter/scan, /motor/points], deadline: 20ms}
containers:
  - name: front
    components:
      - component: takt::Workload
        name: lidar
        executor: hot
        parameters:
          publishers: {topic: [scan, image], period_us: [10000, 100000], reliability: [reliable, best_effort]}
      - component: takt::Workload
        name: filter
        parameters: {relays: {input: [scan], output: [points]}}
  - name: back
    components:
      - {component: takt::Workload, name: motor, parameters: {subscriptions: {topic: [points, nothing]}}}
      - {component: takt::Workload, name: screen, parameters: {subscriptions: {topic: [image]}}}
""")


def graph(*words, **options):
    return subprocess.run([takt, "graph", *words], env=dict(environment, **options), text=True, capture_output=True,
                          stdin=subprocess.DEVNULL, timeout=60)


def picture(name, file=robot, **options):
    path = os.path.join(folder.name, name)
    done = graph(file, "-o", path, **options)
    return done, open(path).read() if os.path.exists(path) else ""


done = graph(robot, "--json", "-")
data = json.loads(done.stdout)
topics = {topic["name"]: topic for topic in data["topics"]}
check("the processes have their executors, also those that Takt assigns to a chain, and nodes",
      [(process["name"], [executor["name"] for executor in process["executors"]], [node["name"] for node in process["nodes"]])
       for process in data["processes"]] == [("front", ["hot", "drive"], ["/filter", "/lidar"]),
                                             ("back", ["drive", "default"], ["/motor", "/screen"])], data["processes"])
check("a thread has its policy, priority and CPUs",
      data["processes"][0]["executors"][0]["threads"] == [
          {"name": "urgent", "policy": "SCHED_FIFO", "priority": 80, "cpus": [0]}], data["processes"][0])
check("a timer's topic has a rate", topics["/scan"]["publishers"][0]["rate_hz"] == 100, topics["/scan"])
check("QoS that does not match is found between processes",
      topics["/image"]["mismatches"] == [
          {"from": "/lidar", "to": "/screen", "why": "less reliability is offered than asked for"}], topics["/image"])
done = graph(robot)
rows = {row.split()[0]: row for row in done.stdout.splitlines() if row.startswith("/")}
check("the table has a row for each topic", set(rows) == set(topics), done.stdout)
check("it says what does not match", rows["/nothing"].endswith("no publisher") and
      rows["/image"].endswith("asked for") and rows["/scan"].endswith(" -"), done.stdout)

done, text = picture("robot.dot")
names = {label: name for name, label in re.findall(r'^(n\d+) \[label="([^"\\]+)', text, re.M)}
edges = re.findall(r"^(\w+) -> (\w+) \[(.*)\];$", text, re.M)


def edge(start, end):
    return next((style for a, b, style in edges if (a, b) == (names[start], names[end])), "")


check("nodes are drawn once", sorted(names) == ["/filter", "/lidar", "/motor", "/screen"], text)
chain = re.search(r'fontcolor="(#\w+)", label="drive, deadline 20 ms"', text)
check("a chain has its colour in each process and between them",
      chain and all(f'color="{chain[1]}"' in edge(*pair) for pair in (("/lidar", "/filter"), ("/filter", "/motor"))), text)
check("what does not match is red", "#d00000" in edge("/lidar", "/screen") and "#d00000" not in edge("/lidar", "/filter"), text)
check("so is what nobody publishes", re.search(r'fontcolor="#d00000", label="/nothing\\nno publisher"', text), text)

hostile = os.path.join(folder.name, 'a"]; x [label="<b>.yaml')
shutil.copy(robot, hostile)
done, text = picture("hostile.dot", hostile)
check("a name cannot leave its quotes", 'digraph "' in text and r'\"]; x [label=\"<b>.yaml"' in text, text[:200])
if shutil.which("dot"):
    done, text = picture("robot.svg")
    check("graphviz lays it out", done.returncode == 0 and "<svg" in text and "/lidar" in text, done.stderr)
    done, text = picture("hostile.html", hostile)
    check("a page has no foreign elements", done.returncode == 0 and "<b>" not in text and "&lt;b&gt;" in text, text[:600])
    check("it has colours for a dark screen", "prefers-color-scheme: dark" in text and '.graph [fill="white"]' in text, text[:600])
    check("nor anything of a network",
          not re.search(r'(?:href|src)="http', text) and "<script" not in text, text[:600])
else:
    print("skipped: the layout, as there is no dot (apt-get install graphviz)")
done, text = picture("none.svg", PATH=folder.name)
check("without graphviz one sentence says what to install, before components are constructed",
      done.returncode == 2 and "apt-get install graphviz" in done.stderr and done.stderr.count("\n") == 1 and not text, done.stderr)
for words, said in (([robot, "-o", "robot.png"], ".svg, .html or .dot"), ([robot, "-o", "/nowhere/robot.dot"], "/nowhere/robot.dot"),
                    (["/nowhere.yaml"], "/nowhere.yaml")):
    done = graph(*words)
    check(f"takt graph {' '.join(words)} is refused", done.returncode in (1, 2) and said in done.stderr and
          done.stderr.count("\n") == 1, done.returncode, done.stderr)


# What runs: each container of the file says what it is made of, and DDS the topics of all.
def start(*words):
    return subprocess.Popen([takt, "run", *words], env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def names(of, key="name"):
    return [each[key] for each in of]


def now(*words):
    """The graph of what runs when its containers have the nodes of the file; busy machines discover late."""
    seen = {}

    def is_there():
        done = graph(*words, "--json", "-")
        seen.update(json.loads(done.stdout) if done.returncode == 0 else {"processes": []})
        return sorted(node for process in seen["processes"] for node in names(process["nodes"])) == sorted(wanted)
    check(f"takt graph {' '.join(words)} shows {wanted}", eventually(is_there), seen)
    return seen


done = graph("front")
check("of what does not run, one sentence", done.returncode == 1 and "container 'front' was not found" in done.stderr and
      done.stderr.count("\n") == 1, done.returncode, done.stderr)
done = graph()
check("so of a domain where nothing runs", done.returncode == 1 and done.stderr ==
      f"takt: nothing was discovered on DDS domain {environment['ROS_DOMAIN_ID']}; start a container there (--domain, "
      "ROS_DOMAIN_ID), or name a file\n", done.returncode, done.stderr)
running = start(robot)
wanted = ["/filter", "/lidar", "/motor", "/screen"]
running_data = now()
by_name = {process["name"]: process for process in running_data["processes"]}
check("what runs has the processes of its file, with executors, threads and callbacks",
      by_name == {process["name"]: process for process in data["processes"]}, running_data["processes"], data["processes"])
check("the same topics, with types, QoS, rates and what does not match", running_data["topics"] == data["topics"],
      running_data["topics"], data["topics"])
in_order = {step["process"]: [] for step in data["chains"][0]["steps"]}
for step in running_data["chains"][0]["steps"]:
    in_order[step["process"]].append(step)
check("and the same chains", sum(in_order.values(), []) == data["chains"][0]["steps"] and
      running_data["chains"][0]["deadline_us"] == 20000, running_data["chains"])
path = os.path.join(folder.name, "now.dot")
graph("-o", path)
text = open(path).read()
chain = re.search(r'fontcolor="(#\w+)", label="drive, deadline 20 ms"', text)[1]
names_drawn = {label: name for name, label in re.findall(r'^(n\d+) \[label="([^"\\]+)', text, re.M)}
between = re.search(rf"^{names_drawn['/filter']} -> {names_drawn['/motor']} \[(.*)\];$", text, re.M)
check("a chain has its colour between processes, in whatever order these come", between and f'color="{chain}"' in between[1], text)

stranger = start("--name", "stranger", "--load", "index")
load = [takt, "component", "load", "stranger", "takt::Workload", "--name"]
for node, *parameters in (("far", "-p", "publishers.topic:=[elsewhere]", "-p", "publishers.period_us:=[10000]"),
                          ("near", "-p", "subscriptions.topic:=[/scan]")):
    check(f"{node} is loaded", eventually(lambda: subprocess.run([*load, node, *parameters], env=environment).returncode == 0))
wanted = ["/far", "/filter", "/lidar", "/motor", "/near", "/screen"]
seen = now("front")
check("of one container, the processes are drawn that share its topics", sorted(names(seen["processes"])) == ["back", "front", "stranger"]
      and seen["title"] == "front", seen)
check("and no others' topics", "/elsewhere" not in names(seen["topics"]), seen["topics"])
done = graph("fornt")
check("a mistyped container is named with the one that is near", done.returncode == 1 and "did you mean '/front'" in done.stderr and
      done.stderr.count("\n") == 1, done.stderr)
done = graph(robot, "front")
check("a file is drawn alone", done.returncode == 2 and done.stderr.count("\n") == 1 and "is a file" in done.stderr, done.stderr)

# A program that is no container is drawn as far as DDS knows it.
peer = subprocess.Popen([sys.argv[2], "LOCALHOST", "spoken", "points"], env=environment, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL)


def spoken(words=()):
    """The graph, once the program is in it."""
    found = {}

    def is_there():
        found.update(json.loads(graph(*words, "--json", "-").stdout))
        return "/spoken" in names(found["topics"])
    check("a program that is no container is drawn", eventually(is_there), found)
    return found


seen = spoken()
other = [process for process in seen["processes"] if not process["container"]]
check("with its nodes, whose names it does not say", len(other) == 1 and names(other[0]["nodes"]) == ["?"], seen["processes"])
points = next(topic for topic in seen["topics"] if topic["name"] == "/points")
check("and what does not match its topics", {"from": "/filter", "to": "?", "why": "type takt/msg/Workload, not std_msgs/msg/String"}
      in points["mismatches"], points)
peer.stdin.close()
check("it ends", eventually(lambda: peer.poll() is not None))
for process in (running, stranger):
    process.send_signal(signal.SIGINT)
    check("it ends", process.wait(60) == 0)
finish()
