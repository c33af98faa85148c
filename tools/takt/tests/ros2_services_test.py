#!/usr/bin/env python3
"""A response reaches a client of ROS 2 that asks as soon as it has found the service: a reader that has just discovered a
writer takes what comes before that writer's first heartbeat for older than itself (decision 0084).

usage: ros2_services_test.py TAKT ROS2_CLIENT
"""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import signal
import subprocess
import sys
import tempfile

from command import seen, takt
from checks import check, environment, finish

CLIENTS = 30
# As rmw_cyclonedds does it for ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST.
LOCALHOST = ("<CycloneDDS><Domain><General><AllowMulticast>false</AllowMulticast></General><Discovery>"
             "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>"
             "<Peers><Peer address='localhost'/></Peers></Discovery></Domain></CycloneDDS>")
folder = tempfile.TemporaryDirectory()
file = pathlib.Path(folder.name) / "robot.yaml"
file.write_text(f"dds: {{domain: {environment['ROS_DOMAIN_ID']}, shared_memory: off}}\ncontainer:\n  components:\n"
                "    - {component: takt::Workload, name: lidar, namespace: /front}\n")
robot = subprocess.Popen([takt, "run", str(file)], env=environment, stdout=subprocess.DEVNULL,
                         stderr=subprocess.DEVNULL)
try:
    seen(lambda rows: "/front/lidar" in [row["node"] for row in rows], "node", "list")
    # The first client comes to a service that has answered nobody, the others to one that has.
    done = subprocess.run([sys.argv[2], "/front/lidar", str(CLIENTS)], env={**environment, "CYCLONEDDS_URI": LOCALHOST},
                          text=True, capture_output=True, timeout=240)
    check(f"{CLIENTS} clients get their response", done.stdout == "0\n", done.stdout, done.stderr)
finally:
    robot.send_signal(signal.SIGINT)
    check("the robot ends", robot.wait(20) == 0, robot.returncode)
finish()
