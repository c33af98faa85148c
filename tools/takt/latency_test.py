#!/usr/bin/python3
"""takt latency is read by what reads cyclictest: latency_test.py TAKT

SPDX-License-Identifier: Apache-2.0
"""
import json
import re
import subprocess
import sys

FAILED = []


def expect(holds, what):
    print("holds " if holds else "FAILED", what)
    if not holds:
        FAILED.append(what)


def run(*words):
    return subprocess.run([sys.argv[1], "latency", *words], stdout=subprocess.PIPE, check=True,
                          text=True).stdout


def main():
    text = run("-i", "1000", "-l", "200", "-h", "400", "-q", "--executor", "events")
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    summary = re.compile(r"T: *(\d+) \( *\d+\) P: *\d+ I:\d+ C: *(\d+) "
                         r"Min: *\d+ Act: *\d+ Avg: *\d+ Max: *\d+$")
    rows = [summary.match(line) for line in lines[:2]]
    expect(all(rows), "the summary has cyclictest's lines")
    expect([row.group(2) for row in rows] == ["200", "200"], "each row has its cycles")
    histogram = [line.split() for line in lines[2:]]
    expect(len(histogram) == 400 and all(re.fullmatch(r"\d{6}", word) for line in histogram
                                         for word in line), "the histogram has cyclictest's lines")
    overflows = [int(word) for word in re.search(r"# Histogram Overflows: (.*)", text)[1].split()]
    for row in (1, 2):
        total = sum(int(line[row]) for line in histogram)
        expect(total + overflows[row - 1] == 200, f"row {row - 1}: histogram and overflows are all")

    # The keys that rt-tests 2.4 writes, and scripts read.
    document = json.loads(run("-i", "1000", "-l", "200", "-q", "--json", "-"))
    for key in ("file_version", "cmdline:", "rt_test_version:", "start_time", "end_time",
                "return_code", "sysinfo", "num_threads", "resolution_in_ns", "thread"):
        expect(key in document, f"the JSON has '{key}'")
    for key in ("histogram", "cycles", "min", "max", "avg", "cpu", "node"):
        expect(key in document["thread"]["0"], f"a thread has '{key}'")
    expect(document["num_threads"] == len(document["thread"]) == 2, "bare loop and executor")
    sys.exit(1 if FAILED else 0)


main()
