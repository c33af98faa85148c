#!/usr/bin/env python3
"""takt random: the same file from the same arguments, files that are valid and can be analysed, and mistakes.

usage: random_test.py TAKT
"""
# SPDX-License-Identifier: Apache-2.0
import collections
import json
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../cmake"))
from checks import check, environment, finish  # noqa: E402

takt = os.path.abspath(sys.argv[1])
SEEDS = range(1, 31)
PERIODS_US = {1000, 2000, 5000, 10000, 20000, 50000, 100000, 200000, 1000000}


def run(*words):
    done = subprocess.run([takt, *words], env=environment, text=True, capture_output=True, timeout=120)
    return done.returncode, done.stdout, done.stderr


def names(kind):
    return {line.split()[0] for line in run("list", kind)[1].splitlines()}


def write_eight(path):
    """Eight threads on a CPU each, in two processes: each chain goes from one to the other."""
    threads = ", ".join(f"t{cpu}: {{policy: SCHED_FIFO, priority: {40 + cpu % 3}, affinity: [{cpu}]}}" for cpu in range(8))
    executors = ", ".join(f"e{cpu}: {{type: {('events', 'single_threaded')[cpu % 2]}, threads: [t{cpu}]}}" for cpu in range(8))
    chains = ", ".join(f"{{name: c{i}, path: [n{i}/x{i}_timer, m{i}/x{i}]}}" for i in range(4))
    senders = "".join(f"    - {{component: takt::Workload, name: n{i}, executor: e{2 * i}, parameters: {{publishers: "
                      f"{{topic: [x{i}], period_us: [{7000 + 1000 * i}], work_us: [{900 + 100 * i}]}}}}}}\n" for i in range(4))
    receivers = "".join(f"    - {{component: takt::Workload, name: m{i}, executor: e{2 * i + 1}, parameters: {{subscriptions: "
                        f"{{topic: [x{i}], work_us: [{800 + 100 * i}]}}}}}}\n" for i in range(4))
    pathlib.Path(path).write_text(
        f"machine: {{cpus: 8, rt_runtime: 950ms}}\nthreads: {{{threads}}}\nexecutors: {{{executors}}}\nchains: [{chains}]\n"
        f"topics: {{{', '.join(f'/x{i}: {{delay: {{min: {100 * i}us, max: 1ms}}}}' for i in range(4))}}}\n"
        f"containers:\n- name: one\n  components:\n{senders}- name: two\n  components:\n{receivers}", encoding="utf-8")


with tempfile.TemporaryDirectory() as folder:
    paths = [os.path.join(folder, f"{seed}.yaml") for seed in SEEDS]
    statuses = [run("random", "--seed", str(seed), "-o", path) for seed, path in zip(SEEDS, paths)]
    check("30 systems", all(status == (0, "", "") for status in statuses), statuses)
    texts = [open(path, encoding="utf-8").read() for path in paths]
    check("another seed gives another system", len({text.split("\n", 1)[1] for text in texts}) == len(texts))

    # A simulation is the same everywhere: also on one CPU, at another priority, and beside others.
    os.chdir(folder)
    words = ["simulate", "6.yaml", "--runs", "4", "--duration", "2s", "--json", "-"]
    first = run(*words)
    one = str(min(os.sched_getaffinity(0)))
    elsewhere = subprocess.run(["taskset", "-c", one, "nice", takt, *words], env=environment, text=True, capture_output=True, timeout=120)
    check("a simulation is the same elsewhere", first[1] == elsewhere.stdout and first[1].count("chain_"), first, elsewhere.stderr)
    write_eight("eight.yaml")
    words = ["simulate", "eight.yaml", "--runs", "4", "--duration", "200ms", "--json", "-"]
    eight = run(*words)
    check("eight CPUs in two processes", eight[0] == 0 and json.loads(eight[1])["simulated"]["cpus"] == list(range(8)) and
          all(chain["instances"] > 0 for chain in json.loads(eight[1])["runs"][0]["chains"]), eight)
    hog = subprocess.Popen([sys.executable, "-c", "while True: pass"])
    places = [["taskset", "-c", str(cpu)] for cpu in sorted(os.sched_getaffinity(0))] + [["nice", "-n", "19"], []]
    for again in range(20):
        place = places[again % len(places)]
        there = subprocess.run([*place, takt, *words], env=environment, text=True, capture_output=True, timeout=120)
        check("the same 20 times, beside a hog", there.stdout == eight[1], place, there.stderr)
    hog.kill()
    hog.wait()
    shown = json.loads(first[1])
    for chain in range(len(shown["runs"][0]["chains"])):
        worst = max(shown["runs"], key=lambda result: result["chains"][chain]["latency_us"]["max"] or 0)
        again = ["simulate", "6.yaml", "--replay", worst["scenario"], "--duration", "2s"]
        repeated = json.loads(run(*again, "--json", "-")[1])["runs"][0]
        check("a run can be repeated", repeated == {**worst, "repeat": 0}, again)
        # The same trace, too, wherever it is.
        run(*again, "--trace", "here.json")
        subprocess.run(["taskset", "-c", one, "nice", takt, *again, "--trace", "there.json"], env=environment, capture_output=True, timeout=120)
        traces = [pathlib.Path(name).read_bytes() for name in ("here.json", "there.json")]
        check("its trace can be repeated", traces[0] == traces[1] and len(traces[0]) > 10000, again)
    misses = any(chain["misses"] for result in shown["runs"] for chain in result["chains"])
    check("a missed deadline is its status", first[0] == (1 if misses else 0), first[0])
    run("simulate", "6.yaml", "--runs", "3", "--trace", "trace.json")
    with open("trace.json", encoding="utf-8") as file:
        rows = {event["args"]["name"] for event in json.load(file)["traceEvents"] if event["name"] == "thread_name"}
    check("the timeline has the CPUs", any(row.startswith("CPU ") for row in rows), rows)
    check("lines of a person's length", max(len(line) for text in texts for line in text.splitlines()[1:]) < 130)

    line = texts[2].splitlines()[0]
    status, output, errors = run(*re.match(r"# Written by takt (random --seed 3 .*) \(Takt [0-9.]+\)$", line)[1].split())
    check("the first line gives the same file", status == 0 and output == texts[2], line, errors)

    status, output, errors = run("check", *paths)
    check("all are valid", status == 0 and output.count(": valid: ") == len(paths), output, errors)

    verdicts, bounds = collections.Counter(), {}
    for seed, path, text in zip(SEEDS, paths, texts):
        status, output, errors = run("analyze", path, "--json", "-")
        chains = json.loads(output)["chains"] if status in (0, 1) else []
        bounds[seed] = {chain["name"]: chain["bound_us"] for chain in chains}
        check(f"{os.path.basename(path)} can be analysed", len(chains) == text.count("name: chain_"), status, errors)
        verdicts.update(chain["verdict"] for chain in chains)
    check("each verdict occurs", set(verdicts) == {"bounded if", "not shown", "may lose some", "no bound"}, verdicts)

    status, lines, errors = run("random", "--seed", "1", "--lines", str(len(SEEDS)))
    check("the same systems as lines", status == 0 and [json.loads(line)["id"] for line in lines.splitlines()] == list(SEEDS), errors)
    shown = subprocess.run([takt, "analyze", "--lines"], env=environment, input=lines + '{"container": 1}\n' + lines.splitlines()[0],
                           text=True, capture_output=True, timeout=120)
    results = [json.loads(line) for line in shown.stdout.splitlines()]
    check("a line that is no file ends no other", shown.returncode == 2 and len(results) == len(SEEDS) + 1 and
          f"stdin:{len(SEEDS) + 1}:1" in shown.stderr and "1 of 32 lines are no systems" in shown.stderr, shown.stderr)
    check("lines have the bounds of the files", bounds == {
        result["id"]: {chain["name"]: chain["bound_us"] for chain in result["chains"]} for result in results}, bounds, results)
    check("schedulable is where each chain has a bound up to its deadline", all(result["is_schedulable"] == all(
        chain["bound_us"] is not None and chain["bound_us"] <= chain["deadline_us"] for chain in result["chains"])
        for result in results) and {result["is_schedulable"] for result in results} == {True, False})
    check("a system says its utilisation", {result["utilisation"] for result in results} <= {0.3, 0.5, 0.7, 0.9, 0.97, 1.3})
    for words, text in [((paths[0], "--lines"), "--lines"), (("--lines", "--json", "-"), "--lines"), ((), "FILE")]:
        status, output, errors = run("analyze", *words)
        check(f"analyze {' '.join(words)}", status == 2 and output == "" and text in errors, status, output, errors)

    all_texts = "\n".join(texts)
    check("the periods are those of cars",
          {int(period) for period in re.findall(r"period_us: \[(\d+)\]", all_texts)} <= PERIODS_US)
    for what, pattern in [("a reservation", "SCHED_DEADLINE"), ("logical execution time", " let: "),
                          ("an executor of several threads", r"threads: \[\w+, "), ("a relay", "relays: ")]:
        check(f"{what} occurs", re.search(pattern, all_texts))
    paths_of = [re.findall(r"path: \[(.*)\]", text) for text in texts]
    for what, shared in [("a shared timer", 1), ("a later fork", 2)]:
        begins = [[tuple(path.split(", ")[:shared]) for path in system if path.count(", ") >= shared] for system in paths_of]
        check(f"{what} occurs", any(len(set(system)) < len(system) for system in begins))
    for kind in ("executors", "schedulers"):
        used = set(re.findall(kind[:-1].replace("executor", "type") + r": (\w+)[,\n]", all_texts))
        drawn = names(kind) - {"preemptive"}  # its threads have a band of priorities
        check(f"all {kind} occur", used == drawn, used)

    status, output, errors = run("random", "--seed", "4", "--executors", "events", "--schedulers", "edf,fifo", "--cpus", "0")
    check("only what is asked for",
          status == 0 and set(re.findall(r"type: (\w+)", output)) == {"events"} and
          set(re.findall(r"scheduler: (\w+)", output)) <= {"edf", "fifo"} and
          set(re.findall(r"affinity: (\[.*?\])", output)) == {"[0]"}, output, errors)

    for what, words, text in [
            ("no seed", [], "--seed"), ("a wrong seed", ["--seed", "-1"], "--seed: '-1' is not a whole number from 0"), ("a long seed", ["--seed", 19 * "1"], "from 0 to 999999999999999999"),
            ("a wrong executor", ["--seed", "1", "--executors", "event"], "no executor is called 'event'; did you mean 'events'?"),
            ("a wrong scheduler", ["--seed", "1", "--schedulers", "edf,fast"], "no scheduler is called 'fast'"),
            ("a wrong CPU", ["--seed", "1", "--cpus", "9999"], "'9999' is not a CPU that this process may use"),
            ("a wrong file", ["--seed", "1", "-o", folder], "name a file in it")]:
        status, output, errors = run("random", *words)
        check(what, status == 2 and output == "" and text in errors, status, output, errors)

# ---- Task sets ----
status, output, errors = run("random", "tasks", "np_fp", "--tasks", "4", "--sets", "300", "--seed", "3", "--least", "0.2", "--most", "0.9")
sets = [json.loads(line) for line in output.splitlines()]
check("so many sets", status == 0 and [each["id"] for each in sets] == list(range(1, 301)), status, errors)
check("their utilisations are within the range, and of the tasks", all(
    0.195 <= each["utilisation"] <= 0.905 and len(each["tasks"]) == 4
    and abs(sum(task["C"] / task["T"] for task in each["tasks"]) - each["utilisation"]) < 1e-5 for each in sets), sets[0])
check("all of the range", max(each["utilisation"] for each in sets) > 0.85 and min(each["utilisation"] for each in sets) < 0.25)
check("their periods are those of cars", {task["T"] for each in sets for task in each["tasks"]} <= PERIODS_US)
check("the shorter period is the more urgent one", all(
    a["priority"] > b["priority"] and a["T"] <= b["T"] for each in sets for a, b in zip(each["tasks"], each["tasks"][1:])))
check("the same seed gives the same sets", run("random", "tasks", "np_fp", "--tasks", "4", "--sets", "300", "--seed", "3",
                                               "--least", "0.2", "--most", "0.9")[1] == output)
shown = subprocess.run([takt, "rta", "np_fp", "--lines"], env=environment, input=output, text=True, capture_output=True, timeout=60)
results = [json.loads(line) for line in shown.stdout.splitlines()]
check("the analysis reads them", shown.returncode == 0 and [(each["id"], each["utilisation"]) for each in results] ==
      [(each["id"], each["utilisation"]) for each in sets], shown.stderr)
check("some of them are schedulable", 0 < sum(each["is_schedulable"] for each in results) < 300)
status, output, errors = run("random", "tasks", "g_fp", "--processors", "4", "--tasks", "4", "--sets", "4000", "--least", "2.5", "--most", "2.5")
drawn = [sorted(task["C"] / task["T"] for task in json.loads(line)["tasks"]) for line in output.splitlines()]
check("sets for several processors", status == 0 and json.loads(output.splitlines()[0])["m"] == 4 and len(drawn) == 4000 and all(
    abs(sum(shares) - 2.5) < 0.003 and shares[-1] <= 1 for shares in drawn), errors)
# Uniform: as what is drawn without the limit, and kept if it is within.
dice, expected = random.Random(1), []
while len(expected) < 4000:
    cuts = sorted(dice.random() * 2.5 for _ in range(3))
    shares = sorted(b - a for a, b in zip([0, *cuts], [*cuts, 2.5]))
    if shares[-1] <= 1:
        expected.append(shares)
means = [[sum(shares[i] for shares in sets) / 4000 for i in range(4)] for sets in (drawn, expected)]
check("each as likely as another", all(abs(a - b) < 0.015 for a, b in zip(*means)), means)

full = json.loads(run("random", "tasks", "g_edf", "--processors", "4", "--tasks", "4", "--sets", "1", "--least", "4", "--most", "4")[1])
check("as many processors as tasks are one for each", all(task["C"] == task["T"] for task in full["tasks"]), full)

for what, words, text in [("too much for the processors", ["g_fp", "--most", "1.5"], "--most 1.5 is above 1"),
                          ("several where the method has one", ["fp", "--processors", "2"], "for several processors"),
                          ("chains", ["cil_edf_constrained"], "no task sets are drawn for 'cil_edf_constrained'"),
                          ("a wrong method", ["npfp"], "did you mean 'np_fp'?"),
                          ("a range that is none", ["fp", "--least", "0.9", "--most", "0.2"], "exchange them")]:
    status, output, errors = run("random", "tasks", *words)
    check(what, status == 2 and output == "" and text in errors, status, output, errors)

finish()
