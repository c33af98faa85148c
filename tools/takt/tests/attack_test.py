#!/usr/bin/env python3
"""A container that records everything, beside a peer that means harm (hostile_peer.cpp): it lives, its 1 kHz
timer keeps its period, it answers, and neither its memory nor its log grows with what the peer says.

usage: attack_test.py TAKT HOSTILE_PEER SECONDS
"""
# SPDX-License-Identifier: Apache-2.0
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time

from command import run, seen, takt
from checks import check, environment, finish

peer, seconds = sys.argv[2], float(sys.argv[3])
DOMAIN = environment["ROS_DOMAIN_ID"]
MOST_MEGABYTES = 64
MOST_LINES_A_SECOND = 100  # ten or less of each kind of complaint; without limits, a thousand
SYSTEM = f"""
dds: {{domain: {DOMAIN}, shared_memory: off}}
realtime: prefer
threads: {{motors: {{policy: SCHED_FIFO, priority: 50}}}}
executors: {{fast: {{type: events, threads: [motors]}}, disk: {{type: events}}}}
container:
  name: robot
  components:
    - {{component: takt::Workload, name: motors, executor: fast,
       parameters: {{publishers: {{topic: [x], period_us: [1000]}}}}}}
    - {{component: takt::LifecycleWorkload, name: arm, executor: disk,
       parameters: {{publishers: {{topic: [y], period_us: [10000]}}, subscriptions: {{topic: [z]}}}}}}
    - {{component: takt::Recorder, name: recorder, executor: disk, parameters: {{file: all.mcap}}}}
"""


def megabytes(pid):
    for line in open(f"/proc/{pid}/status"):
        if line.startswith("RssAnon"):
            return int(line.split()[1]) / 1024
    return 0.0


def attacked(folder, name, attack):
    """The system for some seconds, with or without the attack: the row of its timer."""
    recording = folder / "all.mcap"
    recording.unlink(missing_ok=True)
    begin = time.monotonic()
    log = open(folder / f"{name}.log", "w+", errors="replace")
    system = subprocess.Popen([takt, "run", "system.yaml", "--json", f"{name}.json"], cwd=folder,
                              env=environment, stdout=subprocess.DEVNULL, stderr=log)
    seen(lambda rows: "/recorder" in {row["node"] for row in rows}, "node", "list")
    before = megabytes(system.pid)
    if attack:
        enemy = subprocess.Popen([peer, DOMAIN, str(seconds), "1"], stdout=subprocess.PIPE, text=True,
                                 env={**os.environ, "CYCLONEDDS_URI": ""})
        time.sleep(seconds / 2)
        run("component", "list")
        victims, sent, ends = map(int, enemy.communicate(timeout=seconds + 30)[0].split())
        check("the attack took place", victims > 10 and sent > 1000 and ends > 100, victims, sent, ends)
        lives = system.poll() is None
        check("the container lives", lives)
        grown = megabytes(system.pid) - before if lives else 0
        check("it has not grown by much", grown < MOST_MEGABYTES, grown, "MB")
    else:
        time.sleep(seconds)
    system.send_signal(signal.SIGINT)
    system.wait(30)
    log.seek(0)
    lines = log.read().splitlines()
    # Status 1: the recorder could not keep up with what the peer published.
    check(f"{name}: it ends in order", system.returncode == 0 or system.returncode == 1 and attack and
          any(re.search(r"topics, [1-9]\d* dropped", line) for line in lines), system.returncode, "\n".join(lines[-20:]))
    check(f"{name}: it says little", len(lines) < MOST_LINES_A_SECOND * (time.monotonic() - begin), len(lines), "\n".join(lines[:20]))
    check(f"{name}: it says nothing that a terminal obeys",
          not any(ord(character) < 32 for line in lines for character in line), "\n".join(lines[:20]))
    subprocess.run([takt, "bag", "info", str(recording)], check=True, stdout=subprocess.DEVNULL)
    rows = json.loads((folder / f"{name}.json").read_text())["runs"][0]["callbacks"]
    return next(row for row in rows if row["callback"] == "x_timer")


with tempfile.TemporaryDirectory() as path:
    folder = pathlib.Path(path)
    (folder / "system.yaml").write_text(SYSTEM)
    alone, beside = (attacked(folder, name, name == "attacked") for name in ("alone", "attacked"))
    # Of all releases since the start: those which the timer has served.
    share = {name: row["received"] / (row["received"] + row["overruns"])
             for name, row in (("alone", alone), ("attacked", beside))}
    print("served of all releases:", share)
    check("the timer keeps its period", share["attacked"] > 0.95 * share["alone"])
finish()
