#!/usr/bin/env python3
"""The same three component classes as three processes, in one, composed by hand, and loaded into a
running container of each type, compute the same.

usage: composition_test.py TAKT MAIN PREFIX_OF_THE_INDEX
"""
# SPDX-License-Identifier: Apache-2.0
import os
import re
import signal
import subprocess
import sys
import time

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../cmake"))
from checks import check, environment, finish  # noqa: E402

takt, main, prefix = sys.argv[1:]
here = os.path.dirname(os.path.abspath(__file__))
environment["TAKT_COMPONENT_PATH"] = prefix
expected = None


def run(*command):
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120)
    check(" ".join(command), done.returncode == 0, done.returncode, done.stderr)
    return done


def compare(how, text):
    global expected
    sums = re.findall(r"(\d+ samples, sum \d+)", text)
    expected = expected or (sums[0] if sums else None)
    check(f"{how}: {sums}", sums == [expected], "not", expected, text)


def loaded(executor):
    container = subprocess.Popen([takt, "run", "--name", "c", "--load", "index",
                                  "--executor", executor],
                                 env=environment, stdout=subprocess.DEVNULL,
                                 stderr=subprocess.PIPE, text=True)
    try:
        for component in ("Sink", "Filter", "Source"):
            run(takt, "component", "load", "c", "pipeline::" + component)
        time.sleep(1)
        listed = run(takt, "component", "list", "c").stdout
        check(f"{executor}: all are listed",
              all(name in listed for name in ("/sink", "/filter", "/source")), listed)
        for number in ("3", "2", "1"):
            run(takt, "component", "unload", "c", number)
        listed = run(takt, "component", "list", "c").stdout
        check(f"{executor}: all are unloaded", "(empty)" in listed, listed)
    finally:
        container.send_signal(signal.SIGINT)
        text = container.communicate(timeout=60)[1]
    check(f"{executor}: the container ends well", container.returncode == 0,
          container.returncode, text)
    return text


pipeline = os.path.join(here, "pipeline.yaml")
compare("three processes", run(takt, "run", pipeline, "--duration", "1500ms").stderr)
compare("one process", run(takt, "run", pipeline, "--composition", "single", "--duration",
                           "1s").stderr)
executors = [line.split()[0] for line in run(takt, "list", "executors").stdout.splitlines()]
for executor in executors:
    compare("by hand, " + executor, run(main, executor).stderr)
for executor in executors:
    if executor != "static_single_threaded":  # which takes nothing after its first spin
        compare("loaded, " + executor, loaded(executor))
refused = subprocess.run([takt, "component", "load", "nobody", "pipeline::Sink"], env=environment,
                         capture_output=True, text=True)
check("a container that is not there", refused.returncode == 1
      and "container 'nobody' was not found" in refused.stderr,
      refused.returncode, refused.stderr)
finish()
