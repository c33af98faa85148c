#!/usr/bin/env python3
"""A robot's lifecycle nodes come up in the order of its file and go down in the reverse order, under
two executors, and no message is lost: robots_test.py TAKT FILE

SPDX-License-Identifier: Apache-2.0
"""
import json
import re
import subprocess
import sys

takt, robot = sys.argv[1:]
order = re.search(r"bring_up: \[(.*?)\]", open(robot).read(), re.DOTALL).group(1)
nodes = ["/" + name.strip() for name in order.split(",")]
expected = [(word, node) for node in nodes for word in ("configure", "activate")]
expected += [(word, node) for node in reversed(nodes) for word in ("deactivate", "cleanup", "shutdown")]
failures = []


def expect(holds, what):
    print("holds " if holds else "FAILED", what)
    if not holds:
        failures.append(what)


for executor in ("isolated", "multi_threaded"):
    done = subprocess.run([takt, "run", robot, "--executor", executor, "--duration", "3s", "--json", "-"],
                          capture_output=True, text=True, timeout=60)
    expect(done.returncode == 0, f"{executor}: the run ends well ({done.returncode})")
    happened = re.findall(r"lifecycle: (\w+) (/\w+)", done.stderr)
    expect(happened == expected, f"{executor}: up in order, down in reverse ({len(happened)} steps)")
    run = json.loads(done.stdout)["runs"][0] if done.returncode == 0 else {"callbacks": [], "notes": []}
    subscriptions = [row for row in run["callbacks"] if row["kind"] == "subscription"]
    received, lost = (sum(row[key] for row in subscriptions) for key in ("received", "lost"))
    expect(received > 0 and lost == 0, f"{executor}: no message is lost ({received} received, {lost} lost)")
    expect(not run["notes"], f"{executor}: nothing was refused or left undone {run['notes']}")
    if failures:
        print(done.stderr)
        sys.exit(1)
