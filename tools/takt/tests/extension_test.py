#!/usr/bin/env python3
"""A new scheduler and a new executor are a file and a line each: all else finds them by itself.

usage: extension_test.py EXTENSION SCHEDULER TAKT PROGRAM...   (the libraries of examples/15_executor
and 06_scheduler, and test programs that run for everything that is registered)
"""
# SPDX-License-Identifier: Apache-2.0
import os
import subprocess
import sys
import tempfile

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../cmake"))
from checks import check, environment, finish  # noqa: E402

extension, scheduler, takt, *programs = map(os.path.abspath, sys.argv[1:])
extended = {**environment, "LD_PRELOAD": extension}


def run(*words):
    done = subprocess.run(words, env=extended, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, timeout=240)
    return done.returncode, done.stdout


for kind, name, what in (("executors", "events_pool", "every event at once, for a pool of threads"),
                         ("schedulers", "longest_waiting", "ready for the longest time first")):
    status, output = run(takt, "list", kind)
    lines = [line.split(maxsplit=1) for line in output.splitlines()]
    check(f"takt list {kind} has {name}", status == 0 and [name, what] in lines, output)

with tempfile.TemporaryDirectory() as folder:
    path = os.path.join(folder, "robot.yaml")
    with open(path, "w") as file:
        file.write("threads: {one: {}, two: {}}\n"
                   "executors: {all: {type: events_pool, threads: [one, two]}}\n"
                   "container: {components: [{component: takt::Workload, executor: all}]}\n")
    status, output = run(takt, "check", path)
    check("takt check takes both in a file", status == 0, output)
    status, output = run(takt, "compare", path, "--executors", "all", "--schedulers", "longest_waiting",
                       "--duration", "50ms", "--repeat", "1")
    check("takt compare runs it among all", status == 0 and "events_pool" in output, output)

for program in programs:
    both = "*events_pool__longest_waiting*:*EveryScheduler*/longest_waiting"
    status, output = run(program, f"--gtest_filter={both}", "--gtest_brief=1")
    check(f"{os.path.basename(program)} has cases for them, and they pass",
          status == 0 and "PASSED  ] 0 tests" not in output, output)

extended["LD_PRELOAD"] = scheduler
status, output = run(programs[-1], "--gtest_filter=*/events*__fair_share", "--gtest_brief=1")
check("the suite accepts a scheduler that does not take turns, by its traits",
      status == 0 and "PASSED  ] 0 tests" not in output, output)

finish()
