#!/usr/bin/env python3
"""A robot's lifecycle nodes come up in the order of its file and go down in the reverse order, under
two executors, and no message is lost: robots_test.py TAKT FILE

SPDX-License-Identifier: Apache-2.0
"""
import json
import os
import re
import subprocess
import sys

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../cmake"))
from checks import check, environment, failures, finish  # noqa: E402

takt, robot = sys.argv[1:]
order = re.search(r"bring_up: \[(.*?)\]", open(robot).read(), re.DOTALL).group(1)
nodes = ["/" + name.strip() for name in order.split(",")]
expected = [(word, node) for node in nodes for word in ("configure", "activate")]
expected += [(word, node) for node in reversed(nodes) for word in ("deactivate", "cleanup", "shutdown")]

for executor in ("isolated", "multi_threaded"):
    done = subprocess.run([takt, "run", robot, "--executor", executor, "--duration", "3s", "--json", "-"],
                          env=environment, capture_output=True, text=True, timeout=60)
    check(f"{executor}: the run ends well ({done.returncode})", done.returncode == 0)
    happened = re.findall(r"lifecycle: (\w+) (/\w+)", done.stderr)
    check(f"{executor}: up in order, down in reverse ({len(happened)} steps)", happened == expected)
    run = json.loads(done.stdout)["runs"][0] if done.returncode == 0 else {"callbacks": [], "notes": []}
    subscriptions = [row for row in run["callbacks"] if row["kind"] == "subscription"]
    received, lost = (sum(row[key] for row in subscriptions) for key in ("received", "lost"))
    # 4,300 and 5,500 in three seconds where no release is missed
    check(f"{executor}: no message is lost ({received} received, {lost} lost)",
          lost == 0 and 1000 < received < 6000)
    notes = [note for note in run["notes"] if not note.startswith("topics without publisher")]
    check(f"{executor}: nothing was refused or left undone {notes}", not notes)
    if failures:
        print(done.stderr)
        break
finish()
