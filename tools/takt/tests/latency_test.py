#!/usr/bin/python3
"""takt latency is read by what reads cyclictest: latency_test.py TAKT

SPDX-License-Identifier: Apache-2.0
"""
import glob
import json
import os
import re
import resource
import shutil
import signal
import subprocess
import sys

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../cmake"))
from checks import check, finish  # noqa: E402


def run(*words):
    return subprocess.run([sys.argv[1], "latency", *words], stdout=subprocess.PIPE, check=True,
                          text=True).stdout


def columns(text):
    """As OSADL's script reads the output of cyclictest: grep -v -e "^#" -e "^$" | tr " " "\t"."""
    return [line.replace(" ", "\t").split("\t") for line in text.splitlines()
            if line and not line.startswith("#")]


def check_output():
    text = run("-i", "1000", "-l", "200", "-q", "--executor", "events")
    summary = re.compile(r"T: *(\d+) \( *\d+\) P: *\d+ I:\d+ C: *(\d+) "
                         r"Min: *\d+ Act: *\d+ Avg: *\d+ Max: *\d+$")
    rows = [summary.match(line) for line in text.splitlines() if not line.startswith("#")]
    check("the summary has cyclictest's lines", len(rows) == 2 and all(rows), text)
    check("each row has its cycles", [row.group(2) for row in rows] == ["200", "200"])
    # It went on for some cycles after its end.
    text = run("-i", "200", "-l", "200", "-q", "--executor", "isolated")
    check("also that of isolated", re.findall("^T:.* C: *(\\d+)", text, re.M) == ["200", "200"], text)
    text = run("-i", "1000", "-l", "200", "-h", "400", "-q", "--executor", "events")
    histogram = columns(text)
    check("the histogram has cyclictest's lines", len(histogram) == 400
          and all(re.fullmatch(r"\d{6}", word) for line in histogram for word in line), text)
    overflows = [int(word) for word in re.search(r"# Histogram Overflows: (.*)", text)[1].split()]
    for row in (1, 2):
        total = sum(int(line[row]) for line in histogram)
        check(f"row {row - 1}: histogram and overflows are all", total + overflows[row - 1] == 200)


def check_threads():
    cpus = len(os.sched_getaffinity(0))
    # OSADL's command line, with fewer loops. The summary stood before the histogram, as four rows of the
    # plot, and an executor had columns in it.
    text = run("-l50", "-m", "-Sp90", "-i200", "-h400", "-q")
    rows = columns(text)
    check("OSADL's script reads a row for each µs", [row[0] for row in rows] == [f"{i:06}" for i in range(400)], text)
    check("and a column for each CPU", {len(row) for row in rows} == {1 + cpus}, text)
    text = run("-l50", "-m", "-Sp90", "-i200", "-h400", "--executor", "none")
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


def check_missing_rights():
    # The refusal was the last line of a measurement of hours; --require prescribed a key of a file.
    words = [sys.argv[1], "latency", "-p80", "-i1000", "-q", "--executor", "none"]
    if os.geteuid() == 0:
        words = ["setpriv", "--bounding-set=-sys_nice", *words]
        if shutil.which("setpriv") is None:
            return print("skipped: no setpriv")
    elif resource.getrlimit(resource.RLIMIT_RTPRIO)[1] >= 80:
        return print("skipped: this user has the rights")
    process = subprocess.Popen([*words, "-l", "1000000"], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    first = process.stderr.readline()
    is_measuring = process.poll() is None
    process.kill()
    process.communicate()
    check("missing rights are reported before the measurement", is_measuring and first.startswith(
        "note: SCHED_FIFO 80: Operation not permitted") and first.endswith("; measuring without\n"), first)
    text = subprocess.run([*words, "-l10"], capture_output=True, text=True).stdout
    check("and in its result", "# SCHED_FIFO 80: Operation not permitted" in text, text)
    wrong = subprocess.run([*words, "-l10", "--require"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    check("--require names its own remedy", wrong.returncode != 0 and wrong.stdout == "" and
          wrong.stderr.endswith("; see takt doctor, or leave out --require\n"), wrong.stdout, wrong.stderr)


def check_refusals():
    for words, said in ((("-a", "9999"), "is not a CPU that this process may use"),
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
    for thread in document["thread"].values():
        slices = thread["over_time"]["slices"]
        begins = [part["begin_s"] for part in slices]
        check(f"{thread['name']}: the slices of its time have all cycles, in order", begins == sorted(set(begins)) and
              sum(part["count"] for part in slices) == thread["cycles"], slices)
        check("and its extremes", max(part["max_us"] for part in slices) // 1 == thread["max"] and
              min(part["min_us"] for part in slices) // 1 == thread["min"], thread["min"], thread["max"], slices)
        check("each in its order", all(part["min_us"] <= part["p50_us"] <= part["p99_us"] <= part["max_us"] for part in slices), slices)


check_output()
check_threads()
check_values_of_an_interrupted_round()
check_search_for_gaps()
check_missing_rights()
check_refusals()
check_document()
finish()
