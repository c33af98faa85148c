#!/usr/bin/env python3
"""Output that cannot be written is an error, and a callback may throw anything.

usage: output_test.py TAKT LIBRARY   (of guests::Good, whose timer throws an int)
"""
# SPDX-License-Identifier: Apache-2.0
import os
import signal
import subprocess
import sys
import tempfile

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../cmake"))
from checks import check, environment, finish  # noqa: E402

takt, library = map(os.path.abspath, sys.argv[1:3])
folder = tempfile.TemporaryDirectory()
one, two, bad = (os.path.join(folder.name, name) for name in ("one.yaml", "two.yaml", "bad.yaml"))
with open(one, "w") as file:
    file.write(f"container:\n  components:\n    - {{component: 'guests::Good', library: {library}}}\n")
with open(two, "w") as file:
    file.write("containers:\n"
               "  - {name: idle, components: [{component: takt::Workload, name: idle}]}\n"
               "  - {name: guest, components: "
               f"[{{component: 'guests::Good', library: {library}}}]}}\n")
with open(bad, "w") as file:
    file.write("nothing: right\n")
plain = os.path.join(folder.name, "plain.yaml")
with open(plain, "w") as file:
    file.write("container:\n  components: [{component: takt::Workload, name: idle}]\n")


def status(words, **streams):
    streams.setdefault("stdout", subprocess.DEVNULL)
    done = subprocess.run([takt, *words], env=environment, stdin=subprocess.DEVNULL, text=True,
                          timeout=120, **{"stderr": subprocess.PIPE, **streams})
    return done.returncode, done.stderr or ""


def broken_pipe():
    """The writing end of a pipe that nobody reads."""
    reader, writer = os.pipe()
    os.close(reader)
    return writer


for words in (["--help"], ["list", "schedulers"], ["check", plain], ["reference", "config"],
              ["plan", plain, "--json", "-"], ["doctor"],
              ["topic", "list", "--json", "-"], ["node", "list", "--json", "-"],
              ["run", plain, "--duration", "100ms"],
              ["run", plain, "--duration", "100ms", "--json", "-"],
              ["latency", "-l", "10", "-q"]):
    with open("/dev/full", "w") as full:
        result, output = status(words, stdout=full)
    check(f"takt {' '.join(words)} > /dev/full ends with 1",
          result == 1 and "writ" in output, result, output)
    writer = broken_pipe()
    result, output = status(words, stdout=writer)
    os.close(writer)
    check(f"takt {' '.join(words)} into a closed pipe ends with 1", result == 1, result, output)

result, output = status(["run", plain, "--duration", "100ms", "--json", "/dev/full"])
check("results that cannot be written end with 1", result == 1 and "could not be written" in output,
      result, output)
result, output = status(["run", plain, "--duration", "100ms", "--trace", "/dev/full"])
check("a trace that cannot be written ends with 1", result == 1 and "could not be written" in output,
      result, output)
result, _ = status(["check", bad], stderr=broken_pipe())
check("errors that nobody reads are errors all the same", result == 2, result)
result, _ = status(["list", "schedulers"], preexec_fn=lambda: os.close(1))
check("a closed stdout is an error", result == 1, result)

# It escaped to std::terminate.
for file in (one, two):
    process = subprocess.Popen([takt, "run", file, "--duration", "60s"], env=environment, text=True,
                               stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    output = ""
    for line in process.stderr:
        output += line
        if file == two and "not a std::exception" in line:
            process.send_signal(signal.SIGINT)  # for the other process, which goes on
    result = process.wait()
    check(f"a callback that throws an int ends {os.path.basename(file)} with its reason",
          result in (1, 130) and "not a std::exception" in output and "terminate called" not in output,
          result, output)
finish()
