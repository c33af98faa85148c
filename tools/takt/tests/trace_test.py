#!/usr/bin/python3
"""A trace keeps the rules of the Trace Event Format that viewers rely on: trace_test.py TAKT SYSTEM

SPDX-License-Identifier: Apache-2.0
"""
import json
import os
import subprocess
import sys
import tempfile

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../cmake"))
from checks import check, finish  # noqa: E402


def main():
    takt, system = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "trace.json")
        output = subprocess.run([takt, "run", system, "--duration", "500ms", "--json", "-",
                                 "--trace", path], check=True, stdout=subprocess.PIPE).stdout
        with open(path, encoding="utf-8") as file:
            events = json.load(file)["traceEvents"]
    run = json.loads(output)["runs"][0]

    def of(*phases):
        return [event for event in events if event["ph"] in phases]

    slices = of("X")
    executed = sum(callback["received"] for callback in run["callbacks"])
    check(f"there is a slice for each execution ({len(slices)}, {executed})", len(slices) == executed)
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
    finish()


main()
