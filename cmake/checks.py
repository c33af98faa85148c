"""What the tests of whole programs share: each relation that must hold is printed and counted.

SPDX-License-Identifier: Apache-2.0
"""
import contextlib
import fcntl
import glob
import os
import pathlib
import select
import shutil
import signal
import subprocess
import sys
import time

locks = []  # are held until this process ends


def own_domain():
    """One that no other test has meanwhile, see testing/peer_process.hpp, which chooses likewise."""
    for i in range(100):
        domain = 1 + (os.getpid() + i) % 100
        lock = open(f"/tmp/takt_test_domain_{os.getuid()}_{domain}", "w", opener=lambda path, flags: os.open(path, flags, 0o600))
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            continue
        locks.append(lock)
        return domain
    sys.exit("all domains for tests are taken: wait until other tests have ended")


def state_of(pid):
    """The words of its /proc/PID/stat behind its name, which may be any bytes (also of PID/task/THREAD). OSError: gone."""
    return pathlib.Path(f"/proc/{pid}/stat").read_bytes().rpartition(b")")[2].decode().split()


def lives(pid):
    try:
        return state_of(pid)[0] != "Z"
    except OSError:
        return False


def is_keeper(pid):
    """Of RouDi, for a `takt run`."""
    try:
        return pathlib.Path(f"/proc/{pid}/comm").read_bytes() == b"takt_roudi\n"
    except OSError:
        return False


def started_with(mark):
    """Processes that have it in their environment; a keeper ends by itself, with its RouDi and their files."""
    for folder in glob.glob("/proc/[0-9]*"):
        try:
            pid, environ = int(folder[6:]), pathlib.Path(folder, "environ").read_bytes()
            if mark.encode() in environ.split(b"\0") and not is_keeper(pid) and not is_keeper(int(state_of(pid)[1])):
                yield pid
        except OSError:  # it has gone, or is another user's
            pass


def end_with_this():
    """What this process starts ends with it, also when ctest kills it: else it would disturb later tests."""
    test, mark = os.pidfd_open(os.getpid()), f"TAKT_TEST_PROCESS={os.getpid()}.{time.monotonic_ns()}"
    os.environ.update([mark.split("=")])
    if os.fork() != 0:
        return os.close(test)
    os.setsid()
    for fd in range(3):  # ctest waits until nobody has its pipe
        os.dup2(os.open(os.devnull, os.O_RDWR), fd)
    select.select([test], [], [])
    for pid in started_with(mark):
        with contextlib.suppress(OSError):
            os.kill(pid, signal.SIGKILL)
    os._exit(0)


end_with_this()
environment = dict(os.environ, ROS_DOMAIN_ID=str(own_domain()))
failures = []


def check(what, holds, *details):
    print("holds " if holds else "FAILED", what)
    if not holds:
        failures.append(what)
        print(*details)


def proves(page, words):
    """Names a check by the words that it proves, which must stand in docs/reference/PAGE.

    claims_test.py looks for these calls: each sentence there that promises an error has exactly one.
    """
    text = (pathlib.Path(__file__).resolve().parents[1] / "docs/reference" / page).read_text(encoding="utf-8")
    check(f"{page} says: {words}", words in " ".join(text.split()))
    return f"and so it is: {words}"


def eventually(condition, limit=60):
    """Waits until it holds; false after so many seconds. Choose what stays true."""
    end = time.monotonic() + limit
    while not (holds := condition()) and time.monotonic() < end:
        time.sleep(0.02)
    return bool(holds)


def rounds(usual):
    """How often to measure: as TAKT_ROUNDS says."""
    return int(os.environ.get("TAKT_ROUNDS", usual))


def skip(reason):
    print("skipped:", reason)
    sys.exit(77)


def finish():
    sys.exit(1 if failures else 0)


def roudi_runs():
    return subprocess.run(["pidof", "iox-roudi"], stdout=subprocess.DEVNULL).returncode == 0


def children_of(pid):
    try:
        return [int(child) for path in glob.glob(f"/proc/{pid}/task/*/children")
                for child in open(path).read().split()]
    except OSError:  # it has ended
        return []


def roudi_of(run):
    """The one that this `takt run` has started: none or one."""
    return [roudi for child in children_of(run) if is_keeper(child) for roudi in children_of(child)]


def skip_without_shared_memory():
    if not shutil.which("iox-roudi"):
        skip("iox-roudi is not installed (apt-get install iceoryx)")
    if roudi_runs():
        skip("a RouDi of somebody else runs")
