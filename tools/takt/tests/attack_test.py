#!/usr/bin/env python3
"""A container that records everything, and `takt bag record --all`, beside a peer that means harm (hostile_peer.cpp)
and a node whose names are none (peers::Hostile): they live, the container's 1 kHz timer keeps its period, it answers,
neither its memory nor its log grows with what the peer says, and nothing that is written steers a terminal.

usage: attack_test.py TAKT HOSTILE_PEER PEERS SECONDS
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

peer, peers, seconds = sys.argv[2], str(pathlib.Path(sys.argv[3]).resolve()), float(sys.argv[4])
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
       parameters: {{publishers: {{topic: ["y"], period_us: [10000]}}, subscriptions: {{topic: [z]}}}}}}
    - {{component: takt::Recorder, name: recorder, executor: disk, parameters: {{file: all.mcap}}}}
"""


def megabytes(pid):
    for line in open(f"/proc/{pid}/status"):
        if line.startswith("RssAnon"):
            return int(line.split()[1]) / 1024
    return 0.0


def controls(text):
    return [byte for byte in text if byte < 32 and byte not in b"\n\t" or byte == 127]


class Beside:
    """A command that must live until it is ended, and end well."""

    def __init__(self, folder, *words):
        self.words = words
        self.process = subprocess.Popen([takt, *words], cwd=folder, env=environment, stdout=subprocess.DEVNULL,
                                        stderr=subprocess.PIPE)

    def end(self, excuse=None):
        what = " ".join(self.words[:2])
        check(f"takt {what} lives", self.process.poll() is None)
        self.process.send_signal(signal.SIGINT)
        said = self.process.communicate(timeout=60)[1]
        check(f"takt {what} ends well, and steers no terminal", not controls(said) and
              (self.process.returncode == 0 or excuse and excuse in said), self.process.returncode, said[-2000:])


def documents(folder, *words):
    """What the command writes, as text and as JSON."""
    file = folder / "out.json"
    done = subprocess.run([takt, *words, "--json", str(file)], env=environment, timeout=60, capture_output=True)
    check(f"{' '.join(words)} works, and steers no terminal", done.returncode == 0 and
          not controls(done.stdout + done.stderr), done.stdout[:2000], done.stderr)
    return done.stdout.decode(), json.loads(file.read_text())  # throws unless it is UTF-8


# A publisher of rt/1abc ended a container with a recorder of all topics, and `takt bag record`.
def attack(folder, system):
    bag = Beside(folder, "bag", "record", "--all", "-o", "bag.mcap")
    (folder / "hostile.yaml").write_text(f"dds: {{domain: {DOMAIN}, shared_memory: off}}\n"
                                         f"container: {{components: [{{component: peers::Hostile, library: {peers}}}]}}\n")
    hostile = Beside(folder, "run", "hostile.yaml")
    for _ in range(50):
        text, rows = documents(folder, "topic", "list")
        if any(row["topic"] == "/1abc" for row in rows):
            break
    check("names of types are escaped", "ev\\u001b]0;owned\\u0007il/msg/A\\nb  9  9" in text, text)
    _, rows = documents(folder, "node", "list")
    check("so are nodes", any("\\n" in row["node"] for row in rows), rows)
    documents(folder, "topic", "info", "/1abc")
    documents(folder, "node", "info", "/hostile")
    hostile.end()
    before = megabytes(system.pid)
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
    bag.end(excuse=b"messages were not recorded: the disk was slow")


def attacked(folder, name, is_attacked):
    """The system for some seconds, with or without the attack: the row of its timer."""
    recording = folder / "all.mcap"
    recording.unlink(missing_ok=True)
    begin = time.monotonic()
    log = open(folder / f"{name}.log", "w+", errors="replace")
    system = subprocess.Popen([takt, "run", "system.yaml", "--json", f"{name}.json"], cwd=folder,
                              env=environment, stdout=subprocess.DEVNULL, stderr=log)
    seen(lambda rows: "/recorder" in {row["node"] for row in rows}, "node", "list")
    if is_attacked:
        attack(folder, system)
    else:
        time.sleep(seconds)
    system.send_signal(signal.SIGINT)
    system.wait(30)
    log.seek(0)
    lines = log.read().splitlines()
    # Status 1: the recorder could not keep up with what the peer published.
    check(f"{name}: it ends in order", system.returncode == 0 or system.returncode == 1 and is_attacked and
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
