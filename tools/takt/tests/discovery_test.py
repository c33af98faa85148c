#!/usr/bin/env python3
"""Which processes meet with which settings, on two machines (machines.py). ROS 2's are Cyclone
alone, configured as rmw_cyclonedds does it (ros2_peer.cpp).

usage: discovery_test.py NETWORK_HOST ROS2_PEER TAKT
"""
# SPDX-License-Identifier: Apache-2.0
import os
import subprocess
import sys

from machines import Peer, eventually, inside, ip, make_machines
from checks import check, finish

network_host, ros2_peer, takt = map(os.path.abspath, sys.argv[1:])
for name in ("ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_STATIC_PEERS", "ROS_LOCALHOST_ONLY",
             "CYCLONEDDS_URI"):
    os.environ.pop(name, None)
os.environ["ROS_DOMAIN_ID"] = "0"


def pair(machines, **environment):
    return [Peer(machine, network_host, name, other, "0", **environment)
            for machine, name, other in zip(machines, ("here", "there"), ("there", "here"))]


def meet(peers):
    return eventually(lambda: all([peer.is_ready() for peer in peers]))


def close(peers):
    for peer in peers:
        peer.close()


class Command:
    """`takt topic` on a machine."""

    def __init__(self, machine, *words, **environment):
        self.process = subprocess.Popen(
            inside(machine, takt, "topic", *words), env={**os.environ, **environment},
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def close(self):
        self.process.terminate()
        return self.process.communicate()


def received_by(machine):
    """How many packets of IP have come to it."""
    said = subprocess.run(inside(machine, "cat", "/proc/net/snmp"), capture_output=True, text=True)
    names, values = [line.split() for line in said.stdout.splitlines() if line.startswith("Ip:")]
    return int(values[names.index("InReceives")])


def talk(ros2_range, ros2_machine=None, static_peers="", **environment):
    """Whether `takt` and a process of ROS 2 hear each other, and what was said."""
    hears = Command(left, "echo", "/ros2", **environment)
    says = Command(left, "pub", "/takt", "std_msgs/msg/String", "{data: hi}", "-r", "20",
                   **environment)
    ros2 = Peer(ros2_machine or left, ros2_peer, ros2_range, "ros2", "takt",
                ROS_STATIC_PEERS=static_peers)
    ready = eventually(ros2.is_ready)
    ros2.ask("publish")
    heard = eventually(lambda: int(ros2.ask("heard") or 0) > 0)
    line = hears.process.stdout.readline() if ready else ""
    ros2.close()
    said = says.close(), hears.close()
    return ready and heard and "hello" in line, line, said


left, right = make_machines()
for machine in (left, right):
    ip("-n", machine, "link", "set", "lo", "up")

# With nothing set, everything stays on the machine.
before = received_by(right)
check("ROS 2 in the range LOCALHOST meets Takt's default", *talk("LOCALHOST"))
neighbours = pair([left, left])
check("two processes of Takt meet", meet(neighbours))
check("nothing leaves the machine", received_by(right) == before, received_by(right), before)
check("ROS 2 in the range SUBNET, its default, meets Takt's default", *talk("SUBNET"))
for ros2_range in ("LOCALHOST", "SUBNET"):
    check(f"ROS 2 in the range {ros2_range} meets Takt in SUBNET",
          *talk(ros2_range, ROS_AUTOMATIC_DISCOVERY_RANGE="SUBNET"))
check("a process elsewhere that has this machine as its peer, too",
      *talk("LOCALHOST", right, "10.77.0.1"))
check("and so does one that this process has as its peer",
      *talk("LOCALHOST", right, ROS_STATIC_PEERS="10.77.0.2"))
check("ROS_LOCALHOST_ONLY is LOCALHOST, CYCLONEDDS_URI is heard last",
      *talk("LOCALHOST", ROS_LOCALHOST_ONLY="1", ROS_AUTOMATIC_DISCOVERY_RANGE="OFF",
            CYCLONEDDS_URI="<Discovery><SPDPInterval>100ms</SPDPInterval></Discovery>"))

# The network goes, and comes again.
for host in neighbours:
    host.ask("publish", 100, 16)
ip("-n", left, "address", "delete", "10.77.0.1/24", "dev", "cable")
for host in neighbours:
    host.ask("publish", 100, 16)
check("neighbours go on talking when the interface has lost its address",
      eventually(lambda: all(host.ask("received").startswith("200 0 ") for host in neighbours)))
close(neighbours)
neighbours = pair([left, left])
check("and meet when it never had one", meet(neighbours))
close(neighbours)
ip("-n", left, "address", "add", "10.77.0.1/24", "dev", "cable")

# Cyclone's threads are woken by the loopback interface.
lonely = Peer(left, network_host, "here", "there", "0")
lonely.ask("ready")
ip("-n", left, "link", "set", "lo", "down")
lonely.process.stdin.close()
check("a process ends when the loopback interface is down",
      eventually(lambda: lonely.process.poll() == 0))
lonely.process.kill()
ip("-n", left, "link", "set", "lo", "up")

# Takt announced itself four times a second to be found by newcomers: they are heard, and answered. Here nobody is
# found by an announcement, as there is only the first one.
never = "<Discovery><SPDPInterval>1000s</SPDPInterval><LeaseDuration>1000s</LeaseDuration></Discovery>"
for takt_range, ranges in (("LOCALHOST", ("LOCALHOST", "SUBNET")), ("SUBNET", ("LOCALHOST", "SUBNET"))):
    crowd = [Peer(left, network_host, f"one_{number}", f"other_{number}", "0", CYCLONEDDS_URI=never,
                  ROS_AUTOMATIC_DISCOVERY_RANGE=takt_range) for number in range(10)]
    check(f"10 processes of Takt start in the range {takt_range}", all(peer.ask("ready") == "0" for peer in crowd))
    for ros2_range in ranges:
        newcomer = Peer(left, ros2_peer, ros2_range, "ros2", "takt")
        check(f"a newcomer in the range {ros2_range} knows all nodes at once", newcomer.ask("nodes 10") != "")
        newcomer.close()
    close(crowd)

# Processes that are not to meet do not, while others do.
apart = pair([left, left], ROS_AUTOMATIC_DISCOVERY_RANGE="OFF")
machines_apart = pair([left, right])
machines_joined = [Peer(machine, network_host, name, other, "0",
                        ROS_AUTOMATIC_DISCOVERY_RANGE="SUBNET")
                   for machine, name, other in
                   zip((left, right), ("near", "far"), ("far", "near"))]
check("two machines meet in the range SUBNET", meet(machines_joined))
check("but not with the default", not any(peer.is_ready() for peer in machines_apart))
check("and processes in the range OFF never", not any(peer.is_ready() for peer in apart))
close(apart + machines_apart + machines_joined)

# ROS 2 has 32 indices on a machine, and half of them were Takt's; by one its newcomers are heard.
left_to_ros2 = 31
for takt_range in ("LOCALHOST", "SUBNET"):
    crowd = [Peer(left, network_host, f"one_{number}", f"other_{number}", "0",
                  ROS_AUTOMATIC_DISCOVERY_RANGE=takt_range) for number in range(20)]
    check(f"20 processes of Takt start in the range {takt_range}",
          all(peer.ask("ready") == "0" for peer in crowd))
    for ros2_range in ("LOCALHOST", "SUBNET"):
        check(f"then one of ROS 2 in the range {ros2_range} does", *talk(ros2_range))
    ros2 = [Peer(left, ros2_peer, "SUBNET", "ros2", "takt") for _ in range(left_to_ros2)]
    check(f"and {left_to_ros2} do", all(peer.ask("ready") == "0" for peer in ros2))
    close(crowd + ros2)

wrong = subprocess.run([takt, "topic", "list"], capture_output=True, text=True,
                       env={**os.environ, "ROS_AUTOMATIC_DISCOVERY_RANGE": "LAN"})
check("a range that there is not is an error",
      wrong.returncode == 2 and "LOCALHOST, SUBNET, OFF or SYSTEM_DEFAULT" in wrong.stderr,
      wrong.stderr)
wrong = subprocess.run([takt, "topic", "list"], capture_output=True, text=True,
                       env={**os.environ, "CYCLONEDDS_URI": "<Nonsense/>"})
check("a CYCLONEDDS_URI that Cyclone refuses, too",
      wrong.returncode == 2 and "CYCLONEDDS_URI" in wrong.stderr, wrong.stderr)

finish()
