#!/usr/bin/env python3
"""The workspace builds, drives, runs under SCHED_FIFO by a word, and is compared: workspace_test.py TAKT LOOK_ALIKES

LOOK_ALIKES: packages in the place of what the workspace links, or the folders of their sources.
SPDX-License-Identifier: Apache-2.0
"""
import contextlib
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
sys.path.append(str(HERE / "../../cmake"))
from checks import check, environment, eventually, finish  # noqa: E402

takt, *look_alikes = map(os.path.abspath, sys.argv[1:])
robot = HERE / "rover.yaml"


def say(*command):
    done = subprocess.run([takt, *command], capture_output=True, text=True, timeout=600, env=environment)
    return done.returncode, done.stdout + done.stderr


def drive(work, *options):
    """A run in which a goal is reached; its results."""
    results = work / "results.json"
    log = open(work / "log", "w+")
    run = subprocess.Popen([takt, "run", robot, "--json", results, "--force", *options], env=environment, stdout=log, stderr=log)
    try:
        check("the controller is brought up", eventually(lambda: "active" in say("lifecycle", "get", "/controller")[1].split()[:1]))
        status, said = say("action", "send_goal", "/drive", "rover_msgs/action/Drive", "{distance: 0.3}", "-f")
        check("a goal is reached, with feedback", status == 0 and "remaining: 0.0" in said and "SUCCEEDED" in said, said)
        status, said = say("topic", "echo", "/tf", "--count", "1")
        check("its transform is there", status == 0 and "child_frame_id: \"base_link\"" in said, said)
        status, said = say("topic", "echo", "/diagnostics", "--count", "1")
        check("its diagnostics are there", status == 0 and "it stands" in said, said)
        status, said = say("param", "set", "/controller", "gain", "100.0")
        check("a parameter out of its range is refused", status != 0 and "0.1 to 10" in said, said)
    finally:
        with contextlib.suppress(ProcessLookupError):
            run.send_signal(signal.SIGINT)
        status = run.wait(timeout=60)
    log.seek(0)
    check("the run ends well", status == 0, log.read())
    return json.loads(results.read_text())["runs"][0]


with tempfile.TemporaryDirectory() as folder:
    work = pathlib.Path(folder)
    environment["AMENT_PREFIX_PATH"] = str(work / "install")
    status, said = say("ros2", "build", *look_alikes, HERE, "--build-base", work / "build", "--install-base", work / "install")
    check("the packages build", status == 0, said[-3000:])
    results = drive(work)
    check("one thread serves both", [thread["executor"] for thread in results["threads"]][:1] == ["base"], results["threads"])
    check("the way to the controller is measured", results["chains"][0]["instances"] > 0, results["chains"])
    results = drive(work, "--as", "picas")
    step = [thread for thread in results["threads"] if thread["name"] == "step"]
    refused = [note for note in results["notes"] if "SCHED_FIFO" in note]
    check("by a word, the chain has a real-time thread", step and (step[0]["in_force"]["policy"] == "SCHED_FIFO" or refused), results["threads"])
    status, said = say("compare", robot, "--executors", "file", "--as", "picas", "--duration", "1s")
    check("both are compared", status == 0 and "\nfile " in said and "\npicas " in said, said)
finish()
