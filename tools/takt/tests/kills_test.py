#!/usr/bin/env python3
"""Processes that talk by shared memory are killed in the middle of it, and RouDi too: each run ends all
the same, what is started again runs, and nothing is left behind.

usage: kills_test.py TAKT WITNESS_LIBRARY SECONDS
"""
# SPDX-License-Identifier: Apache-2.0
import glob
import os
import random
import signal
import subprocess
import sys
import tempfile
import time

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../cmake"))
from checks import (check, children_of, environment, eventually, finish, is_keeper, roudi_of,  # noqa: E402
                    roudi_runs, skip_without_shared_memory)

SENDER = """
  - name: sender{0}
    restart: {{policy: always, delay: 10ms, most: 1000}}
    components:
      - component: takt::Workload
        name: publisher{0}
        parameters: {{publishers.topic: [/data], publishers.period_us: [200], publishers.fixed_bytes: [1000]}}
"""
RECEIVER = """
  - name: receiver{0}
    restart: {{policy: always, delay: 10ms, most: 1000}}
    components:
      - component: takt::Workload
        name: subscriber{0}
        parameters: {{subscriptions.topic: [/data], subscriptions.fixed_bytes: [1000]}}
"""

takt, library, seconds = sys.argv[1:]
skip_without_shared_memory()
random.seed(1)


def containers_of(run):
    return [child for child in children_of(run) if not is_keeper(child)]


def kill(pid):
    try:
        os.kill(pid, signal.SIGKILL)
    except ProcessLookupError:
        pass


def left_behind():
    return (glob.glob("/tmp/*roudi*") + glob.glob("/tmp/iceoryx_rt_*") + glob.glob("/dev/shm/iceoryx*")
            + (["iox-roudi"] if roudi_runs() else []))


end = time.monotonic() + float(seconds)
runs = deaths = roudi_deaths = 0
with tempfile.TemporaryDirectory() as folder:
    system = os.path.join(folder, "system.yaml")
    with open(system, "w") as file:
        file.write("dds: {shared_memory: require}\ncontainers:\n"
                   + "".join(part.format(i) for part in (SENDER, RECEIVER) for i in (1, 2)))
    while time.monotonic() < end:
        runs += 1
        log = open(os.path.join(folder, "log"), "w+")
        run = subprocess.Popen([takt, "run", system], env=environment, stdout=log,
                               stderr=subprocess.STDOUT)
        stop = time.monotonic() + 6
        while time.monotonic() < stop and run.poll() is None:
            time.sleep(random.random() / 2)
            if random.random() < 0.2 and (found := roudi_of(run.pid)):
                roudi_deaths += 1
                kill(found[0])
            elif found := containers_of(run.pid):
                deaths += 1
                kill(random.choice(found))
        run.send_signal(signal.SIGINT)
        try:
            run.wait(timeout=100)
        except subprocess.TimeoutExpired:
            log.seek(0)
            check("each run ends", False, log.read()[-4000:])
            for pid in containers_of(run.pid) + [run.pid]:
                kill(pid)
        if not eventually(lambda: not left_behind()):
            check("a run leaves nothing behind", False, left_behind())
            break

    # One that hangs in shared memory is not waited for longer than 20 s. Stopped, it hangs too.
    with open(system, "a") as file:
        file.write("      - {component: Witness, library: " + os.path.abspath(library) + "}\n")
    run = subprocess.Popen([takt, "run", system], env=dict(environment, WITNESS=folder),
                           stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    eventually(lambda: os.path.exists(os.path.join(folder, "witness.ticks")))  # before, nobody hangs
    os.kill(containers_of(run.pid)[0], signal.SIGSTOP)
    run.send_signal(signal.SIGINT)
    said = run.communicate(timeout=100)[1]
    check("a process that does not answer is killed at the end", run.returncode == 1
          and "process 'sender1' was ended by signal 9" in said, run.returncode, said)
    check("and no other", "it does not end" not in said, said)
check(f"{runs} runs have ended though {deaths} of their processes were killed, and RouDi "
      f"{roudi_deaths} times", runs > 0 and deaths > 0)
finish()
