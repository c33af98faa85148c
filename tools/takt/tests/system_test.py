#!/usr/bin/env python3
"""Several containers as one system: a process that dies is reported with its last output, restarted as its
description says, and the rest goes on.

usage: system_test.py TAKT
"""
# SPDX-License-Identifier: Apache-2.0
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../cmake"))
from checks import check, children_of, environment, eventually, finish, proves  # noqa: E402

takt = sys.argv[1]

WORKLOAD = """
    - component: takt::Workload
      name: {name}
      parameters: {{publishers.topic: [/{name}], publishers.period_us: [10000], publishers.size_bytes: [16]}}
"""


def both_children_of(process):
    """The children in the order of their making."""
    for _ in range(500):
        pids = children_of(process.pid)
        if len(pids) >= 2:
            break
        time.sleep(0.01)
    return pids


def run(restart, act, seconds="3s", file=None):
    """Runs two containers, lets `act` do something after a second, and returns what was said."""
    with tempfile.TemporaryDirectory() as folder:
        path = file or os.path.join(folder, "two.yaml")
        if not file:
            with open(path, "w") as text:
                text.write("containers:\n  - name: first\n    components:"
                           + WORKLOAD.format(name="one")
                           + "  - name: second\n" + restart + "    components:"
                           + WORKLOAD.format(name="two"))
        result = os.path.join(folder, "result.json")
        process = subprocess.Popen([takt, "run", path, "--duration", seconds, "--json", result],
                                   env=environment, stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, text=True)
        time.sleep(1.6)
        act(process, both_children_of(process))
        said = process.communicate(timeout=60)
        runs = json.load(open(result))["runs"] if os.path.exists(result) else None
        return process.returncode, said[1], runs


def kill_second(_, pids):
    os.kill(pids[1], signal.SIGKILL)


status, said, runs = run("", kill_second)
check("a container that is killed is reported", "process 'second' was ended by signal 9 (Killed)"
      in said, said)
check(proves("command_line.md", "The exit status is 1 if one is missing at the end"), status == 1 and runs is not None
      and [p["name"] for p in runs[0]["processes"]] == ["first", "takt"], status, said)

status, said, runs = run("    restart: {policy: on_failure, delay: 50ms}\n", kill_second)
check("it is restarted as its description says", "restart 1 of 5 in 50ms" in said and status == 0
      and [p["name"] for p in runs[0]["processes"]] == ["first", "second", "takt"], status, said)
# As programs of their own, each has the library's written pages for itself: megabytes, not those of a
# fork, which shares them with its parent.
check("each process shows its memory and CPU time", all(
    p["pss_kb"] > 2000 and p["cpu_percent"] is not None for p in runs[0]["processes"]), runs)
check("with its components", runs is not None and any(
    c["node"] == "/two" and c["received"] > 10 for c in runs[0]["callbacks"]), runs)


def kill_again_and_again(process, pids):
    for _ in range(3):
        os.kill(both_children_of(process)[-1], signal.SIGKILL)
        time.sleep(0.4)


status, said, runs = run("    restart: {policy: always, delay: 1ms, most: 2}\n",
                         kill_again_and_again, "4s")
check("but not for ever", "it was restarted 2 times already" in said and status == 1, status, said)

status, said, runs = run("", lambda process, _: process.send_signal(signal.SIGINT), "60s")
check("one Ctrl-C ends all cleanly", status == 130 and len(runs[0]["processes"]) == 3, status, said)


# Ends of topics that never find each other are named, and fail the run where the file says so.
LONELY = """
topics: {{/scan: {{must_match: {required}}}}}
containers:
  - name: first
    components:
      - component: takt::Workload
        name: nav
        parameters: {{subscriptions.topic: [/scan, /map]}}
  - name: second
    components:
      - component: takt::Workload
        name: server
        parameters: {{publishers.topic: [/map], publishers.period_us: [10000], publishers.size_bytes: [16]}}
"""
for required, seconds in (("false", "11s"), ("true", "2s")):
    with tempfile.NamedTemporaryFile("w", suffix=".yaml") as text:
        text.write(LONELY.format(required=required))
        text.flush()
        status, said, _ = run("", lambda *_: None, seconds, text.name)
    if required == "false":
        check("a topic that only one side knows is named after 10 s", status == 0
              and "topics without publisher or without subscription: '/scan' (no publisher; subscribed by /nav)" in said
              and "/map" not in said, status, said)
    else:
        check("and is an error where it must match", status == 1 and re.search(
            r":2: topic '/scan' must match: no publisher; subscribed by /nav", said), status, said)

with tempfile.NamedTemporaryFile("w", suffix=".yaml") as text:
    text.write(LONELY.format(required="true").replace("/scan: {must", "/scam: {must"))
    text.flush()
    status, said, _ = run("", lambda *_: None, "2s", text.name)
check("so is one that no container has", status == 1 and re.search(
    r":2: topic '/scam' must match: it has no publisher and no subscription", said), status, said)


# A managed container dies: noticed within its heartbeat limit, and handled as the file says.
LIFECYCLE = """
lifecycle:
  bring_up: [anchor, base, top]
  depends_on: {top: [base]}
  heartbeat: 400ms
containers:
  - name: first
    components:
      - {component: takt::LifecycleWorkload, name: anchor}
      - {component: takt::LifecycleWorkload, name: top}
  - name: second
    restart: {policy: on_failure, delay: 800ms}
    components:
      - {component: takt::LifecycleWorkload, name: base}
"""
with tempfile.NamedTemporaryFile("w", suffix=".yaml") as text:
    text.write(LIFECYCLE)
    text.flush()
    status, said, _ = run("", kill_second, "5s", text.name)
steps = re.findall(r"lifecycle: ((?:\w+ /\w+|/\w+ is lost|/\w+ is back))", said)
check("a lost node's dependents rest until it is back, and all go down in reverse", status == 0
      and steps == ["configure /anchor", "activate /anchor", "configure /base", "activate /base",
                    "configure /top", "activate /top", "/base is lost",
                    "deactivate /top", "/base is back", "configure /base", "activate /base",
                    "activate /top",
                    "deactivate /top", "cleanup /top", "shutdown /top",
                    "deactivate /base", "cleanup /base", "shutdown /base",
                    "deactivate /anchor", "cleanup /anchor", "shutdown /anchor"],
      status, steps, said)



# ---- A run that has nothing to do ----
def sleeps_of(pid):
    """How often each of its threads has gone to sleep."""
    sleeps = {}
    for thread in os.listdir(f"/proc/{pid}/task"):
        with open(f"/proc/{pid}/task/{thread}/status", encoding="utf-8") as status:
            sleeps[thread] = re.search(r"^voluntary_ctxt_switches:\s*(\d+)", status.read(), re.M)[1]
    return sleeps


def rests(pid):
    """None of its threads wakes up for half a second."""
    before = sleeps_of(pid)
    time.sleep(0.5)
    return sleeps_of(pid) == before


# It woke up eight times a second, to divide latencies over time.
with tempfile.TemporaryDirectory() as folder:
    system = os.path.join(folder, "idle.yaml")
    with open(system, "w", encoding="utf-8") as file:
        file.write("realtime: off\ncontainer: {components: [{component: takt::Workload, name: idle, "
                   "parameters: {subscriptions: {topic: [nothing]}}}]}\n")
    idle = subprocess.Popen([takt, "run", system, "--duration", "1h"], env=environment, stdout=subprocess.DEVNULL,
                            stderr=subprocess.DEVNULL)
    check("an idle run with a duration wakes up never", eventually(lambda: rests(idle.pid), limit=10), sleeps_of(idle.pid))
    idle.send_signal(signal.SIGINT)
    idle.wait(timeout=60)

finish()
