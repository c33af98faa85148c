#!/usr/bin/env python3
"""Two hosts: network namespaces of their own, joined by a cable (veth). Topics and services pass, a
cut cable heals, and datagrams that get lost cost no reliable message.

usage: network_test.py NETWORK_HOST TAKT
"""
# SPDX-License-Identifier: Apache-2.0
import atexit
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../cmake"))
from checks import check, finish, skip  # noqa: E402

program, takt = map(os.path.abspath, sys.argv[1:])
left, right = (f"takt_{side}_{os.getpid()}" for side in ("left", "right"))


def ip(*words):
    return subprocess.run(["ip", *words], capture_output=True, text=True)


def eventually(condition):
    for _ in range(3000):
        if condition():
            return True
        time.sleep(0.02)
    return False


class Host:
    """A process in a namespace, see network_host.cpp."""

    def __init__(self, namespace, name, other, loss=0):
        self.process = subprocess.Popen(
            ["ip", "netns", "exec", namespace, program, name, other, str(loss)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def ask(self, *words):
        print(*words, file=self.process.stdin, flush=True)
        return self.process.stdout.readline().strip()

    def received(self):
        """How many messages, after how many of them something is missing, and how many of those
        that may get lost."""
        return tuple(map(int, self.ask("received").split()))

    def close(self):
        self.process.stdin.close()
        self.process.wait()


def all_are_ready(hosts):
    return all(host.ask("ready") == "1" for host in hosts)


def all_are_lonely(hosts):
    return all(host.ask("ready") == "0" for host in hosts)


def answers(host):
    return host.ask("call", 7) == "7"


def pair(loss=0):
    return Host(left, "here", "there", loss), Host(right, "there", "here", loss)


if shutil.which("ip") is None:
    skip("no ip (package iproute2)")
for namespace in (left, right):
    atexit.register(ip, "netns", "delete", namespace)
    if ip("netns", "add", namespace).returncode != 0:
        skip("network namespaces take root")
if ip("-n", left, "link", "add", "cable", "type", "veth",
      "peer", "name", "cable", "netns", right).returncode != 0:
    skip("no veth in this kernel")
for number, namespace in enumerate((left, right), 1):
    ip("-n", namespace, "address", "add", f"10.77.0.{number}/24", "dev", "cable")
    ip("-n", namespace, "link", "set", "cable", "up")

# A system that files describe.
FILE = """
dds: {{domain: 0, loopback_only: false}}
container:
  components:
    - component: takt::Workload
      name: {}
      parameters: {}
"""
with tempfile.TemporaryDirectory() as folder:
    processes = []
    for namespace, name, parameters in [
            (left, "talker", "{publishers: {topic: [imu], period_us: [10000], size_bytes: [64]}, "
                             "servers: {service: [add]}}"),
            (right, "listener", "{subscriptions: {topic: [imu]}, "
                                "clients: {service: [add], period_us: [10000]}}")]:
        path = os.path.join(folder, name)
        with open(path + ".yaml", "w") as file:
            file.write(FILE.format(name, parameters))
        processes.append(subprocess.Popen(
            ["ip", "netns", "exec", namespace, takt, "run", path + ".yaml", "--duration", "4s",
             "--json", path + ".json"], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
            text=True))
    said = [process.communicate()[1] for process in processes]
    rows = json.load(open(os.path.join(folder, "listener.json")))["runs"][0]["callbacks"]
    received = {row["kind"]: row["received"] for row in rows}
    check("`takt run` on two hosts: a topic and a service pass",
          received["subscription"] > 50 and received["client"] > 50, received, said)

# What is on the loopback interface only hears nobody else, though Cyclone's sockets would.
FIRST_PORT = 7410
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
    sockets = subprocess.run(["ip", "netns", "exec", left, "cat", "/proc/net/udp"],
                             capture_output=True, text=True).stdout
    return f" 00000000:{FIRST_PORT:04X} " in sockets


ip("-n", left, "link", "set", "lo", "up")
process = subprocess.Popen(["ip", "netns", "exec", left, takt, "run", "--name", "lonely"],
                           env={**os.environ, "ROS_DOMAIN_ID": "0"}, stdout=subprocess.DEVNULL,
                           stderr=subprocess.PIPE, text=True)
check("`takt run --name` listens", eventually(listens))
answer = subprocess.run(["ip", "netns", "exec", right, sys.executable, "-c", KNOCK],
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
