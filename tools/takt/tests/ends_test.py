#!/usr/bin/env python3
"""A signal at a random moment of a start ends a run of two processes soon, whatever they wait for.

usage: ends_test.py TAKT ROUNDS
"""
# SPDX-License-Identifier: Apache-2.0
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../cmake"))
from checks import check, environment, finish, roudi_runs  # noqa: E402

SYSTEM = """
dds: {{discovery: lo, shared_memory: {0}}}
containers:
  - name: sender
    components:
      - component: takt::Workload
        name: publisher
        parameters: {{publishers.topic: [/data], publishers.period_us: [1000], publishers.fixed_bytes: [1000]}}
  - name: receiver
    components:
      - component: takt::Workload
        name: subscriber
        parameters: {{subscriptions.topic: [/data], subscriptions.fixed_bytes: [1000]}}
"""
# Of seconds: an end takes some tenths of one. A child that waited for matching endpoints, which the
# others had taken away, was deaf for 10.
LIMIT = 5

takt, rounds = sys.argv[1], int(sys.argv[2])
seed = random.randrange(1 << 32)
random.seed(seed)


def time_to_end(file, shared_memory):
    run = subprocess.Popen([takt, "run", file], env=environment, text=True,
                           stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    time.sleep(random.uniform(0.02, 0.4 if shared_memory == "off" else 0.8))
    begin = time.monotonic()
    run.send_signal(random.choice((signal.SIGINT, signal.SIGTERM)))
    try:
        said = run.communicate(timeout=60)[1]
    except subprocess.TimeoutExpired:
        run.kill()
        said = run.communicate()[1]
    return time.monotonic() - begin, said


kinds = ["off"] + ["require"] * (shutil.which("iox-roudi") is not None and not roudi_runs())
with tempfile.TemporaryDirectory() as folder:
    for kind in kinds:
        file = os.path.join(folder, f"{kind}.yaml")
        with open(file, "w") as out:
            out.write(SYSTEM.format(kind))
        times = [time_to_end(file, kind) for _ in range(rounds)]
        longest, said = max(times)
        check(f"shared memory {kind}: {rounds} signals end the start soon, the slowest in "
              f"{longest:.1f} s", longest < LIMIT, f"seed {seed}", said)
finish()
