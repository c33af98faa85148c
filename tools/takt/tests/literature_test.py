#!/usr/bin/env python3
"""takt bench literature: each experiment has figures, and each claim holds in virtual time: literature_test.py TAKT

What runs under the real kernel is only seen to run: the machine may be as busy as it likes.
SPDX-License-Identifier: Apache-2.0
"""
import json
import os
import subprocess
import sys

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../cmake"))
from checks import check, finish  # noqa: E402

SIMULATED = ", simulated"
done = subprocess.run([sys.argv[1], "bench", "literature", "--duration", "600ms", "--repeat", "1", "--json", "-"],
                      capture_output=True, text=True, timeout=300)
check("it ends well", done.returncode == 0, done.returncode, done.stderr)
experiments = json.loads(done.stdout)["experiments"]
check("each paper has an experiment", len(experiments) == 11, [experiment["name"] for experiment in experiments])
for experiment in experiments:
    name = experiment["name"]
    check(f"{name}: what differs from the paper is named", experiment["deviations"])
    rows = {(row["series"], row.get("x")): row for row in experiment["rows"]}
    for (series, x), row in rows.items():
        for metric in experiment["metrics"] if "metrics" in row else ():
            check(f"{name}: {series} at {x} has {metric}", metric in row["metrics"], row)
    check(f"{name}: one run decides nothing", all(claim["verdict"] == "open" for claim in experiment["claims"]), experiment["claims"])
    for claim in experiment["claims"]:
        if not claim["simulated"]:
            continue
        less, more = (rows[claim[side] + SIMULATED, claim.get("x")]["metrics"][claim["metric"]]["median"] if claim[side] else None
                      for side in ("less", "more"))
        check(f"{name}, in virtual time: {claim['text']}", less < more if claim["more"] else less == 0, less, more)
finish()
