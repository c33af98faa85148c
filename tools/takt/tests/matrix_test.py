#!/usr/bin/env python3
"""Each command that waits x what it may wait for: a peer that does not answer, one that floods, a pipe that nobody
reads, a child that is stopped. The first signal ends what only looks, and begins the end of what runs; a second one
ends that, too. What has not ended ten seconds later hangs.

usage: matrix_test.py TAKT WITNESS_LIBRARY
"""
# SPDX-License-Identifier: Apache-2.0
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time

from command import takt
from checks import check, environment, eventually, finish

library = os.path.abspath(sys.argv[2])
INT, KILL = signal.SIGINT, signal.SIGKILL
# What an idle machine has left over: this one compiles, perhaps.
SLACK = 6
folder = tempfile.TemporaryDirectory()
work = pathlib.Path(folder.name)
environment["WITNESS"] = folder.name
ROBOT = work / "robot.yaml"
ROBOT.write_text("dds: {shared_memory: off}\ncontainer:\n  name: robot\n  components:\n"
                 "    - {component: takt::Workload, name: w, parameters: {publishers: {topic: [flood], period_us: [200],"
                 " size_bytes: [20000]}}}\n")
TWO = work / "two.yaml"
TWO.write_text("".join(f"  - {{name: {name}, components: [{{component: Witness, library: {library}, name: {name}}}]}}\n"
                       for name in ("sound", "slow")).join(("containers:\n", "")))
ONE = work / "one.yaml"
ONE.write_text(f"container: {{name: one, components: [{{component: Witness, library: {library}, name: sound}}]}}\n")


def block_signals():
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM, signal.SIGHUP})


class Begun:
    """A command, and a pipe of its output that nobody reads, if so; its parent has blocked the signals then."""

    def __init__(self, *words, piped=False):
        self.words = words
        self.ends = os.pipe() if piped else ()
        if piped:  # it is full
            os.set_blocking(self.ends[1], False)
            try:
                while os.write(self.ends[1], b"x" * 4096):
                    pass
            except BlockingIOError:
                os.set_blocking(self.ends[1], True)
        out = self.ends[1] if piped else subprocess.DEVNULL
        self.process = subprocess.Popen([takt, *map(str, words)], env=environment, stdin=subprocess.DEVNULL, stdout=out,
                                        stderr=out, start_new_session=True,
                                        preexec_fn=block_signals if piped else None)

    def lives(self):
        return self.process.poll() is None

    def ends_within(self, seconds):
        begin = time.monotonic()
        try:
            self.process.wait(seconds + SLACK)
        except subprocess.TimeoutExpired:
            return None
        return time.monotonic() - begin

    def children(self):
        path = pathlib.Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children")
        return [int(pid) for pid in path.read_text().split()] if path.exists() else []

    def close(self):
        for pid in (*self.children(), self.process.pid):
            try:
                os.kill(pid, KILL)
            except ProcessLookupError:
                pass
        self.process.wait()
        for end in self.ends:
            os.close(end)


# Every command is in one of these three lists.
LOOKS = [("top", "--json"), ("topic", "echo", "/flood"), ("topic", "echo", "/flood", "--raw"), ("topic", "hz", "/flood"),
         ("topic", "bw", "/flood"), ("topic", "list"), ("node", "list"), ("service", "list"), ("graph",), ("param", "list"),
         ("component", "list"), ("lifecycle", "list"), ("action", "list"), ("param", "get", "/w", "use_sim_time"),
         ("component", "load", "robot", "takt::Workload"), ("topic", "pub", "/none", "std_msgs/msg/String", "-w", "1"),
         ("service", "call", "/w/get_parameters", "rcl_interfaces/srv/GetParameters", "{names: [x]}")]
RUNS = [("run", TWO), ("bag", "record", "/flood", "-o", work / "flood.mcap"), ("latency", "-q", "-D", "1h"),
        ("action", "send_goal", "/none", "example_interfaces/action/Fibonacci", "--timeout", "1h"), ("compare", ONE, "--executors", "events", "--duration", "1h")]
# They leave signals to the kernel, and wait for nobody but the reader of their output.
LOCAL = [("analyze", ROBOT), ("bag", "info", "none"), ("bundle", "none"), ("check", ROBOT), ("component", "types"), ("doctor",), ("help",),
         ("interface", "show", "std_msgs/msg/String"), ("list",), ("model", "none", "-o", work / "model"), ("new", work / "project"),
         ("plan", ROBOT), ("random", "1"), ("reference", "config"), ("ros2", "prefix"), ("rta", "edf"), ("simulate", ROBOT)]
# A command that waits in the same function as one above.
AS = {"action type": "action list", "action info": "action list", "bag play": "bag record", "bench": "compare", "callback set": "param get",
      "component unload": "component load", "lifecycle nodes": "lifecycle list", "lifecycle get": "param get",
      "lifecycle set": "param get", "node info": "node list", "param set": "param get", "param delete": "param get",
      "param describe": "param get", "param dump": "param get", "param load": "param get", "ros2 build": "ros2 prefix",
      "random tasks": "random", "ros2 run": "ros2 prefix", "selftest": "compare", "service type": "service list", "service info": "service list",
      "service find": "service list", "topic info": "topic list", "topic type": "topic list", "topic find": "topic list",
      "topic delay": "topic hz", "trace start": "param get", "trace stop": "param get"} | {f"rta {name}": "rta edf" for name in (
          "batch", "blass_bw", "blass_rr", "casini_event_source", "casini_polling", "casini_timer", "cil_edf_arbitrary", "cil_edf_constrained", "dbf",
          "fifo", "fp", "g_edf", "g_fp", "gel", "np_dbf", "np_edf", "np_fp", "picas", "sag_edf", "sag_fp", "sbf", "wc")}


def commands(*words):
    """Those of the command itself: "bag record"."""
    text = subprocess.run([takt, *words, "--help"], env=environment, capture_output=True, text=True, check=False).stdout
    names = re.search(r"\nSubcommands:\n(.*?)(?:\n\n|\Z)", text, re.DOTALL)
    if not names:
        return [" ".join(words)]
    return [leaf for name in re.findall(r"^  (\S+)", names[1], re.MULTILINE) for leaf in commands(*words, name)]


rows = {" ".join(map(str, words[:2])) for words in LOOKS + RUNS + LOCAL} | {words[0] for words in LOOKS + RUNS + LOCAL}
missing = [name for name in commands() if name not in rows and AS.get(name) not in rows]
check("every command is in the matrix", not missing, missing)


def end_all(what, begun, signals=1):
    """All at the same time, so that it is short."""
    seconds = 10  # beside real-time threads of others; what hangs does not end at all
    waiting = [each for each in begun if each.lives()]
    for each in waiting:
        each.process.send_signal(INT)
    if signals == 2:
        time.sleep(0.6)  # two equal ones at once are one
        for each in waiting:
            if each.lives():
                each.process.send_signal(INT)
    late = [(each.words, took) for each in waiting if (took := each.ends_within(seconds)) is None]
    check(f"{what}: {len(waiting)} commands end within {seconds} s", waiting and not late, late)
    for each in begun:
        each.close()


robot = Begun("run", ROBOT)
eventually(lambda: b"robot" in subprocess.run([takt, "component", "list"], env=environment, capture_output=True,
                                              check=False).stdout)
for what, piped in (("a flood", False), ("a pipe that nobody reads", True)):
    begun = [Begun(*words, piped=piped) for words in (LOOKS + LOCAL if piped else LOOKS)]
    time.sleep(2)  # most have ended by themselves, unless their pipe holds them
    end_all(what, begun)
os.kill(robot.process.pid, signal.SIGSTOP)
begun = [Begun(*words) for words in LOOKS]
time.sleep(1.5)
end_all("a peer that is silent", begun)
os.kill(robot.process.pid, signal.SIGCONT)

# What runs: a child that is stopped, and a pipe, with two signals.
for what, begun in (("a child that is stopped", [Begun(*words) for words in RUNS if words[0] in ("run", "compare")]),
                    ("a pipe that nobody reads", [Begun(*words, piped=True) for words in RUNS])):
    time.sleep(2)
    if "child" in what:
        for each in begun:
            for pid in each.children()[-1:]:
                os.kill(pid, signal.SIGSTOP)
    end_all(what, begun, signals=2)
recording = subprocess.run([takt, "bag", "info", work / "flood.mcap"], env=environment, capture_output=True, text=True, check=False)
check("the recording is readable", recording.returncode == 0 and "/flood" in recording.stdout, recording.stdout, recording.stderr)
robot.process.send_signal(INT)
check("the robot ends in order", robot.ends_within(20) is not None and robot.process.returncode == 0, robot.process.returncode)
robot.close()
finish()
