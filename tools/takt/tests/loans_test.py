#!/usr/bin/env python3
"""Many messages by shared memory between two processes: each that was sent is received, or counted as
overwritten.

usage: loans_test.py TAKT SECONDS
"""
# SPDX-License-Identifier: Apache-2.0
import json
import os
import subprocess
import sys
import tempfile

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../cmake"))
from checks import check, environment, finish, skip_without_shared_memory  # noqa: E402

SYSTEM = """
dds: {{shared_memory: require}}
container:
  name: loans
  components:
    - component: takt::Workload
      name: publisher
      parameters:
        publishers.topic: [/data]
        publishers.period_us: [{period_us}]
        publishers.fixed_bytes: [{bytes}]
        publishers.depth: [{depth}]
    - component: takt::Workload
      name: subscriber
      parameters:
        subscriptions.topic: [/data]
        subscriptions.fixed_bytes: [{bytes}]
        subscriptions.depth: [{depth}]
"""

takt, seconds = sys.argv[1:]
skip_without_shared_memory()

for size, period_us, depth in ((1_000, 100, 100), (8_000_000, 2_000, 4)):
    with tempfile.TemporaryDirectory() as folder:
        system, result = os.path.join(folder, "loans.yaml"), os.path.join(folder, "result.json")
        with open(system, "w") as file:
            file.write(SYSTEM.format(bytes=size, period_us=period_us, depth=depth))
        subprocess.run([takt, "run", system, "--composition", "per-node", "--duration", seconds + "s",
                        "--json", result], check=True, stdout=subprocess.DEVNULL,
                       env=environment)
        run = json.load(open(result))["runs"][0]
    writer, = (topic for topic in run["topics"] if topic["is_writer"])
    received, overwritten = next((callback["received"], callback["dropped"])
                                 for callback in run["callbacks"] if callback["kind"] == "subscription")
    counts = (f"{writer['messages']} sent, {writer['uncopied']} of them uncopied, "
              f"{received} received, {overwritten} overwritten, {writer['lost']} not sent")
    # The timer may miss releases, and has none beyond the duration, which a busy machine ends late.
    most = run["duration_s"] * 1e6 / period_us + 2
    check(f"{size} B every {period_us} µs: {counts}",
          writer["transport"] == "shared memory" and 0 < writer["messages"] <= most
          and received + overwritten == writer["messages"] and received > writer["messages"] / 2)
finish()
