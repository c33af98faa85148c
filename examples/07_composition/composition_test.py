#!/usr/bin/env python3
"""The same three component classes as three processes, in one, composed by hand, and loaded into a
running container of each type, compute the same.

usage: composition_test.py TAKT MAIN PREFIX_OF_THE_INDEX
"""
import os
import re
import signal
import subprocess
import sys
import time

takt, main, prefix = sys.argv[1:]
here = os.path.dirname(os.path.abspath(__file__))
domain = str(60 + os.getpid() % 100)
environment = dict(os.environ, TAKT_COMPONENT_PATH=prefix, ROS_DOMAIN_ID=domain)
failures = []
expected = None


def run(*command):
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120)
    if done.returncode != 0:
        failures.append(f"{' '.join(command)} ended with {done.returncode}: {done.stderr}")
    return done


def compare(how, text):
    global expected
    sums = re.findall(r"(\d+ samples, sum \d+)", text)
    expected = expected or (sums[0] if sums else None)
    print(f"{how:32} {sums}")
    if sums != [expected]:
        failures.append(f"{how}: {sums}, not {expected}: {text}")


def loaded(executor):
    container = subprocess.Popen([takt, "run", "--name", "c", "--executor", executor],
                                 env=environment, stdout=subprocess.DEVNULL,
                                 stderr=subprocess.PIPE, text=True)
    try:
        for component in ("Sink", "Filter", "Source"):
            run(takt, "component", "load", "c", "pipeline::" + component)
        time.sleep(1)
        listed = run(takt, "component", "list", "c").stdout
        if [n for n in ("/sink", "/filter", "/source") if n not in listed]:
            failures.append(f"{executor}: not all are listed: {listed}")
        for number in ("3", "2", "1"):
            run(takt, "component", "unload", "c", number)
        listed = run(takt, "component", "list", "c").stdout
        if "(empty)" not in listed:
            failures.append(f"{executor}: not all are unloaded: {listed}")
    finally:
        container.send_signal(signal.SIGINT)
        text = container.communicate(timeout=60)[1]
    if container.returncode != 0:
        failures.append(f"container under {executor} ended with {container.returncode}: {text}")
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
if refused.returncode != 2 or "container 'nobody' has not been found" not in refused.stderr:
    failures.append(f"no container: {refused.returncode} {refused.stderr}")
for failure in failures:
    print(failure)
sys.exit(1 if failures else 0)
