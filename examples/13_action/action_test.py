#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""An action between two processes: reached, rejected, cancelled. action_test.py TAKT CLIENT BUILD"""
import json
import os
import pathlib
import subprocess
import sys
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "cmake"))
from checks import check, environment, finish

takt, client, build = map(os.path.abspath, sys.argv[1:])
here = pathlib.Path(__file__).resolve().parent
environment["TAKT_COMPONENT_PATH"] = build
server = subprocess.Popen([takt, "run", here / "navigator.yaml"], env=environment,
                          stdout=subprocess.DEVNULL)
try:
    output = subprocess.run([client], env=environment, text=True, capture_output=True,
                          timeout=60).stdout
    check("a goal is rejected, one reached with feedback, one cancelled", output.splitlines() == [
        "rejected", "succeeded after 0.2 m, with feedback", "canceled of soon on the way, 1 goal"],
        output)
    services = json.loads(subprocess.run([takt, "service", "list", "--all", "--json", "-"],
                                         env=environment, text=True,
                                         capture_output=True).stdout)
    types = {row["service"]: row["type"] for row in services}
    check("the parts have ROS 2's names",
          types.get("/navigate_to_pose/_action/send_goal")
          == "demo_interfaces/action/Navigate_SendGoal", types)
finally:
    server.send_signal(2)
    server.wait(20)
finish()
