#!/usr/bin/env python3
"""Whatever environment takt is started in, it ends with a message and not by a signal.

usage: surroundings_test.py TAKT
"""
# SPDX-License-Identifier: Apache-2.0
import pathlib
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
    check(f"takt {' '.join(words)}: a bad ROS_DOMAIN_ID is told", status == 2 and output == "" and
          errors == "takt: ROS_DOMAIN_ID is 'abc'; set it to a number from 0 to 230\n",
          status, output, errors)
    if words[0] in ("topic", "param"):
        status, output, errors = run([*words, "--domain", environment["ROS_DOMAIN_ID"]], ROS_DOMAIN_ID="abc")
        check(f"takt {' '.join(words)} --domain goes before it", status == 0, status, errors)
finish()
