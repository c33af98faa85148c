#!/usr/bin/env python3
"""takt rta: every analysis takes the example of its own help, and mistakes are reported in one line.

usage: rta_test.py TAKT
"""
# SPDX-License-Identifier: Apache-2.0
import csv
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

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
      "stdin: the tasks want 1.400 of a processor", "shorten C")
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

# ---- Many sets, a line each ----
CAN = {"tasks": [{"C": 20, "T": 70, "D": 54, "priority": 3}, {"C": 20, "T": 80, "priority": 2}, {"C": 35, "T": 200, "priority": 1}]}
LATE = {"tasks": [{"C": 20, "T": 70, "D": 53, "priority": 3}, *CAN["tasks"][1:]]}
FULL = {"id": "full", "utilisation": 1.4, "tasks": [{"C": 7, "T": 5, "priority": 1}]}
status, output, errors = run(["np_fp", "--lines"], "\n".join(map(json.dumps, (CAN, LATE, FULL))))
first, second, third = map(json.loads, output.splitlines())
check("each line has its result", status == 0 and first == {"id": 1, "R": [54, 74, 75], "is_schedulable": True}
      and second == {**first, "id": 2, "is_schedulable": False}, status, output, errors)
check("too much work is a result there, with the set's own id", third["id"] == "full" and third["utilisation"] == 1.4
      and not third["is_schedulable"] and "1.400 of a processor" in third["why_not"], third)
status, output, errors = run(["np_fp", "--lines"], json.dumps(CAN) + '\n{"tasks": [{"C": 1}]}\n[\n' + json.dumps(LATE))
check("a line that is wrong ends no other", status == 2 and len(output.splitlines()) == 2 and "stdin:2:" in errors
      and "stdin:3:" in errors and "2 of 4 lines are no task sets" in errors, status, output, errors)
fails("a file has no place beside it", ["np_fp", "tasks.json", "--lines"], "", "--lines")

# ---- The page's commands, with fewer sets ----
page = pathlib.Path(__file__).resolve().parents[3].joinpath("docs/how_to/compare_schedulability.md").read_text()
commands = "\n".join(line[4:] for line in page.splitlines() if line.startswith("    "))
commands = commands.replace("--sets 2000", "--sets 100").replace("--tasks 12", "--tasks 12 --sets 50").replace("--lines 1000", "--lines 50")
with tempfile.TemporaryDirectory() as folder:
    subprocess.run(["bash", "-c", commands], cwd=folder, timeout=120, check=False,
                   capture_output=True, env=environment | {"PATH": os.path.dirname(takt) + ":" + os.environ["PATH"]})
    rows = list(csv.DictReader(pathlib.Path(folder, "shares.csv").open()))
    counts = {name: len(pathlib.Path(folder, name + ".jsonl").read_text().splitlines())
              for name in ("g_edf", "fifo", "fixed_priority", "edf")}
check("the page's commands give shares by method and utilisation",
      {row["method"] for row in rows} == {"fp", "np_fp", "np_edf"} and sum(int(row["sets"]) for row in rows) == 300, rows)
check("and answers for several processors, and for whole systems under each scheduler",
      counts == {"g_edf": 50, "fifo": 50, "fixed_priority": 50, "edf": 50}, counts)
light = [float(row["share"]) for row in rows if row["method"] == "fp" and float(row["utilisation"]) < 0.5]
check("preemptive fixed priorities serve light sets", light and min(light) == 1, rows)
finish()
