"""Runs a command in little memory and time, and says what is wrong with its end, whatever it was given.

SPDX-License-Identifier: Apache-2.0
"""
import os
import pathlib
import re
import resource
import shutil
import signal
import subprocess
import tempfile

from command import takt

# Of the sanitizers, the shadow alone is larger.
MOST_MEMORY = resource.RLIM_INFINITY if b"__asan_init" in pathlib.Path(takt).read_bytes() else 1 << 30
MOST_CPU_SECONDS, MOST_SECONDS = 10, 60  # the second ends only what waits for ever
SETPRIV = shutil.which("setpriv")
UNEXPLAINED = re.compile(rb"Traceback|std::|bad_alloc|terminate called|[aA]ssertion|what\(\)")


def limited():
    resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
    resource.setrlimit(resource.RLIMIT_CPU, (MOST_CPU_SECONDS, MOST_CPU_SECONDS))
    resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 26, 1 << 26))


def run(words, folder, environment):
    """Status, or None if it does not end, and what it says on both streams. Root may not read everything here."""
    powerless = [SETPRIV, "--bounding-set=-dac_override,-dac_read_search"] if os.getuid() == 0 else []
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        process = subprocess.Popen([*powerless, *words], cwd=folder, env=environment, stdin=subprocess.DEVNULL,
                                   stdout=out, stderr=err, preexec_fn=limited, start_new_session=True)
        try:
            status = process.wait(MOST_SECONDS)
        except subprocess.TimeoutExpired:
            status = None
        if status is None or status < 0:
            try:
                os.killpg(process.pid, signal.SIGKILL)
            except ProcessLookupError:
                pass
            process.wait()
        out.seek(0)
        err.seek(0)
        return status, out.read(), err.read()


def faults(status, output, errors, names, is_refused):
    """What is wrong with the end of a command that depends on what these names stand for."""
    if status is None:
        yield f"it did not end in {MOST_SECONDS} s"
        return
    if status < 0:
        yield f"it was ended by signal {-status}"
    if status > 2 or (is_refused and status == 0):
        yield f"its status is {status}"
    said = output + errors
    if match := UNEXPLAINED.search(said):
        yield f"it says {match[0]}"
    if any(byte < 32 and byte not in b"\n\t" or byte == 127 for byte in said):
        yield "it writes control characters"
    try:
        said.decode()
    except UnicodeDecodeError:
        yield "it writes text that is not UTF-8"
    is_error = status == 2 or status == 1 and not output  # 1: what takt analyze has found
    if is_error and not any(name.encode() in errors for name in names):
        yield "its error names none of " + ", ".join(names)
    # takt bench runs takt run.
    lines = errors.replace(b"takt: a run ended with status 2; see its message above\n", b"").splitlines()
    if is_refused and len(lines) != 1:
        yield "its error is not in one line"
