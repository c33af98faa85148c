#!/usr/bin/python3
"""takt latency is read by what reads cyclictest: latency_test.py TAKT

SPDX-License-Identifier: Apache-2.0
"""
import glob
import json
import os
import re
import signal
import subprocess
import sys

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../cmake"))
from checks import check, finish  # noqa: E402


def run(*words):
    return subprocess.run([sys.argv[1], "latency", *words], stdout=subprocess.PIPE, check=True,
                          text=True).stdout


def check_output():
    text = run("-i", "1000", "-l", "200", "-h", "400", "-q", "--executor", "events")
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    summary = re.compile(r"T: *(\d+) \( *\d+\) P: *\d+ I:\d+ C: *(\d+) "
                         r"Min: *\d+ Act: *\d+ Avg: *\d+ Max: *\d+$")
    rows = [summary.match(line) for line in lines[:2]]
    check("the summary has cyclictest's lines", all(rows))
    check("each row has its cycles", [row.group(2) for row in rows] == ["200", "200"])
    histogram = [line.split() for line in lines[2:]]
    check("the histogram has cyclictest's lines", len(histogram) == 400
          and all(re.fullmatch(r"\d{6}", word) for line in histogram for word in line))
    overflows = [int(word) for word in re.search(r"# Histogram Overflows: (.*)", text)[1].split()]
    for row in (1, 2):
        total = sum(int(line[row]) for line in histogram)
        check(f"row {row - 1}: histogram and overflows are all", total + overflows[row - 1] == 200)


def check_threads():
    # OSADL's command line, with fewer loops: as many lines as CPUs.
    cpus = len(os.sched_getaffinity(0))
    text = run("-l50", "-m", "-Sp90", "-i200", "-h400", "-q", "--executor", "none")
    rows = [line for line in text.splitlines() if line.startswith("T:")]
    check("-S has a thread on each CPU", len(rows) == cpus)
    check("with one interval, as there is a histogram", all(" I:200 " in row for row in rows))

    text = run("-t2", "-i", "1000", "-l", "50", "-q", "--executor", "events", "-d", "250")
    rows = [line for line in text.splitlines() if line.startswith("T:")]
    check("-t has so many threads of each row", len(rows) == 4)
    check("whose intervals are a distance apart",
          [re.search(r"I:(\d+)", row)[1] for row in rows] == ["1000", "1250"] * 2)

    text = run("-t2", "-i", "1000", "-l", "50", "-q", "-H", "4000", "--executor", "none")
    lines = [line.split() for line in text.splitlines() if re.match(r"\d{6} ", line)]
    check("-H has a column with the sum of the others", len(lines) == 4000
          and all(int(line[3]) == int(line[1]) + int(line[2]) for line in lines))

    first = min(os.sched_getaffinity(0))
    text = run("-v", "-r", "-a", f"{first}-{first}", "--policy=other", "-l", "20", "-q", "--executor", "none")
    values = re.findall(r"^ *0: *(\d+): *-?\d+$", text, re.M)
    check("-v prints every value", [int(value) for value in values] == list(range(20)))


def check_values_of_an_interrupted_round():
    # -v prints a row's values when it has run, and not again when a signal ends the next round.
    here, there = os.openpty()  # so that lines come as they are printed
    process = subprocess.Popen([sys.argv[1], "latency", "-v", "-i", "1000", "-q", "--executor", "events"],
                               stdout=there, stderr=subprocess.DEVNULL)
    os.close(there)
    text = ""
    while not re.search(r"^ *1: *999:", text, re.M):  # the last value of the second row's first round
        text += os.read(here, 65536).decode()
    process.send_signal(signal.SIGINT)
    try:
        while part := os.read(here, 65536):
            text += part.decode()
    except OSError:  # the end of a terminal
        pass
    os.close(here)
    values = re.findall(r"^ *(\d+): *(\d+): *-?\d+\r?$", text, re.M)
    check("-v prints no value twice", process.wait() == 0 and len(values) == len(set(values)), values[-3:])


def check_search_for_gaps():
    # The search for gaps, which is nearly all of this run, is on the CPU of -a.
    cpu = max(os.sched_getaffinity(0))
    process = subprocess.Popen([sys.argv[1], "latency", "-a", str(cpu), "-i", "1000", "-l", "10", "-q",
                                "--executor", "none"], stdout=subprocess.DEVNULL)
    allowed = []
    while process.poll() is None:
        for path in glob.glob(f"/proc/{process.pid}/task/*/status"):
            try:
                status = open(path).read()
            except OSError:  # the thread has ended
                continue
            if status.startswith("Name:\tlatency\n"):
                allowed.append(re.search(r"Cpus_allowed_list:\s*(\S+)", status)[1])
    check("the search for gaps is on the CPU of -a", allowed.count(str(cpu)) > len(allowed) / 2,
          sorted(set(allowed)))


def check_refusals():
    for words, said in ((("-a", "9999"), "is no CPU that this process may use"),
                        (("--policy=fast",), "there is no thread policy"), (("-t", "0"), "-t")):
        wrong = subprocess.run([sys.argv[1], "latency", "-l", "1", *words], stdout=subprocess.PIPE,
                               stderr=subprocess.STDOUT, text=True)
        check(f"{' '.join(words)} is refused", wrong.returncode != 0 and said in wrong.stdout, wrong.stdout)


def check_document():
    # The keys that rt-tests 2.4 writes, and scripts read.
    document = json.loads(run("-i", "1000", "-l", "200", "-q", "--json", "-"))
    for key in ("file_version", "cmdline:", "rt_test_version:", "start_time", "end_time",
                "return_code", "sysinfo", "num_threads", "resolution_in_ns", "thread"):
        check(f"the JSON has '{key}'", key in document)
    for key in ("histogram", "cycles", "min", "max", "avg", "cpu", "node"):
        check(f"a thread has '{key}'", key in document["thread"]["0"])
    check("the resolution is cyclictest's: 0 for µs", document["resolution_in_ns"] == 0)
    check("and how it ended", document["return_code"] == 0)
    check("bare loop and executor", document["num_threads"] == len(document["thread"]) == 2)


check_output()
check_threads()
check_values_of_an_interrupted_round()
check_search_for_gaps()
check_refusals()
check_document()
finish()
