#!/usr/bin/env python3
"""Another user of this machine: what lies where takt's temporary files were once foreseen is neither used nor
changed, and what root's containers are asked for is refused.

usage: strangers_test.py TAKT LIBRARY: any, of which the other user has a copy
"""
# SPDX-License-Identifier: Apache-2.0
import fcntl
import os
import pathlib
import re
import shutil
import signal
import stat
import subprocess
import sys
import time

from command import takt
from checks import check, environment, finish, skip

STRANGER = 65534
NAMESPACES = ("unshare", "--mount", "--pid", "--ipc", "--fork", "--mount-proc", "--kill-child")
library = str(pathlib.Path(sys.argv[2]).resolve())
if os.getuid() != 0:
    skip("only root can be two users")
if takt.startswith(("/tmp/", "/dev/shm/")):
    skip("the build is in /tmp, which this test replaces")
if "--inside" not in sys.argv:
    if subprocess.run([*NAMESPACES, "true"], capture_output=True, check=False).returncode != 0:
        skip("this user may make no namespaces (unshare)")
    sys.exit(subprocess.run([*NAMESPACES, sys.executable, *sys.argv, "--inside"], check=False).returncode)
for place in ("/tmp", "/dev/shm"):
    subprocess.run(["mount", "-t", "tmpfs", "-o", "mode=1777", "none", place], check=True)
home = pathlib.Path("/tmp/home")  # root's
home.mkdir(0o700)
secret = home / "secret"
secret.write_text("precious\n")
os.chdir(home)


def stranger(work):
    """Does it as another user, in a process of its own; returns whether it did."""
    child = os.fork()
    if child == 0:
        status = 1
        try:
            os.setgroups([])
            os.setresgid(STRANGER, STRANGER, STRANGER)
            os.setresuid(STRANGER, STRANGER, STRANGER)
            os.umask(0)
            status = 0 if work() is not False else 1
        finally:
            os._exit(status)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


def reaches_the_build():
    return subprocess.run([takt, "--version"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False).returncode == 0


if not stranger(reaches_the_build):
    skip("the build cannot be reached by another user")


def run(*words, **changes):
    return subprocess.run([takt, *words], env=environment | changes, text=True, capture_output=True, stdin=subprocess.DEVNULL,
                          timeout=100, check=False)


# ---- Squatted names ----

EVIL = b"container: {components: [{component: X, library: /tmp/evil.so}]}\n"
PIDS = range(1, 400)  # all of this namespace
NAMES = [f"takt_{what}_{pid}{ending}" for what in ("selftest", "bench", "load") for pid in PIDS for ending in ("", ".yaml")]


def squat(kind):
    for name in NAMES:
        path = pathlib.Path("/tmp", name)
        if kind == "file":
            path.write_bytes(EVIL)
        elif kind == "folder":
            path.mkdir()
            (path / "evil.yaml").write_bytes(EVIL)
        else:
            path.symlink_to(secret)


def what_lies_there():
    """By name: all but the time of the last reading."""
    seen = {}
    for name in NAMES:
        path = pathlib.Path("/tmp", name)
        if not os.path.lexists(path):
            continue
        about = path.lstat()
        content = path.read_bytes() if stat.S_ISREG(about.st_mode) else sorted(os.listdir(path)) if stat.S_ISDIR(about.st_mode) else ()
        seen[name] = (about.st_uid, about.st_mode, about.st_mtime_ns, content)
    return seen


def clear():
    for path in pathlib.Path("/tmp").iterdir():
        if path != home:
            shutil.rmtree(path) if path.is_dir() and not path.is_symlink() else path.unlink()


for kind in ("file", "folder", "link"):
    stranger(lambda kind=kind: squat(kind))
    before = what_lies_there()
    for words in (("selftest", "--executors", "events", "--transports", "intra", "--duration", "50ms"),
                  ("bench", "executors", "--duration", "10ms", "--repeat", "1"),
                  ("latency", "--load", "io", "-D", "50ms", "-q", "--executor", "none")):
        done = run(*words)
        # On a busy machine the first has no figures of so short a time.
        check(f"takt {words[0]} takes no foreign {kind}", done.returncode in (0, 1) or "no message of" in done.stderr,
              done.returncode, done.stderr)
    now = what_lies_there()
    check(f"foreign {kind}s are as they were", now == before and len(before) == len(NAMES),
          [name for name in NAMES if now.get(name) != before.get(name)])
    check("and so is root's file", secret.read_text() == "precious\n")
    check("and none of ours are left", {path.name for path in pathlib.Path("/tmp").iterdir()} == {*NAMES, "home"})
    clear()

# RouDi's names are iceoryx's: its owner can keep shared memory from others, but nothing waits for ever.
(home / "shared.yaml").write_text(
    "dds: {shared_memory: require}\ncontainer:\n  components:\n    - component: takt::Workload\n"
    "      parameters: {publishers: {topic: [x], period_us: [1000], fixed_bytes: [1000]}}\n")
for name in (".takt_roudi_0.start", ".takt_roudi_0.report", "roudi", "iox-unique-roudi.lock") if shutil.which("iox-roudi") else ():
    path = pathlib.Path("/tmp", name)
    hold, release = os.pipe()
    holder = os.fork()
    if holder == 0:
        os.setresuid(STRANGER, STRANGER, STRANGER)
        file = os.open(path, os.O_CREAT | os.O_RDWR, 0o666)
        os.fchmod(file, 0o666)
        fcntl.flock(file, fcntl.LOCK_EX)
        os.write(release, b"1")
        time.sleep(100)
        os._exit(0)
    os.read(hold, 1)
    begin = time.monotonic()
    done = run("run", "shared.yaml", "--duration", "50ms")
    took = time.monotonic() - begin
    check(f"/tmp/{name} of another user: it ends, in {took:.1f} s", took < 30)
    check("with an error that names it, or it is not used", done.returncode == 0 or done.returncode == 1 and
          re.search(f"{re.escape(name)}|RouDi", (done.stderr.splitlines() or [""])[-1]), done.returncode, done.stderr)
    os.kill(holder, signal.SIGKILL)
    os.waitpid(holder, 0)
    clear()


# ---- The folder that takt is started in ----

# Python imports first what lies there, and `takt ros2 run` took ./install first.
shared = pathlib.Path("/tmp/shared")
shared.mkdir()
shared.chmod(0o1777)
ours = home / "ours/lib/demo"
ours.mkdir(parents=True)
theirs = shared / "install/lib/demo"


def program(folder, text):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "talker").write_text(f"#!/bin/sh\necho {text}\n")
    (folder / "talker").chmod(0o755)


def lay_traps():
    for name in ("matplotlib.py", "json.py", "types.py", "sitecustomize.py"):
        (shared / name).write_text("open('/tmp/shared/ran', 'w').close()\n")
    (shared / "matplotlibrc").write_text("backend: module://matplotlib_of_a_stranger\n")
    program(theirs, "theirs")


program(ours, "ours")
stranger(lay_traps)
os.chdir(shared)
done = run("latency", "-D", "10ms", "-q", "--executor", "none", "--report", str(home / "report.html"))
check("a report runs nothing of a stranger's in the folder that takt is started in", not (shared / "ran").exists() and
      (done.returncode == 0 or "python3-matplotlib" in done.stderr), done.returncode, done.stderr)
prefixes = {"AMENT_PREFIX_PATH": str(home / "ours")}
done = run("ros2", "run", "demo", "talker", **prefixes)
check("takt ros2 run leaves a stranger's ./install out, and says so", done.stdout == "ours\n" and "--install-base" in done.stderr,
      done.stdout, done.stderr)
done = run("ros2", "run", "demo", "talker", AMENT_PREFIX_PATH="")
check("also where there is no other", done.returncode != 0 and "--install-base" in done.stderr, done.stdout, done.stderr)
check("unless it is named", run("ros2", "run", "--install-base", "install", "demo", "talker").stdout == "theirs\n")
shutil.rmtree(shared / "install")
program(theirs, "own")
check("root's own ./install comes first, also below a sticky folder", run("ros2", "run", "demo", "talker", **prefixes).stdout == "own\n")
theirs.chmod(0o777)
check("but not when others can change a part of it", run("ros2", "run", "demo", "talker", **prefixes).stdout == "ours\n")
os.chdir(home)
shutil.rmtree(shared)
shutil.rmtree(home / "ours")
(home / "report.html").unlink(missing_ok=True)

# ---- Requests ----

def asked(*words):
    """By a stranger; what takt answers."""
    answer = pathlib.Path("/tmp/answer")

    def ask():
        done = run(*words)
        answer.write_text(done.stdout + done.stderr)
        return done.returncode == 0
    did = stranger(ask)
    said = answer.read_text()
    answer.unlink()
    return did, said


def refuses(what, words, *reasons):
    did, said = asked(*words)
    check(f"{what} is refused", not did and all(reason in said for reason in reasons), did, said)


shutil.copy(library, "/tmp/foreign.so")
os.chown("/tmp/foreign.so", STRANGER, STRANGER)
recordings = home / "recordings"
recordings.mkdir(0o700)
(recordings / "out").symlink_to(secret)
loads = ("component", "load", "/robot")
for options in ((), ("--load", "index"), ("--recordings", recordings)):
    container = subprocess.Popen([takt, "run", "--name", "robot", *options], env=environment, stdout=subprocess.DEVNULL,
                                 stderr=subprocess.PIPE, text=True)
    said = next((answer for answer in (asked("component", "list", "robot") for _ in range(10)) if answer[0]), None)
    check(f"a root's container, {' '.join(map(str, options))}", said is not None)
    if not options:
        reasons = ("runs as root", "`load: index`", "`takt run --name NAME --load index`")
        refuses("a component", (*loads, "takt::Workload"), *reasons)
    else:
        reasons = ("file",)
    for component in ("takt::Recorder", "takt::Player"):
        for file in (secret, "/tmp/home/../home/secret", "../secret", "out", "/dev/zero", "/proc/self/mem"):
            refuses(f"{component} of {file}", (*loads, component, "-p", f"file:={file}"), *reasons)
    refuses("a library of theirs", (*loads, "X", "--library", "/tmp/foreign.so"), "load: index" if not options else "may not be loaded")
    check("and not mapped", "foreign.so" not in pathlib.Path(f"/proc/{container.pid}/maps").read_text())
    container.send_signal(signal.SIGINT)
    container.wait(60)
check("root's file is as it was", secret.read_text() == "precious\n")
check("and no other is there", sorted(os.listdir(home)) == ["recordings", "secret", "shared.yaml"] and
      os.listdir(recordings) == ["out"], os.listdir(home), os.listdir(recordings))
finish()
