#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What another process on the domain sees of the talker, the listener and the drive, as
docs/how_to/talk_to_ros2.md promises. ros2_test.py TAKT BUILD

Not a ROS 2, which this machine has not, but what it would see: by `takt topic` and `takt node`."""
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "cmake"))
from checks import check, environment, finish

takt, build = map(os.path.abspath, sys.argv[1:])
here = pathlib.Path(__file__).resolve().parent
environment["TAKT_COMPONENT_PATH"] = build


def ask(*arguments):
    return subprocess.run([takt, *arguments], env=environment, text=True, capture_output=True,
                          timeout=60).stdout


log = tempfile.TemporaryFile("w+")
process = subprocess.Popen([takt, "run", here / "talker.yaml"], env=environment,
                           stdout=subprocess.DEVNULL, stderr=log)
try:
    time.sleep(2)
    nodes = [row["node"] for row in json.loads(ask("node", "list", "--json", "-"))]
    check("its nodes are seen", {"/takt_talker", "/takt_listener"} <= set(nodes), nodes)
    heard = json.loads(ask("topic", "echo", "/chatter", "-n", "1", "--json", "-") or "{}")
    check("its messages are heard", heard.get("data", "").startswith("Hello World: "), heard)
    ask("topic", "pub", "/chatter", "std_msgs/msg/String", "{data: from outside}")
    line = ask("topic", "echo", "/rosout", "-n", "1", "--json", "-", "--duration", "5s") or "{}"
    check("what it logs is on /rosout", json.loads(line).get("name") == "takt_listener", line)
finally:
    process.send_signal(2)
    process.wait(20)
log.seek(0)
text = log.read()
check("it hears others, and itself", "I heard: [from outside]" in text and
      "I heard: [Hello World: 1]" in text, text)

# The page showed a container whose topic has a type of Takt's, so that `ros2 topic hz` knew nothing of it, and a
# launch file whose recorder the container refused.
page = (here.parents[1] / "docs/how_to/talk_to_ros2.md").read_text()
for name in ("talker.yaml", "control.yaml", "robot.launch.py"):
    lines = (here / name).read_text().splitlines(True)
    while name != "control.yaml" and lines[0].startswith("#"):
        lines.pop(0)
    check(f"the page shows {name}", "\n" + "".join(lines) + "```\n" in page)
folder = pathlib.Path(tempfile.mkdtemp())
shutil.copy(here / "control.yaml", folder)
process = subprocess.Popen([takt, "run", folder / "control.yaml"], env=environment,
                           stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
try:
    for _ in range(10):
        if "/cmd_vel" in ask("topic", "list"):
            break
    kinds = {topic: ask("topic", "type", topic).strip() for topic in ("/cmd_vel", "/joy")}
    check("its types are ROS 2's", kinds == {"/cmd_vel": "geometry_msgs/msg/Twist",
                                             "/joy": "sensor_msgs/msg/Joy"}, kinds)
    row = json.loads(ask("topic", "hz", "/cmd_vel", "--duration", "3s", "--json", "-") or "{}")
    check("it drives", row.get("messages", 0) > 0, row)
    check("it has parameters", "speed" in ask("param", "list", "/drive"))
    loaded = ask("component", "load", "/control", "takt::Recorder", "--name", "recorder", "-p", "file:=drive.mcap")
    check("the recorder is loaded", loaded.endswith("/recorder\n"), loaded)
finally:
    process.send_signal(2)
    status = process.wait(20)
check("the launched program ends well, so launch says no [ERROR]", status == 0, status)
check("and has recorded", (folder / "drive.mcap").exists())
finish()
