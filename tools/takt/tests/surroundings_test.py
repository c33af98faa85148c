#!/usr/bin/env python3
"""Whatever environment takt is started in, it ends with a message and not by a signal.

usage: surroundings_test.py TAKT
"""
# SPDX-License-Identifier: Apache-2.0
import os
import pathlib
import resource
import subprocess
import sys
import tempfile

from command import takt
from checks import check, environment, finish

folder = tempfile.TemporaryDirectory()
plain = pathlib.Path(folder.name) / "plain.yaml"
joined = pathlib.Path(folder.name) / "joined.yaml"
joined.write_text("dds: {domain: 1}\ncontainer:\n  components: [{component: takt::Workload, name: idle}]\n")
plain.write_text("container:\n  components: [{component: takt::Workload, name: idle}]\n")


def run(words, **changes):
    done = subprocess.run([takt, *words], env={**environment, **changes}, text=True,
                          stdin=subprocess.DEVNULL, capture_output=True, timeout=60)
    return done.returncode, done.stdout, done.stderr


# The options of every command were set up with the domain as their initial value, outside of main's
# try: a ROS_DOMAIN_ID that is no number aborted all of them.
for words in (["--help"], ["--version"], ["topic", "--help"], ["param", "list", "--help"],
              ["check", plain, joined], ["list", "executors"], ["component", "types"]):
    status, output, errors = run(words, ROS_DOMAIN_ID="abc")
    check(f"takt {words[0]} without a domain: ROS_DOMAIN_ID may be anything",
          status == 0 and errors == "", status, output, errors)
for words in (["topic", "list"], ["node", "list"], ["service", "list"], ["component", "list"],
              ["param", "list"], ["lifecycle", "list"], ["action", "list"]):
    status, output, errors = run(words, ROS_DOMAIN_ID="abc")
    check(f"takt {' '.join(words)}: a bad ROS_DOMAIN_ID is reported", status == 2 and output == "" and
          errors == "takt: ROS_DOMAIN_ID is 'abc'; set it to a number from 0 to 230\n",
          status, output, errors)
    if words[0] in ("topic", "param"):
        status, output, errors = run([*words, "--domain", environment["ROS_DOMAIN_ID"]], ROS_DOMAIN_ID="abc")
        check(f"takt {' '.join(words)} --domain goes before it", status == 0, status, errors)


# Cyclone DDS aborted, or read through a null pointer, where a limit was reached while it joined; a
# file at its limit of size ended the command by SIGXFSZ, and nothing was said.
def limited(name, limit, words):
    def set_limit():
        resource.setrlimit(getattr(resource, name), (limit, limit))
    # A library's initialisers may abort before main, which takt cannot help.
    if name == "RLIMIT_AS" and subprocess.run([takt, "--version"], capture_output=True, preexec_fn=set_limit).returncode < 0:
        return
    done = subprocess.run([takt, *words], env=environment, text=True, stdin=subprocess.DEVNULL,
                          capture_output=True, timeout=120, preexec_fn=set_limit)
    check(f"{name} {limit}: takt {words[0]} ends by itself, and says why if it fails",
          done.returncode >= 0 and (done.returncode == 0 or done.stderr), done.returncode, done.stderr)


joined.write_text(joined.read_text().replace("domain: 1", f"domain: {environment['ROS_DOMAIN_ID']}"))
short = ["run", joined, "--duration", "50ms"]
# Of the sanitizers, the shadow alone is larger than such limits.
is_sanitized = b"__asan_init" in pathlib.Path(takt).read_bytes()
for descriptors in range(3, 24, 1 if not is_sanitized else 5):
    limited("RLIMIT_NOFILE", descriptors, short)
if not is_sanitized:
    for megabytes in (20, 30, 40, 50, 60, 80, 100, 120, 140, 160, 200, 260):
        limited("RLIMIT_AS", megabytes << 20, short)
for kibibytes in (64, 512, 1023, 1024):  # 512 ended it by SIGSEGV
    limited("RLIMIT_STACK", kibibytes << 10, short)
for size in (0, 1024):
    limited("RLIMIT_FSIZE", size, ["reference", "config"])
    for option in ("--json", "--trace"):
        limited("RLIMIT_FSIZE", size, [*short, option, os.path.join(folder.name, "result.json")])
finish()
