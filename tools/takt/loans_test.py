#!/usr/bin/env python3
"""Many messages by shared memory between two processes: each that was sent is received, or counted as
overwritten.

usage: loans_test.py TAKT SECONDS
"""
import json
import os
import shutil
import subprocess
import sys
import tempfile

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
if not shutil.which("iox-roudi"):
    print("skipped: iox-roudi is not installed (apt-get install iceoryx)")
    sys.exit(77)
if subprocess.run(["pidof", "iox-roudi"], stdout=subprocess.DEVNULL).returncode == 0:
    print("skipped: a RouDi of somebody else runs")
    sys.exit(77)

failed = False
for size, period_us, depth in ((1_000, 100, 100), (8_000_000, 2_000, 4)):
    with tempfile.TemporaryDirectory() as folder:
        system, result = os.path.join(folder, "loans.yaml"), os.path.join(folder, "result.json")
        with open(system, "w") as file:
            file.write(SYSTEM.format(bytes=size, period_us=period_us, depth=depth))
        subprocess.run([takt, "run", system, "--composition", "per-node", "--duration", seconds + "s",
                        "--json", result], check=True, stdout=subprocess.DEVNULL,
                       env=dict(os.environ, ROS_DOMAIN_ID=str(60 + os.getpid() % 100)))
        run = json.load(open(result))["runs"][0]
    writer, = (topic for topic in run["topics"] if topic["is_writer"])
    received, overwritten = next((callback["received"], callback["dropped"])
                                 for callback in run["callbacks"] if callback["kind"] == "subscription")
    counts = (f"{writer['messages']} sent, {writer['uncopied']} of them uncopied, "
              f"{received} received, {overwritten} overwritten, {writer['lost']} not sent")
    holds = (writer["way"] == "shared memory" and received + overwritten == writer["messages"] > 0
             and received > writer["messages"] / 2)
    print("holds " if holds else "FAILED", f"{size} B every {period_us} µs: {counts}")
    failed |= not holds
sys.exit(1 if failed else 0)
