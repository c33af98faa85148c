#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What another process on the domain sees of the talker and listener. ros2_test.py TAKT BUILD

Not a ROS 2, which this machine has not, but what it would see: by `takt topic` and `takt node`."""
import json
import os
import pathlib
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
    line = ask("topic", "echo", "/rosout", "-n", "1", "--json", "-", "--duration", "5") or "{}"
    check("what it logs is on /rosout", json.loads(line).get("name") == "takt_listener", line)
finally:
    process.send_signal(2)
    process.wait(20)
log.seek(0)
text = log.read()
check("it hears others, and itself", "I heard: [from outside]" in text and
      "I heard: [Hello World: 1]" in text, text)
finish()
