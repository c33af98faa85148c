#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Names that ROS 2 does not permit, announced by another process, end nothing and steer no terminal.

usage: hostile_test.py TAKT PEERS
"""
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

from command import run, takt
from checks import check, environment, finish

library = os.path.abspath(sys.argv[2])
temporary = tempfile.TemporaryDirectory()
folder = pathlib.Path(temporary.name)
domain = environment["ROS_DOMAIN_ID"]


def start(*words):
    return subprocess.Popen([takt, *words], env=environment, stdout=subprocess.DEVNULL,
                            stderr=subprocess.PIPE, text=True, errors="replace")


def system(name, components):
    file = folder / f"{name}.yaml"
    file.write_text(f"dds: {{domain: {domain}, shared_memory: off}}\n"
                    f"container: {{name: {name}, components: [{components}]}}\n")
    return start("run", str(file))


def end(what, process):
    check(f"{what} goes on", process.poll() is None, process.returncode)
    process.send_signal(signal.SIGINT)
    said = process.communicate(timeout=60)[1]
    check(f"{what} ends well", process.returncode == 0, process.returncode, said)
    check(f"{what} writes no escape sequence", "\x1b" not in said and "\x07" not in said, said)


def documents(*words):
    """What the command writes, as text and as JSON."""
    file = folder / "out.json"
    done = subprocess.run([takt, *words, "--json", str(file)], env=environment, timeout=60,
                          capture_output=True)
    check(f"{' '.join(words)} ends well", done.returncode == 0, done.stderr)
    wrong = [byte for byte in done.stdout + done.stderr if byte < 32 and byte not in b"\n\t" or byte == 127]
    check("and writes no control characters", not wrong, done.stdout)
    done.stdout.decode()  # throws unless it is UTF-8
    return done.stdout.decode(), json.loads(file.read_text())


# A publisher of rt/1abc ended a container with a recorder of all topics, and `takt bag record`.
recorder = system("robot", f"{{component: takt::Recorder, parameters: {{file: {folder}/r.mcap}}}}")
bag = start("bag", "record", "--all", "-o", str(folder / "b.mcap"))
hostile = system("hostile", f"{{component: peers::Hostile, library: {library}}}")
for _ in range(50):
    text, rows = documents("topic", "list")
    if any(row["topic"] == "/1abc" for row in rows):
        break
check("names are escaped", "ev\\u001b]0;owned\\u0007il/msg/A\\nb  9  9" in text, text)
text, rows = documents("node", "list")
check("so are nodes", any("\\n" in row["node"] for row in rows), rows)
documents("topic", "info", "/1abc")
documents("node", "info", "/hostile")
time.sleep(1)  # the recorders look five times a second
end("a container with a recorder of all topics", recorder)
end("takt bag record --all", bag)
end("the peer", hostile)
finish()
