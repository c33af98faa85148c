#!/usr/bin/env python3
"""Are executors of a library full ones? kit_test.py TAKT FOLDER-OF-EXAMPLES

Runs 18_table_driven, 19_bands and 20_wait_backend: their statistics, chains, traces and analysis, and their mistakes.
"""
# SPDX-License-Identifier: Apache-2.0
import json
import pathlib
import subprocess
import sys
import tempfile

takt, examples = sys.argv[1], pathlib.Path(sys.argv[2]).resolve()
table, bands = examples / "18_table_driven/robot.yaml", examples / "19_bands/robot.yaml"
work = pathlib.Path(tempfile.mkdtemp())


def run(*words, status=0):
    ended = subprocess.run([takt, *map(str, words)], capture_output=True, text=True, timeout=60)
    assert ended.returncode == status, f"{words}: {ended.returncode}\n{ended.stdout}{ended.stderr}"
    return ended.stdout, ended.stderr


def results(*words):
    return json.loads(run("run", *words, "--duration", "1s", "--json", "-")[0])["runs"][0]


def one(rows, **wanted):
    (row,) = [each for each in rows if all(each[key] == value for key, value in wanted.items())]
    return row


# Each message is served, in the other slot: 2 ms after the timer at the earliest.
ran = results(table, "--trace", work / "t.json")
timer, planner = (one(ran["callbacks"], callback=name) for name in ("imu_timer", "imu"))
assert timer["received"] > 20 and timer["deadline_misses"] == 0, timer
assert planner["received"] >= timer["received"] - 2 and planner["dropped"] == 0, (timer, planner)
assert one(ran["chains"], name="react")["instances"] >= planner["received"] - 2, ran["chains"]
events = json.loads((work / "t.json").read_text())["traceEvents"]
starts = {name: [each["ts"] for each in events if each.get("ph") == "X" and each["name"].endswith(name)]
          for name in ("/driver/imu_timer", "/planner/imu")}
assert all(len(of) > 20 for of in starts.values()), starts
# A frame takes 10 ms; it begins where all slots fit the starts, but for a thread that was preempted
# between the choice and the start.
fits = max(sum((at - begin) % 10_000 < 2_000 for at in starts["/driver/imu_timer"])
           + sum((at - begin) % 10_000 >= 2_000 for at in starts["/planner/imu"])
           for begin in starts["/driver/imu_timer"] + [at - 2_000 for at in starts["/planner/imu"]])
total = sum(map(len, starts.values()))
assert fits >= 0.9 * total, f"{fits} of {total} starts lie in their slots"

# In a simulation, all do.
simulated = run("simulate", table, "--trace", work / "s.json")[0]
assert "react       1000       0        0     20000  2500  2500  2500   2500  2500\n" in simulated, simulated
events = json.loads((work / "s.json").read_text())["traceEvents"]
for name, begin in (("/driver/imu_timer", 0), ("/planner/imu", 2_000)):
    starts = [each["ts"] for each in events if each.get("ph") == "X" and each["name"].endswith(name)]
    assert len(starts) == 1000 and all(abs(at % 10_000 - begin) < 1 for at in starts), starts
simulated = run("simulate", bands, "--set", "threads.usual.affinity=[0]", "--set", "threads.urgent.affinity=[0]")[0]
assert "odometry_timer  timer      5000     -        -         0     -         -       0  0.00  0.00  0.00   0.00  0.00 " in simulated, simulated

# There is no bound for a rule that no method knows.
text = "".join(run("analyze", table, status=1))
assert "no method knows the rule of type 'table'" in text, text

# The list of executors has its keys.
assert "its key `table`: slots that repeat" in run("list", "executors", table)[0]

# Mistakes have their line.
for wrong, error in (
        ("      - {for: 2, run: [a/b]}", ":6: 'for': it is no duration; write a number and its unit"),
        ("      - {for: 2ms, runs: [a/b]}", ":6: 'runs': unknown key; did you mean 'run'?"),
        ("      - {for: 2ms}", ":6: 'table[0]': the key 'run' is missing"),
        ("    tabel: 5", ":6: 'tabel' is not a key of an executor; did you mean 'table'?")):
    lines = table.read_text().splitlines()
    lines[5] = wrong
    if "tabel" in wrong:
        del lines[4], lines[5]
        lines.insert(4, "    spin: 0ms")
    file = work / "robot.yaml"
    file.write_text("\n".join(lines).replace("libtable.so", str(examples / "18_table_driven/libtable.so")))
    _, errors = run("check", file, status=2)
    assert error in errors, errors

# Another type does not use its key, and says so.
notes = results(table, "--executor", "events")["notes"]
assert any("which cannot use of it: `table`" in note for note in notes), notes

ran = results(bands)
assert {each["name"] for each in ran["threads"]} >= {"urgent", "usual"}, ran["threads"]
assert one(ran["callbacks"], callback="odometry_timer")["received"] > 100

semaphore = examples / "20_wait_backend/robot.yaml"
assert "semaphore  POSIX semaphores" in run("list", "wait_backends", semaphore)[0]
ran = results(semaphore)
assert one(ran["callbacks"], callback="imu")["received"] > 20, ran["callbacks"]
