"""Two machines: network namespaces of their own, joined by a cable (veth), at 10.77.0.1 and .2.

SPDX-License-Identifier: Apache-2.0
"""
import atexit
import os
import shutil
import subprocess
import sys

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../cmake"))
from checks import eventually, skip  # noqa: E402


def ip(*words):
    return subprocess.run(["ip", *words], capture_output=True, text=True)


def inside(machine, *command):
    return ["ip", "netns", "exec", machine, *command]


def make_machines():
    """Their names. Their loopback interfaces are down, as the kernel makes them."""
    machines = [f"takt_{side}_{os.getpid()}" for side in ("left", "right")]
    left, right = machines
    if shutil.which("ip") is None:
        skip("there is no ip (apt-get install iproute2)")
    for machine in machines:
        atexit.register(ip, "netns", "delete", machine)
        if ip("netns", "add", machine).returncode != 0:
            skip("network namespaces take root")
    if ip("-n", left, "link", "add", "cable", "type", "veth",
          "peer", "name", "cable", "netns", right).returncode != 0:
        skip("no veth in this kernel")
    for number, machine in enumerate(machines, 1):
        ip("-n", machine, "address", "add", f"10.77.0.{number}/24", "dev", "cable")
        ip("-n", machine, "link", "set", "cable", "up")
    return machines


class Peer:
    """A process on a machine that answers each line by a line."""

    def __init__(self, machine, *command, **environment):
        self.process = subprocess.Popen(
            inside(machine, *command), env={**os.environ, **environment},
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def ask(self, *words):
        print(*words, file=self.process.stdin, flush=True)
        return self.process.stdout.readline().strip()

    def is_ready(self):
        return self.ask("ready") == "1"

    def close(self):
        self.process.stdin.close()
        self.process.wait()
