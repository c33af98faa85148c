#!/usr/bin/python3
"""What compare.py compares: compare_test.py

SPDX-License-Identifier: Apache-2.0
"""
import json
import os
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.append(os.path.join(HERE, "../cmake"))
from checks import check, finish  # noqa: E402


def row(name, time, **counters):
    return {"name": name, "run_name": name, "run_type": "iteration", "repetitions": 2, "repetition_index": 0,
            "threads": 1, "iterations": 10, "real_time": time, "cpu_time": time, "time_unit": "ns", **counters}


def compare(old, new):
    with tempfile.TemporaryDirectory() as folder:
        paths = [os.path.join(folder, name) for name in ("old.json", "new.json")]
        for path, rows in zip(paths, (old, new)):
            with open(path, "w", encoding="utf-8") as file:
                json.dump({"benchmarks": rows}, file)
        done = subprocess.run([os.path.join(HERE, "compare.py"), *paths], stdout=subprocess.PIPE, text=True)
    return [line.split() for line in done.stdout.splitlines()[1:]]


lines = compare([row("dispatch", 100), row("dispatch", 102), row("transfer", 1000, takt_p50_us=7.0)],
                [row("dispatch", 201), row("dispatch", 200), row("transfer", 9000, takt_p50_us=7.1),
                 row("transfer", 9000, takt_p50_us=7.0), row("later", 5)])
check("without counters the time is compared, and more is more", lines[0][:3] == ["dispatch", "cpu_time,", "ns"]
      and lines[0][-1] == "more", lines)
check("with counters these alone are compared, whatever the time", lines[1][:2] == ["transfer", "takt_p50_us"]
      and lines[1][-3:] == ["within", "the", "spread"] and len(lines) == 3, lines)
check("what is new has no change", lines[2][0] == "later" and lines[2][-1] == "new", lines)
gone = compare([row("dispatch", 100), row("former", 7)], [row("dispatch", 100)])
check("what has gone is named", len(gone) == 2 and gone[1][0] == "former" and gone[1][-1] == "gone", gone)
apart = compare([row("dispatch", 100), row("dispatch", 130)], [row("dispatch", 125), row("dispatch", 140)])
check("a change within the ranges of the repetitions is none", apart[0][-3:] == ["within", "the", "spread"], apart)
zero = compare([row("transfer", 1, lost=0)], [row("transfer", 1, lost=3)])
check("a counter that was 0 has no change in percent", zero[0][-2:] == ["was", "0"], zero)
failed = dict(row("dispatch", 900), error_occurred=True)
mean = dict(row("dispatch_mean", 900), run_name="dispatch", run_type="aggregate")
only = compare([row("dispatch", 100)], [row("dispatch", 100), failed, mean])
check("failed runs and aggregates do not count", only[0][-3:] == ["within", "the", "spread"], only)
less = compare([row("transfer", 1, p50_us=9.0)], [row("transfer", 1, p50_us=3.0)])
check("less is less", less[0][-1] == "less" and "-66.7%" in less[0], less)
finish()
