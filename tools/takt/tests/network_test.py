#!/usr/bin/env python3
"""Two machines (machines.py): topics and services pass, a cut cable heals, and datagrams that get
lost cost no reliable message.

usage: network_test.py NETWORK_HOST TAKT
"""
# SPDX-License-Identifier: Apache-2.0
import json
import os
import subprocess
import sys
import tempfile

from machines import Peer, eventually, inside, ip, make_machines
from checks import check, finish

program, takt = map(os.path.abspath, sys.argv[1:])


class Host(Peer):
    """See network_host.cpp."""

    def __init__(self, machine, name, other, loss=0):
        super().__init__(machine, program, name, other, str(loss),
                         ROS_AUTOMATIC_DISCOVERY_RANGE="SUBNET")

    def received(self):
        """How many messages, after how many of them something is missing, and how many of those
        that may get lost."""
        return tuple(map(int, self.ask("received").split()))


def all_are_ready(hosts):
    return all(host.is_ready() for host in hosts)


def all_are_lonely(hosts):
    return not any(host.is_ready() for host in hosts)


def answers(host):
    return host.ask("call", 7) == "7"


def pair(loss=0):
    return Host(left, "here", "there", loss), Host(right, "there", "here", loss)


left, right = make_machines()

# A system that files describe.
FILE = """
dds: {{domain: 0, discovery: subnet}}
container:
  components:
    - component: takt::Workload
      name: {}
      parameters: {}
"""
with tempfile.TemporaryDirectory() as folder:
    processes = []
    for machine, name, parameters in [
            (left, "talker", "{publishers: {topic: [imu], period_us: [10000], size_bytes: [64]}, "
                             "servers: {service: [add]}}"),
            (right, "listener", "{subscriptions: {topic: [imu]}, "
                                "clients: {service: [add], period_us: [10000]}}")]:
        path = os.path.join(folder, name)
        with open(path + ".yaml", "w") as file:
            file.write(FILE.format(name, parameters))
        processes.append(subprocess.Popen(
            inside(machine, takt, "run", path + ".yaml", "--duration", "4s",
                   "--json", path + ".json"), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
            text=True))
    said = [process.communicate()[1] for process in processes]
    rows = json.load(open(os.path.join(folder, "listener.json")))["runs"][0]["callbacks"]
    received = {row["kind"]: row["received"] for row in rows}
    # Each 10 ms for 4 s; how soon the hosts meet, and what the machine leaves to them, is its affair.
    check("`takt run` on two hosts: a topic and a service pass",
          50 < received["subscription"] <= 402 and 50 < received["client"] <= 402, received, said)

# What is on the loopback interface only hears nobody else, though Cyclone's sockets would.
FIRST_PORT = 7410 + 2 * 33  # of the first index that is not of ROS 2
KNOCK = f"""
import socket, time
knocking = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
knocking.connect(("10.77.0.1", {FIRST_PORT}))
try:
    for _ in range(500):
        knocking.send(b"anybody there?")
        time.sleep(0.02)
except ConnectionRefusedError:
    print("refused")
"""


def listens():
    sockets = subprocess.run(inside(left, "cat", "/proc/net/udp"),
                             capture_output=True, text=True).stdout
    return f" 00000000:{FIRST_PORT:04X} " in sockets


ip("-n", left, "link", "set", "lo", "up")
with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
    file.write("dds: {domain: 0, discovery: lo}\n"
               "container: {components: [{component: takt::Workload, name: lonely}]}\n")
    file.flush()
    process = subprocess.Popen(inside(left, takt, "run", file.name), stdout=subprocess.DEVNULL,
                               stderr=subprocess.PIPE, text=True)
    check("`discovery: lo` listens", eventually(listens))
answer = subprocess.run(inside(right, sys.executable, "-c", KNOCK),
                        capture_output=True, text=True).stdout
check("but not to another host", answer == "refused\n" and listens(), answer)
process.terminate()
said = process.communicate()[1]
check("and ends well", process.returncode == 0, said)

hosts = pair()
here, there = hosts
check("two hosts find each other", eventually(lambda: all_are_ready(hosts)))
for host in hosts:
    host.ask("publish", 100, 16)
check("topics pass in both directions",
      eventually(lambda: all(host.received()[:2] == (100, 0) for host in hosts)),
      here.received(), there.received())
check("services too", all(map(answers, hosts)))

ip("-n", left, "link", "set", "cable", "down")
for host in hosts:
    host.ask("publish", 100, 16)
ip("-n", left, "link", "set", "cable", "up")
check("what was sent while the cable was out for a moment comes later",
      eventually(lambda: all(host.received()[:2] == (200, 0) for host in hosts)),
      here.received(), there.received())

ip("-n", left, "link", "set", "cable", "down")
check("when it is out for long, the hosts lose each other",
      eventually(lambda: all_are_lonely(hosts)))
ip("-n", left, "link", "set", "cable", "up")
check("and find each other again", eventually(lambda: all_are_ready(hosts)))
for host in hosts:
    host.ask("publish", 100, 16)
check("topics go on", eventually(lambda: all(host.received()[:2] == (300, 0) for host in hosts)),
      here.received(), there.received())
check("services too", all(map(answers, hosts)))
for host in hosts:
    host.close()

hosts = pair(loss=50)
here, there = hosts
check("hosts that lose 5 % of their datagrams find each other",
      eventually(lambda: all_are_ready(hosts)))
for host in hosts:
    host.ask("publish", 1000, 16)
    host.ask("publish", 50, 200_000)
check("no reliable message is lost",
      eventually(lambda: all(host.received()[:2] == (1050, 0) for host in hosts)),
      here.received(), there.received())
check("though others are", all(host.received()[2] < 1050 for host in hosts),
      here.received(), there.received())
check("and no call", all(answers(host) for host in hosts for _ in range(50)))
for host in hosts:
    host.close()

finish()
