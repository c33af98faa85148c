#!/usr/bin/env python3
"""takt rta: every analysis takes the example of its own help, and mistakes are reported in one line.

usage: rta_test.py TAKT
"""
# SPDX-License-Identifier: Apache-2.0
import json
import os
import re
import subprocess
import sys

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../cmake"))
from checks import check, environment, finish  # noqa: E402

takt = os.path.abspath(sys.argv[1])


def run(words, text=""):
    done = subprocess.run([takt, "rta", *words], env=environment, input=text, text=True,
                          capture_output=True, timeout=120)
    return done.returncode, done.stdout, done.stderr


def fails(name, words, text, *parts):
    status, output, errors = run(words, text)
    check(name, status == 2 and output == "" and errors.count("\n") == 1 and
          all(part in errors for part in parts), status, output, errors)


status, output, _ = run([])
methods = re.findall(r"^  ([a-z_]+)  +[A-Z]", output, re.M)
check("without a method it lists them", status == 0 and "np_fp" in methods and len(methods) >= 18, output)
for method in methods:
    _, output, _ = run([method, "--help"])
    example = re.search(r"<<END\n(.*)\nEND\n", output, re.S)
    check(f"the help of {method} has an example", example, output)
    status, table, errors = run([method], example[1])
    check(f"{method} takes its example", status == 0 and "source: " in table, table, errors)
    status, output, errors = run([method, "--json", "-"], example[1])
    result = json.loads(output)
    check(f"{method} writes JSON", status == 0 and result["method"] == method and
          ("R" in result or "points" in result), output)

status, output, _ = run(["np_fp", "--json", "-"], '{"tasks": [{"C": 20, "T": 70, "priority": 3}, '
                        '{"C": 20, "T": 80, "priority": 2}, {"C": 35, "T": 200, "priority": 1}]}')
check("the published bounds come out", json.loads(output)["R"] == [54, 74, 75], output)

fails("an unknown method is reported with near ones", ["npfp"], "", "'npfp'", "did you mean 'np_fp'")
fails("broken JSON is reported with its line", ["fp"], '{"tasks":\n [}', "stdin:2: ")
fails("a missing key is reported", ["fp"], '{"tasks": [{"C": 1, "T": 2}]}', "stdin:1: ",
      "tasks[0]: 'priority' is missing")
fails("a negative number is reported", ["fp"], '{"tasks": [{"C": -1, "T": 2, "priority": 1}]}',
      "stdin:1: 'C' is not possible", "from 1")
fails("too much work is reported", ["fp"], '{"tasks": [{"C": 7, "T": 5, "priority": 1}]}',
      "1.400 of a processor", "shorten C")
# Each instant of a release was kept, however many: this took gigabytes, or hours.
fails("more instants than can be looked at are reported", ["casini_event_source"],
      '{"tasks": [{"C": 2, "T": 5, "J": 1000000000}], "limit": 1000000000000000}',
      "more than 1000000 arrivals", "shorter jitter")
# Response times that depend on each other grew in small steps, for hours, up to the limit of a minute of ns.
fails("response times that do not converge are reported", ["blass_rr"], '{"tasks": [{"C": 2, "T": 8}, {"C": 3, "T": 12}, '
      '{"C": 4, "T": 16}]}', "still grow after 1000 rounds", "smaller limit")
# Those before the first that counts were looked at, one by one.
status, output, errors = run(["edf"], '{"tasks": [{"C": 79, "T": 120, "D": 1000000000000000}, '
                             '{"C": 11, "T": 34, "D": 100}]}')
check("a deadline far away takes no time", status == 0, status, errors)
fails("a file that is not there is reported", ["fp", "/no/such.json"], "", "/no/such.json")
finish()
