#!/usr/bin/env python3
"""What would be silence is said: names that nobody has, variables that change what runs, and nodes and
containers that others have under the same name.

usage: silence_test.py TAKT
"""
# SPDX-License-Identifier: Apache-2.0
import os
import pathlib
import re
import signal
import subprocess
import tempfile

from command import takt
from checks import check, environment, finish, proves

folder = tempfile.TemporaryDirectory()
HINT = "topics without publisher or without subscription: '/scam' (no publisher; subscribed by /reader)"


def file(name, text):
    path = pathlib.Path(folder.name) / name
    path.write_text(text)
    return str(path)


def run(*words, **changes):
    done = subprocess.run([takt, *words], env={**environment, **changes}, text=True, capture_output=True, timeout=120,
                          cwd=folder.name)
    return done.returncode, done.stdout, done.stderr


WORKLOAD = """
    - {component: takt::Workload, name: writer, parameters: {publishers: {topic: [scan], period_us: [5000], size_bytes: [10]}}}
    - {component: takt::Workload, name: reader, parameters: {subscriptions: {topic: [TOPIC]}}}
"""
misspelt = file("misspelt.yaml", "container:\n  components:" + WORKLOAD.replace("TOPIC", "scam"))
sound = file("sound.yaml", "container:\n  components:" + WORKLOAD.replace("TOPIC", "scan"))

# The hint came after ten seconds of a run only, and in no comparison.
status, output, errors = run("run", misspelt, "--duration", "50ms")
check("a short run ends with the topics that have one end", status == 0 and HINT in errors, errors)
status, output, errors = run("run", sound, "--duration", "50ms")
check("and with nothing when there are none", status == 0 and errors == "", errors)
status, output, errors = run("compare", misspelt, "--executors", "events,single_threaded", "--duration", "50ms",
                             "--repeat", "2")
check("a comparison says it once", status == 0 and errors.count(HINT) == 1, errors)

# An exported TAKT_EXECUTOR replaced the executors of every file, and nothing said so.
status, output, errors = run("run", sound, "--duration", "50ms", TAKT_EXECUTOR="single_threaded")
check("TAKT_EXECUTOR is noted", status == 0 and errors == "note: TAKT_EXECUTOR=single_threaded is in force\n", errors)
status, output, errors = run("run", sound, "--executor", "events", "--duration", "50ms", TAKT_EXECUTOR="single_threaded")
check("unless the command line says otherwise", status == 0 and errors == "", errors)

status, output, errors = run("component", "types", TAKT_COMPONENT_PATH=f"{folder.name}/nowhere")
check("a TAKT_COMPONENT_PATH that does not exist is named",
      status == 0 and f"there is no folder '{folder.name}/nowhere/share/takt/components'" in errors, errors)
check("commands' own components are not listed", "takt::Workload" in output and "takt::tools::" not in output, output)

managed = "    - {component: takt::LifecycleWorkload, name: talker}\n"
status, output, errors = run("run", file("alone.yaml", "container:\n  components:\n" + managed), "--duration", "50ms")
check("a lifecycle node that nobody can configure is named at once and at the end", status == 0 and
      "nobody can configure '/talker'" in errors and "note: lifecycle: '/talker' is not configured" in errors, errors)
# Each run of a simulation logged it besides, also where its DDS could configure the node.
status, output, errors = run("simulate", "alone.yaml", "--runs", "2", "--duration", "50ms")
check("a simulation names it once", errors.count("'/talker'") == 1 and
      "note: lifecycle: '/talker' is not configured" in errors, status, errors)
# It went on for hours, without a word.
status, output, errors = run("simulate", file("busy.yaml", "executors: {e: {type: triggered, let: 1ns}}\ncontainer:\n  components:\n"
                                              "    - {component: takt::Workload, name: n, executor: e}\n"))
check(proves("command_line.md", "more is an error, with the name of a callback or of the executor"),
      status == 2 and "busy.yaml:1: cannot simulate executor 'e': `let: 1ns` has more than 1000000 periods" in errors, status, errors)

wrong = file("wrong.yaml", "container:\n  components:\n    - {component: takt::Recorder, parameters: {fiel: x}}\n")
status, output, errors = run("run", wrong, "--duration", "50ms")
check("a misspelt parameter gets its suggestion", status != 0 and
      "has no parameter 'fiel'; did you mean 'file'? valid: " in errors, errors)

record = os.path.join(folder.name, "x.mcap")
status, output, errors = run("bag", "record", "/never", "-o", record, "--duration", "200ms")
check("a topic that never came is named", "no message of /never, which has had no publisher" in errors, status, errors)

# Two processes whose containers and nodes have the same names: one of them did what was asked of both.
two = file("two.yaml", "dds: {}\ncontainer:\n  name: robot\n  components:" + WORKLOAD.replace("TOPIC", "scan"))
processes = [subprocess.Popen([takt, "run", two], env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
             for _ in range(2)]
for _ in range(20):
    status, output, errors = run("component", "list")
    if "another process" in output:
        break
check("list shows both containers", "(another process has a container of this name)" in output, output, errors)
status, output, errors = run("component", "unload", "robot", "1")
check("unload asks which", status != 0 and "which container 'robot'? 2 processes have one of this name" in errors, errors)
check("and unloads nothing", run("component", "list")[1].count("/writer") == 1)
said = []
for process in processes:
    process.send_signal(signal.SIGINT)
    said.append(process.communicate(timeout=60)[1])
check("both warn", all(re.search(r"is served by node '/\w+' here, and by .* in another process", text) for text in said), said)
finish()
