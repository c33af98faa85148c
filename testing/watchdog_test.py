#!/usr/bin/env python3
"""A test program that hangs says which test it was, and where its threads are. What a test of a whole program has
started ends with it.

usage: watchdog_test.py HANGING
SPDX-License-Identifier: Apache-2.0
"""
import os
import shutil
import subprocess
import sys

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../cmake"))
from checks import check, environment, eventually, finish, lives  # noqa: E402

done = subprocess.run([sys.argv[1], "--gtest_brief=1"], env={**environment, "TAKT_TEST_SECONDS": "1"},
                      capture_output=True, text=True, timeout=100)
said = done.stderr
check("it ends by a signal", done.returncode < 0 or "Sanitizer" in said, done.returncode, said)
check("and names its test", "\nhangs in Hanging.JoinsAThreadThatDoesNotEnd\n" in said, said)
check("with the stacks of both threads", said.count("\nthread ") == 2, said)
if shutil.which("addr2line", path="/usr/bin"):
    check("by functions", "Hanging_JoinsAThreadThatDoesNotEnd_Test::TestBody()" in said
          and "waits_for_ever()" in said, said)

# What a test had started that ctest killed disturbed later tests. Beside a process whose name is cut inside a character.
KILLED = f"""
import os, subprocess, sys
sys.path.append({sys.path[-1]!r})
from checks import environment
print(subprocess.Popen(["sleep", "1000"], env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).pid,
      flush=True)
os.kill(os.getpid(), 9)
"""
NAMED = """
with open("/proc/self/comm", "wb") as name:
    name.write(b"na\\xc3")
print(flush=True)
input()
"""
with subprocess.Popen([sys.executable, "-c", NAMED], stdin=subprocess.PIPE, stdout=subprocess.PIPE) as named:
    named.stdout.readline()
    left = int(subprocess.run([sys.executable, "-c", KILLED], stdout=subprocess.PIPE, check=False).stdout)
    check("what a killed test has started ends", eventually(lambda: not lives(left), 20))
    named.kill()
finish()
