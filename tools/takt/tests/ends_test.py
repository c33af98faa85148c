#!/usr/bin/env python3
"""A signal at a random moment ends a run of two processes soon, whatever they wait for.

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
# Of seconds: an end takes some tenths of one, and 2 where something hangs. A child that waited for
# matching endpoints, which the others had taken away, was deaf for 10.
LIMIT = 5

takt, rounds = sys.argv[1], int(sys.argv[2])
seed = random.randrange(1 << 32)
random.seed(seed)


def run(file, *options):
    return subprocess.Popen([takt, "run", file, *options], env=environment, text=True,
                            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)


def whole_life(file):
    """In seconds, of a run that is ready and ends at once."""
    begin = time.monotonic()
    run(file, "--duration", "1ms").communicate(timeout=60)
    return time.monotonic() - begin


def time_to_end(file, latest):
    process = run(file)
    time.sleep(random.uniform(0.02, latest))
    begin = time.monotonic()
    process.send_signal(random.choice((signal.SIGINT, signal.SIGTERM)))
    try:
        said = process.communicate(timeout=60)[1]
    except subprocess.TimeoutExpired:
        process.kill()
        said = process.communicate()[1]
    return time.monotonic() - begin, said


kinds = ["off"] + ["require"] * (shutil.which("iox-roudi") is not None and not roudi_runs())
with tempfile.TemporaryDirectory() as folder:
    for kind in kinds:
        file = os.path.join(folder, f"{kind}.yaml")
        with open(file, "w") as out:
            out.write(SYSTEM.format(kind))
        latest = min(whole_life(file), 3)  # one start on a busy machine took 25 s, so the sweep an hour
        ends = sorted(time_to_end(file, latest) for _ in range(rounds))
        times = [time for time, _ in ends]
        spread = ", ".join(f"{share} % in {times[len(times) * share // 100]:.2f} s" for share in (50, 90, 99))
        check(f"shared memory {kind}: {rounds} signals in the first {latest:.1f} s end it soon, {spread}, "
              f"the slowest in {times[-1]:.2f} s", times[-1] < LIMIT, f"seed {seed}", ends[-1][1])
finish()
