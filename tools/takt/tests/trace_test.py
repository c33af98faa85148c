#!/usr/bin/python3
"""A trace keeps the rules of the Trace Event Format that viewers rely on, has the time of a clock, and is also of a
container that runs: trace_test.py TAKT SYSTEM

SPDX-License-Identifier: Apache-2.0
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

from command import run, takt
from checks import check, environment, eventually, finish, proves


def check_rules(document, executed):
    events = document["traceEvents"]

    def of(*phases):
        return [event for event in events if event["ph"] in phases]

    slices = [event for event in of("X") if event["cat"] != "sched"]
    check(f"there is a slice for each execution ({len(slices)}, {executed})", len(slices) == executed)
    check_kernel(events)
    threads = {}
    for event in slices:
        threads.setdefault((event["pid"], event["tid"]), []).append(event)
    named = {(event["pid"], event["tid"]) for event in of("M") if event["name"] == "thread_name"}
    check("each thread has a name", set(threads) <= named)
    overlaps = 0
    for of_thread in threads.values():
        of_thread.sort(key=lambda event: event["ts"])
        overlaps += sum(a["ts"] + a["dur"] > b["ts"] + 0.0011  # a nanosecond of rounding
                        for a, b in zip(of_thread, of_thread[1:]))
    check("slices of one thread do not overlap", overlaps == 0)
    begins = {event["id"]: event["ts"] for event in of("b")}
    ends = {event["id"]: event["ts"] for event in of("e")}
    check("what becomes ready starts later",
          begins.keys() == ends.keys() and all(begins[i] <= ends[i] for i in begins),
          begins.keys() ^ ends.keys(), [(i, begins[i], ends[i]) for i in begins.keys() & ends.keys()
                                        if begins[i] > ends[i]])
    starts, finishes = ({event["id"] for event in of(phase)} for phase in "sf")
    check(f"arrows of {len(starts)} chain instances begin and end", starts == finishes and starts)
    check("time begins at 0", all(event["ts"] >= 0 for event in events if "ts" in event))


def check_kernel(events):
    """What the kernel ran, on which CPU; or one row that says why not."""
    linux = next(event["pid"] for event in events if event["ph"] == "M" and event["args"]["name"] == "Linux")
    rows = {event["tid"]: event["args"]["name"] for event in events if event["pid"] == linux and event["name"] == "thread_name"}
    cpus = {number for number, name in rows.items() if name == f"CPU {number}"}
    if not cpus:
        check("one row says why the kernel tells nothing", ["perf_event_paranoid" in row for row in rows.values()] == [True], rows)
        return
    ran = {}
    for event in events:
        if event["pid"] == linux and event["ph"] == "X":
            ran.setdefault(event["tid"], []).append(event)
    check("a thread that runs is on a CPU's row", ran.keys() <= cpus and ran, ran.keys(), cpus)
    overlaps = 0
    for of_cpu in ran.values():
        of_cpu.sort(key=lambda event: event["ts"])
        overlaps += sum(a["ts"] + a["dur"] > b["ts"] + 0.0011 for a, b in zip(of_cpu, of_cpu[1:]))
    check("a CPU runs one thread at a time", overlaps == 0)
    # A callback that has used the CPU was on one then.
    own = [event for event in events if event["ph"] == "X" and event["cat"] != "sched"]
    lonely = [event for event in own[len(own) // 4:-len(own) // 4] if not any(
        on["args"]["tid"] == event["tid"] and on["ts"] <= event["ts"] + event["dur"] and event["ts"] <= on["ts"] + on["dur"]
        for of_cpu in ran.values() for on in of_cpu)]
    check("each execution was on a CPU", not lonely, lonely[:2])


def test_a_run(system, folder):
    clock = {"monotonic": time.CLOCK_MONOTONIC, "boottime": time.CLOCK_BOOTTIME, "realtime": time.CLOCK_REALTIME,
             "mono_raw": time.CLOCK_MONOTONIC_RAW}
    for name, number in clock.items():
        path, before = folder / f"{name}.json", time.clock_gettime_ns(number)
        output = run("run", system, "--duration", "500ms" if name == "monotonic" else "20ms", "--json", "-", "--trace",
                     str(path), "--trace-clock", name).stdout
        document = json.loads(path.read_text())
        other = document["otherData"]
        check(f"it says that its clock is {name}, and when it began", other["clock"] == name and
              before < other["begin_ns"] < time.clock_gettime_ns(number), other, before)
        if name == "monotonic":
            check_rules(document, sum(callback["received"] for callback in json.loads(output)["runs"][0]["callbacks"]))
    error = run("run", system, "--trace", str(path), "--trace-clock", "sundial", status=2).stderr
    check("another clock is refused", "monotonic, boottime, realtime" in error, error)


def test_wakeups(system, folder):
    """Where tracefs is mounted, here for this run only, a thread's row says when it was woken."""
    file = folder / "woken.json"
    mounted = "mount -t tracefs tracefs /sys/kernel/tracing && exec \"$@\""
    done = subprocess.run(["unshare", "--mount", "sh", "-c", mounted, "sh", takt, "run", system, "--duration", "300ms", "--trace", file],
                          env=environment, capture_output=True, text=True, check=False)
    if not file.exists():
        print(f"skipped: wake-ups need root, and tracefs: {done.stderr[:200]}")
        return
    events = json.loads(file.read_text())["traceEvents"]
    rows = {event["args"]["name"] for event in events if event["ph"] == "M"}
    if "CPU 0" not in rows:
        print("skipped: the kernel tells no switches")
        return
    threads = {event["tid"] for event in events if event["ph"] == "M" and "is_prompt" in event["args"]}
    woken = [event for event in events if event["ph"] == "i" and event.get("cat") == "sched"]
    check("threads of callbacks are woken", len(woken) > 20 and {event["tid"] for event in woken} <= threads and
          all(event["name"].startswith("woken by ") for event in woken), len(woken), woken[:2])
    check("nothing is missing then", not any("no wake-ups" in row for row in rows), rows)


ROBOT = """
dds: {discovery: localhost}
executors: {fast: {type: events}, pool: {type: multi_threaded}}
container:
  name: robot
  components:
    - {component: takt::Workload, name: sender, executor: fast, parameters: {publishers: {topic: [beat], period_us: [2000]}}}
    - {component: takt::Workload, name: hearer, executor: pool, parameters: {subscriptions: {topic: [beat]}}}
"""


def test_a_container(folder):
    (folder / "robot.yaml").write_text(ROBOT)
    robot = subprocess.Popen([takt, "run", folder / "robot.yaml", "--json", folder / "run.json"], env=environment,
                             stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    file = folder / "robot.json"
    check("it is found", eventually(lambda: subprocess.run([takt, "component", "list", "robot"], env=environment,
                                                           capture_output=True, check=False).returncode == 0))
    error = run("trace", "stop", "robot", "-o", str(file), status=1).stderr
    check("what is not traced cannot be stopped", "it is not traced; begin with `takt trace start`" in error, error)
    run("trace", "start", "robot", "--trace-clock", "boottime")
    error = run("trace", "start", "robot", status=1).stderr
    check(proves("command_line.md", "A container that is traced already, or is not, is an error"), "traced already" in error, error)
    error = run("trace", "start", "robt", status=1).stderr
    check("a container that nobody has gets the nearest one", "robot" in error and error.count("\n") == 1, error)
    time.sleep(0.5)
    error = run("trace", "stop", "robot", "-o", "/nowhere/t.json", status=2).stderr
    check("a file that cannot be written ends nothing", "/nowhere" in error, error)
    run("trace", "stop", "robot", "-o", str(file))
    check("it goes on", robot.poll() is None)
    robot.send_signal(2)
    robot.wait(60)
    document = json.loads(file.read_text())
    events = document["traceEvents"]
    ran = {name: sorted(event["args"]["sequence"] for event in events if event["ph"] == "X" and event["name"] == name)
           for name in ("/sender/beat_timer", "/hearer/beat")}
    check("both callbacks ran", min(map(len, ran.values())) > 100, ran)
    check("none is there twice", all(len(set(numbers)) == len(numbers) for numbers in ran.values()))
    by_number = {event["args"]["number"]: event for event in events if event["ph"] == "X" and event["cat"] != "sched"}
    heard = [event for event in by_number.values() if event["name"] == "/hearer/beat"]
    uncaused = [event for event in heard if "caused_by" not in event["args"]]
    check("each message has its cause", len(uncaused) <= 2, uncaused)  # but those that were under way
    check("each cause has sent one", len({event["args"].get("caused_by") for event in heard}) >= len(heard) - 2)
    row = json.loads((folder / "run.json").read_text())["runs"][0]
    check("nothing was allocated on threads of executors", row["processes"][0]["allocations_while_spinning"] == 0, row["processes"])
    check("takt model reads it", "sender/beat_timer" in run("model", str(file)).stdout)


with tempfile.TemporaryDirectory(prefix="takt_trace_") as name:
    test_a_run(os.path.abspath(sys.argv[2]), pathlib.Path(name))
    test_wakeups(os.path.abspath(sys.argv[2]), pathlib.Path(name))
    test_a_container(pathlib.Path(name))
finish()
