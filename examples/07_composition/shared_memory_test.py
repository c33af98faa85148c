#!/usr/bin/env python3
"""The three processes by shared memory: takt run starts RouDi with the memory that they need, says
which transport each topic uses, and leaves nothing behind.

usage: shared_memory_test.py TAKT PREFIX_OF_THE_INDEX
"""
# SPDX-License-Identifier: Apache-2.0
import glob
import json
import os
import signal
import subprocess
import sys
import tempfile
import time

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../cmake"))
from checks import check, environment, eventually, finish, roudi_runs, skip_without_shared_memory  # noqa: E402

takt, prefix = sys.argv[1:]
here = os.path.dirname(os.path.abspath(__file__))
pipeline = os.path.join(here, "pipeline.yaml")
environment["TAKT_COMPONENT_PATH"] = prefix


def run(*options, file=pipeline, **changes):
    """Runs the pipeline, and returns the exit code, what was said, and the topics of the result."""
    with tempfile.TemporaryDirectory() as folder:
        result = os.path.join(folder, "result.json")
        done = subprocess.run([takt, "run", file, "--duration", "1s", "--json", result, *options],
                              env=dict(environment, **changes), capture_output=True, text=True,
                              timeout=100)
        topics = json.load(open(result))["runs"][0]["topics"] if done.returncode == 0 else []
        return done.returncode, done.stdout + done.stderr, topics


skip_without_shared_memory()

status, said, topics = run()
check("without RouDi and without asking for it, topics go by UDP, and it is said",
      status == 0 and {topic["transport"] for topic in topics} == {"UDP: RouDi is not running"},
      status, said, topics)

for options in [["--transport", "shm"], ["--transport", "shm", "--composition", "single"]]:
    status, said, topics = run(*options)
    writers = {topic["topic"]: topic for topic in topics if topic["is_writer"]}
    readers = {topic["topic"]: topic for topic in topics if not topic["is_writer"]}
    name = " ".join(options)
    check(f"{name}: all messages go by shared memory, and arrive",
          status == 0 and len(writers) == 2
          and all(topic["transport"] == "shared memory" for topic in topics)
          and all(writers[topic]["messages"] == readers[topic]["messages"] > 0
                  and readers[topic]["lost"] == 0 for topic in writers), status, said, topics)
    # The process that sends to itself waited for messages that it had, and reported them as missing.
    check(f"{name}: nothing was in transit at the end", "still in transit" not in said, said)
    check(f"{name}: what is lent is not copied, and read where it lies",
          all(topic["uncopied"] == topic["messages"]
              for topic in topics if topic["topic"] == "/raw"), topics)
    check(f"{name}: nothing is left behind",
          not roudi_runs() and not os.path.exists("/dev/shm/iceoryx_mgmt")
          and not os.path.exists("/tmp/roudi") and not glob.glob("/tmp/takt_roudi_*"),
          glob.glob("/dev/shm/*"), glob.glob("/tmp/*roudi*"))

process = subprocess.Popen([takt, "run", pipeline, "--transport", "shm"], env=environment,
                           stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
eventually(lambda: roudi_runs() or process.poll() is not None)
time.sleep(1.5)
status, said, topics = run("--transport", "shm")
check("a second run uses the RouDi of the first",
      status == 0 and topics and all(topic["transport"] == "shared memory" for topic in topics),
      status, said)
check("and leaves it alone", roudi_runs())
process.send_signal(signal.SIGINT)
said = process.communicate(timeout=60)[0]
check("Ctrl-C ends the first, and its RouDi", process.returncode == 0 and not roudi_runs(),
      process.returncode, said)

# Those of a publisher that has gone were awaited too.
process = subprocess.Popen([takt, "run", pipeline], env=environment, stdout=subprocess.PIPE,
                           stderr=subprocess.STDOUT, text=True)


def unloads():
    return subprocess.run([takt, "component", "unload", "sensing", "1"], env=environment,
                          capture_output=True, text=True, timeout=60).returncode == 0


unloaded = eventually(unloads)
process.send_signal(signal.SIGINT)
said = process.communicate(timeout=60)[0]
check("with a publisher unloaded, Ctrl-C ends a run and nothing was in transit",
      unloaded and process.returncode == 0 and "still in transit" not in said, process.returncode, said)

with tempfile.TemporaryDirectory() as empty:
    status, said, _ = run("--transport", "shm", PATH=empty)
check("where it is required and not installed, that is an error",
      status != 0 and "iox-roudi is not installed; apt-get install iceoryx" in said, status, said)

finish()
