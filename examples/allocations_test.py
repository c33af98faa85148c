#!/usr/bin/env python3
"""No executor's thread of an example allocates while it spins, as the documents advise.

usage: allocations_test.py TAKT FILE...
"""
# SPDX-License-Identifier: Apache-2.0
import json
import os
import subprocess
import sys

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../cmake"))
from checks import check, environment, finish  # noqa: E402

takt, *files = sys.argv[1:]
for file in files:
    done = subprocess.run([takt, "run", file, "--composition", "single", "--duration", "500ms", "--json", "-"],
                          env=environment, capture_output=True, text=True, timeout=60)
    check(f"{file} runs", done.returncode == 0, done.stderr)
    if done.returncode != 0:
        continue
    for process in json.loads(done.stdout)["runs"][0]["processes"]:
        count = process["allocations_while_spinning"]
        check(f"{file}: {count} allocations in {process['name']}", count == 0)
finish()
