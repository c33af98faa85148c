#!/usr/bin/env python3
"""Whatever the variables of the environment say: a command works, or its one error names the variable. And
whatever right is missing, the run ends if the file requires it.

usage: environment_test.py TAKT
"""
# SPDX-License-Identifier: Apache-2.0
import os
import pathlib
import shutil
import subprocess
import tempfile

from command import takt
from checks import check, environment, finish
from limits import SETPRIV, faults, run

# Each variable that takt reads (tools/check knows the others by this list), and the commands that do.
JOINS, INDEX = ["run", "joined.yaml", "--duration", "10ms"], ["component", "types"]
RUNS = ["run", "plain.yaml", "--duration", "10ms"]
TEMPORARY = ["latency", "--load", "io", "-l", "10", "-q", "--executor", "none"]
VARIABLES = {
    "AMENT_PREFIX_PATH": [INDEX, ["interface", "show", "fz/msg/Nothing"]],
    "CYCLONEDDS_URI": [JOINS],
    "NOTIFY_SOCKET": [RUNS],
    "PATH": [["run", "shared.yaml", "--duration", "10ms"]],  # where RouDi is
    "ROS_AUTOMATIC_DISCOVERY_RANGE": [JOINS],
    "ROS_DOMAIN_ID": [JOINS],
    "ROS_LOCALHOST_ONLY": [JOINS],
    "ROS_STATIC_PEERS": [JOINS],
    "TAKT_COMPONENT_PATH": [INDEX],
    "TAKT_EXECUTOR": [RUNS],
    "TAKT_LTTNG": [RUNS],
    "TAKT_PLACEMENT": [RUNS],
    "TAKT_SCHEDULER": [RUNS],
    "WATCHDOG_PID": [RUNS],
    "WATCHDOG_USEC": [RUNS],
    # Which the library of C++ reads:
    "TMPDIR": [TEMPORARY],
}
# Which takt does not read, though others do.
OTHERS = ("HOME", "COLUMNS", "NO_COLOR", "LC_ALL", "TERM", "XDG_CONFIG_HOME", "XDG_RUNTIME_DIR")
VALUES = ["", "nonsense", "-1", "99999999999999999999", "%s%n", "\udcff\udcfe", "\x1b]0;owned\x07", "line\nbreak",
          "../..", "/dev/zero", "/nowhere", "x" * 100_000, "/" * 100_000, "a;" * 10_000, "<", "<CycloneDDS>",
          "file:///nowhere", "file://{folder}/fifo", "file:///dev/zero", "file://{folder}", "{folder}/fifo", "{folder}/plain.yaml"]

folder = pathlib.Path(tempfile.mkdtemp())
(folder / "plain.yaml").write_text("realtime: off\ncontainer: {components: [{component: takt::Workload, name: idle}]}\n")
for name, shared_memory in (("joined", "off"), ("shared", "require")):
    (folder / f"{name}.yaml").write_text(f"dds: {{shared_memory: {shared_memory}}}\n" + (folder / "plain.yaml").read_text())
os.mkfifo(folder / "fifo")


def wrong_ends(variables, words, value):
    value = value.replace("{folder}", str(folder))
    status, output, errors = run([takt, *words], folder, environment | dict.fromkeys(variables, value))
    # Without a path, RouDi is missing.
    return [f"{value[:60]!r}: {' '.join(words)}: {fault}: {status} {errors[:300]} {output[:100]}"
            for fault in faults(status, output, errors, (*variables, "iox-roudi"), False)]


for variable, commands in VARIABLES.items():
    wrong = [fault for value in VALUES for words in commands for fault in wrong_ends([variable], words, value)]
    check(f"{variable} may be anything", not wrong, "\n".join(wrong[:5]))
wrong = [fault for value in VALUES for fault in wrong_ends(OTHERS, RUNS, value)]
check(f"so may {', '.join(OTHERS)}", not wrong, "\n".join(wrong[:5]))

# Without the right to, `require` ends the run, whichever thread of the file asks.
powerless = ["prlimit", "--rtprio=0:0", *([SETPRIV, "--bounding-set=-sys_nice"] if os.getuid() == 0 else [])]
for thread in ("main", "log", "signals"):
    (folder / "required.yaml").write_text(
        f"realtime: require\nthreads: {{{thread}: {{policy: SCHED_FIFO, priority: 9}}}}\n"
        "container: {components: [{component: takt::Workload, name: idle}]}\n")
    done = subprocess.run([*powerless, takt, "run", "required.yaml", "--duration", "10ms"], cwd=folder,
                          env=environment, text=True, capture_output=True, timeout=60)
    check(f"{thread} is refused", done.returncode == 1 and f"thread '{thread}' was refused SCHED_FIFO" in done.stderr, done)
shutil.rmtree(folder)
finish()
