#!/usr/bin/python3
"""A trace keeps the rules of the Trace Event Format that viewers rely on: trace_test.py TAKT SYSTEM

SPDX-License-Identifier: Apache-2.0
"""
import json
import os
import subprocess
import sys
import tempfile

FAILED = []


def expect(holds, what):
    print("holds " if holds else "FAILED", what)
    if not holds:
        FAILED.append(what)


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
    expect(len(slices) == executed, f"there is a slice for each execution ({len(slices)}, {executed})")
    threads = {}
    for event in slices:
        threads.setdefault((event["pid"], event["tid"]), []).append(event)
    named = {(event["pid"], event["tid"]) for event in of("M") if event["name"] == "thread_name"}
    expect(set(threads) <= named, "each thread has a name")
    overlaps = 0
    for of_thread in threads.values():
        of_thread.sort(key=lambda event: event["ts"])
        overlaps += sum(a["ts"] + a["dur"] > b["ts"] + 0.0011  # a nanosecond of rounding
                        for a, b in zip(of_thread, of_thread[1:]))
    expect(overlaps == 0, "slices of one thread do not overlap")
    begins = {event["id"]: event["ts"] for event in of("b")}
    ends = {event["id"]: event["ts"] for event in of("e")}
    expect(begins.keys() == ends.keys() and all(begins[i] <= ends[i] for i in begins),
           "what becomes ready starts later")
    starts, finishes = ({event["id"] for event in of(phase)} for phase in "sf")
    expect(starts == finishes and starts, f"arrows of {len(starts)} chain instances begin and end")
    expect(all(event["ts"] >= 0 for event in events if "ts" in event), "time begins at 0")
    sys.exit(1 if FAILED else 0)


main()
