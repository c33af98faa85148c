#!/usr/bin/env python3
"""What systemd hears of a service: READY=1 when the run has begun, WATCHDOG=1 in time, STOPPING=1.

usage: service_manager_test.py TAKT
"""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import signal
import socket
import subprocess
import tempfile

from command import takt
from checks import check, environment, finish

WORKLOAD = "{component: takt::Workload, name: NAME}"
folder = tempfile.TemporaryDirectory()
one, two = (pathlib.Path(folder.name) / name for name in ("one.yaml", "two.yaml"))
one.write_text(f"realtime: off\ncontainer: {{components: [{WORKLOAD}]}}\n")
two.write_text("realtime: off\ndds: {shared_memory: off}\ncontainers:\n" + "".join(
    f"  - {{name: {name}, components: [{WORKLOAD.replace('NAME', name)}]}}\n" for name in ("left", "right")))


def service(words, name, **variables):
    """The process, and the socket of its service manager."""
    heard = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    heard.bind(name.replace("@", "\0"))
    heard.settimeout(60)
    started = subprocess.Popen([takt, *words], text=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                               env=environment | {"NOTIFY_SOCKET": name, **variables})
    return started, heard


def ends(started):
    started.send_signal(signal.SIGTERM)
    errors = started.communicate(timeout=60)[1]
    return started.returncode, errors


path = f"{folder.name}/notify"
for what, words, name in (("one process", ["run", one], path), ("an abstract name", ["run", one], f"@takt{path}"),
                          ("two processes", ["run", two], f"{path}2")):
    started, heard = service(words, name)
    said = heard.recv(100)
    check(f"{what}: it is ready", said == b"READY=1", said)
    status, errors = ends(started)
    check(f"{what}: SIGTERM ends it in order", status == 0, status, errors)
    heard.settimeout(0)
    said = heard.recv(100)
    check(f"{what}: it stops, and nobody has asked for more", said == b"STOPPING=1", said)

started, heard = service(["run", one], f"{path}3", WATCHDOG_USEC="20000")
said = [heard.recv(100) for _ in range(4)]
check("a watchdog hears of it again and again", said == [b"READY=1"] + 3 * [b"WATCHDOG=1"], said)
check("and SIGTERM ends it in order", ends(started)[0] == 0)
started, heard = service(["run", one], f"{path}4", WATCHDOG_USEC="20000", WATCHDOG_PID="1")
check("another process's watchdog does not",
      (heard.recv(100), ends(started)[0], heard.recv(100)) == (b"READY=1", 0, b"STOPPING=1"))
started, heard = service(["run", pathlib.Path(folder.name) / "none.yaml"], f"{path}5")
errors = started.communicate(timeout=60)[1]
heard.settimeout(0)
try:
    said = heard.recv(100)
except BlockingIOError:
    said = None
check("what does not start is not ready", started.returncode == 2 and said is None, said, errors)
finish()
