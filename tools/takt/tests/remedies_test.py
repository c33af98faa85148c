#!/usr/bin/env python3
"""What `takt doctor` prescribes for a user makes its finding good: tried by a fresh user, with an
installed takt, in namespaces of mounts and of the network, so that this machine stays as it is.

usage: remedies_test.py BUILD
"""
# SPDX-License-Identifier: Apache-2.0
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "cmake"))
from checks import check, environment, finish, skip  # noqa: E402

BUILD = pathlib.Path(sys.argv[1]).resolve()
RIGHTS = ("SCHED_FIFO 80", "locked memory", "negative nice values")
TRIED = (*RIGHTS, "SCHED_DEADLINE 0.1ms/10ms", "cpu_dma_latency", "loopback interface", "shared memory, RouDi")
# The others hold for the whole machine, which others use meanwhile, or need another kernel or a restart.
WHOLE_MACHINE = ("preemption model", "real-time throttling", "cgroup CPU controller", "frequency governor",
                 "idle states", "isolated CPUs", "interrupt affinity", "transparent huge pages", "swap",
                 "clock source", "timer slack", "io_uring", "other real-time threads", "socket receive buffer")


def done(*words):
    return subprocess.run(words, text=True, capture_output=True, timeout=120)


def may_raise_limits():
    may = done("prlimit", "--rtprio=95:95", "--memlock=unlimited:unlimited", "true").returncode == 0
    if not may:
        print("skipped: limits; root itself may not raise them here, as in containers without CAP_SYS_RESOURCE")
    return may


def as_root(commands):
    said = done("sh", "-c", commands)
    check(f"root can do: {commands}", said.returncode == 0, said.stdout, said.stderr)


def doctor(prefix, *start):
    """What doctor finds for alice, who logs in, or is started by `start`."""
    command = f"{prefix}/bin/takt doctor --json -"
    said = done(*(start or ("su", "-", "alice", "-c")), *([command] if not start else command.split()))
    check("doctor starts", said.returncode in (0, 1) and said.stdout, said.returncode, said.stderr)
    return {finding["what"]: finding for finding in json.loads(said.stdout or '{"findings": []}')["findings"]}


def fresh_user(folder):
    """As on a machine where nothing was done yet."""
    while done("umount", "/etc").returncode == 0:
        pass
    shutil.rmtree(folder / "etc", ignore_errors=True)
    as_root(f"cp -a /etc {folder}/etc; mount --bind {folder}/etc /etc; useradd -m -s /bin/sh alice || true;"
            "sed -i /realtime/d /etc/security/limits.conf; ! getent group realtime || groupdel realtime")


def mount_own(folder):
    """What the remedies change besides /etc."""
    as_root("mount -t sysfs sysfs /sys")  # that of this network
    as_root(f"mkdir {folder}/home; mount --bind {folder}/home /home; mount -t tmpfs -o size=1M,mode=1777 tmpfs /dev/shm")
    if os.path.exists("/dev/cpu_dma_latency"):
        as_root(f"cp -a /dev/cpu_dma_latency {folder}/; mount --bind {folder}/cpu_dma_latency /dev/cpu_dma_latency")


def try_fixes(prefix):
    before = doctor(prefix)
    skipped = () if may_raise_limits() else RIGHTS
    unknown = set(before) - {*TRIED, *WHOLE_MACHINE, "Cyclone DDS"}
    check("each finding is tried here, or is one of the whole machine", not unknown, unknown)
    for what in TRIED:
        finding = before[what]
        if finding["verdict"] == "good":
            print(f"skipped: {what} is good here")
            continue
        fix = finding["fix"].removesuffix("; log in again").split("; do not")[0]
        if what.startswith("SCHED_DEADLINE"):  # the program is started with the right
            words = fix.replace("$(id -g alice)", done("id", "-g", "alice").stdout.strip()).split()
            after = doctor(prefix, *words[:words.index("takt")])
        else:
            as_root(fix)
            after = doctor(prefix)
        if what in skipped:
            continue
        check(f"{what}: good after '{fix}'", after[what]["verdict"] == "good", after[what])
    check("Cyclone DDS: good when the loopback interface is up", doctor(prefix)["Cyclone DDS"]["verdict"] == "good")


def try_page(prefix):
    """The commands of the page, which readers copy."""
    page = (ROOT / "docs/how_to/prepare_a_machine.md").read_text()
    rights = page.split("## Rights")[1].split("\n## ")[0]
    commands = re.findall("(?m)^    (.*)$", rights)
    as_root("\n".join(line for line in commands if not line.startswith("setpriv")))
    after = doctor(prefix)
    for what in RIGHTS[:2] if may_raise_limits() else ():
        check(f"{what}: good after the commands of the page", after[what]["verdict"] == "good", after[what])
    start = [line.partition(" takt ")[0] for line in commands if line.startswith("setpriv")]
    said = done("sh", "-c", f"{start[0]} {prefix}/bin/takt --version")
    check("takt starts as the page says", said.returncode == 0, said.stderr)


if os.geteuid() != 0:
    skip("a fresh user takes root")
if "--inside" not in sys.argv:
    if done("unshare", "--mount", "--net", "true").returncode != 0:
        skip("no namespaces of mounts and of the network here")
    for program in ("useradd", "su", "setpriv", "ip"):
        if shutil.which(program) is None:
            skip(f"no {program}")
    os.execvpe("unshare", ["unshare", "--mount", "--net", sys.executable, *sys.argv, "--inside"], environment)
with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    folder.chmod(0o755)
    prefix = folder / "takt"
    as_root(f"umask 022; cmake --install {BUILD} --prefix {prefix}; chmod -R a+rX {prefix}")
    mount_own(folder)
    fresh_user(folder)
    try_fixes(prefix)
    fresh_user(folder)
    try_page(prefix)
    done("umount", "/etc", "/home", "/dev/cpu_dma_latency")
finish()
