#!/usr/bin/python3
"""What --json writes keeps the schemas that the documents promise: results_test.py TAKT SCHEMA

Those of analyze and rta are beside that of results.

SPDX-License-Identifier: Apache-2.0
"""
import copy
import json
import os
import re
import subprocess
import sys
import tempfile

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../cmake"))
from checks import check, environment, finish, skip  # noqa: E402

try:
    import jsonschema
except ImportError:
    skip("apt-get install python3-jsonschema brings what looks at schemas")

takt, schema = map(os.path.abspath, sys.argv[1:])


def validator_of(path):
    with open(path, encoding="utf-8") as text:
        result = jsonschema.Draft202012Validator(json.load(text))
    result.check_schema(result.schema)
    return result


validator, of_analyze, of_rta = (validator_of(os.path.join(os.path.dirname(schema), name)) for name in (
    os.path.basename(schema), "analyze.schema.json", "rta.schema.json"))

COMPONENTS = """
    - {component: takt::Workload, name: camera, executor: all,
       parameters: {publishers: {topic: [image], period_us: [5000], size_bytes: [64]}}}
"""
SINK = """
    - {component: takt::Workload, name: detector, executor: all,
       parameters: {subscriptions: {topic: [image], work_us: [10]}}}
"""
HEAD = """
threads: {one: {policy: SCHED_DEADLINE, runtime: 1ms, period: 5ms}, two: {nice: 5}}
executors: {all: {type: multi_threaded, threads: [one, two]}}
chains: [{name: sees, path: [camera/image_timer, detector/image], deadline: 5ms}]
"""


def errors(document, by=validator):
    return [f"{error.json_path}: {error.message}" for error in by.iter_errors(document)]


def document(*words, text=""):
    done = subprocess.run([takt, *words, "--json", "-"], env=environment, input=text,
                          stdout=subprocess.PIPE, text=True, timeout=120)
    return json.loads(done.stdout)


def holds(what, written, by=validator):
    found = errors(written, by)
    check(f"{what} keeps the schema", not found, *found[:5])
    return written


with tempfile.TemporaryDirectory() as folder:
    one, two = (os.path.join(folder, name) for name in ("one.yaml", "two.yaml"))
    with open(one, "w", encoding="utf-8") as file:
        file.write(f"{HEAD}container:\n  name: robot\n  components:{COMPONENTS}{SINK}")
    with open(two, "w", encoding="utf-8") as file:
        file.write(f"{HEAD}containers:\n  - name: eyes\n    components:{COMPONENTS}"
                   f"  - name: brain\n    components:{SINK}")
    written = holds("takt run", document("run", one, "--duration", "200ms"))
    run = written["runs"][0]
    check("the run has callbacks, chains, threads and processes to look at",
          all(run[key] for key in ("callbacks", "chains", "threads", "processes")), run)
    holds("takt run, traced,", document("run", one, "--duration", "200ms", "--histograms",
                                        "--trace", os.path.join(folder, "trace.json")))
    written = holds("takt run of two processes", document("run", two, "--duration", "200ms"))
    for run in (run, written["runs"][0]):
        slices = run["over_time"]["slices"]
        served = sum(callback["latency_us"]["count"] for callback in run["callbacks"] if callback["kind"] != "timer")
        check("the slices of a run's time have all messages, in order", served > 0 and sum(part["count"] for part in slices) == served and
              [part["begin_s"] for part in slices] == sorted({part["begin_s"] for part in slices}), served, slices)
    check("that run has topics to look at", written["runs"][0].get("topics"), written["runs"][0])
    model = os.path.join(folder, "model.yaml")
    trace = os.path.join(folder, "trace.json")
    document("run", one, "--duration", "200ms", "--trace", trace)
    document("model", trace, "-o", model)
    analysis = holds("takt analyze", document("analyze", one), of_analyze)
    check("it looks for nothing that would help unless asked", analysis["suggestions"] is None, analysis)
    analysed = holds("takt analyze with a model", document("analyze", one, "--model", model, "--suggest", "1s"), of_analyze)
    check("it has suggestions if asked", analysed["suggestions"] is not None, analysed)
    check("it has observed latencies", analysed["chains"][0]["observed_us"], analysed)
    holds("takt analyze of two processes", document("analyze", two), of_analyze)
    holds("a sweep", document("analyze", one, "--sweep", "threads.one.runtime=1ms..2ms"), of_analyze)
    holds("takt compare", document("compare", one, "--executors", "events,isolated", "--schedulers",
                                   "file,edf", "--duration", "100ms"))

# What ran little of what was due looked best: its row said nothing of it.
STARVED = """
    - {component: takt::Workload, name: both, parameters:
       {publishers: {topic: [a], period_us: [1000], size_bytes: [64]}, subscriptions: {topic: [a], work_us: [2500]}}}
"""
with tempfile.TemporaryDirectory() as folder:
    system, result = (os.path.join(folder, name) for name in ("starved.yaml", "result.json"))
    with open(system, "w", encoding="utf-8") as file:
        file.write(f"container:\n  name: robot\n  components:{STARVED}")
    words = [takt, "compare", system, "--executors", "events,multi_threaded", "--duration", "500ms"]
    shown = subprocess.run([*words, "--json", result], env=environment, stdin=subprocess.DEVNULL,
                           stdout=subprocess.PIPE, text=True, timeout=120).stdout
    with open(result, encoding="utf-8") as file:
        releases = [run["releases"] for run in json.load(file)["runs"]]
    check("most releases were skipped", releases[0]["due"] > 2 * releases[0]["served"] > 0, releases)
    sentence = "releases of timers that were served: " + ", ".join(
        f"{name} {1000 * of['served'] // of['due'] / 10} % ({of['served']} of {of['due']})"
        for name, of in zip(("events", "multi_threaded"), releases))
    check("takt compare says so", sentence in shown, sentence, shown)
    table = shown[shown.index("\nexecutor  ") + 1:].split("\n")
    titles, row = (line.split() for line in table[:2])
    cells = dict(zip(titles, row))
    check("it shows the overruns", int(cells["overruns"]) >= releases[0]["due"] - releases[0]["served"], cells)
    rate = int(cells["received"]) / float(cells["seconds"].rstrip("!"))
    check("and what was received by the second of the run", abs(float(cells["received/s"]) - rate) < 0.02 * rate, cells)

methods = re.findall(r"^  ([a-z_]+)  +[A-Z]", subprocess.run([takt, "rta"], env=environment, text=True,
                                                             capture_output=True, check=True).stdout, re.M)
for method in methods:
    help_ = subprocess.run([takt, "rta", method, "--help"], env=environment, text=True, capture_output=True, check=True).stdout
    example = re.search(r"<<END\n(.*)\nEND\n", help_, re.S)[1]
    holds(f"takt rta {method}", document("rta", method, text=example), of_rta)
check("methods to look at", len(methods) >= 18, methods)

# What the schema is there for.
analysis["chains"][0]["verdict"] = "fine"
check("the schema of analyze refuses a verdict that it does not know", errors(analysis, of_analyze))
for what, spoil in (("a key that it does not know", lambda run: run.update(new=1)),
                    ("a key that is missing", lambda run: run["callbacks"][0].pop("received")),
                    ("a negative count", lambda run: run["callbacks"][0].update(lost=-1)),
                    ("a key of a thread that it does not know",
                     lambda run: run["threads"][0]["asked"].update(new=1))):
    spoiled = copy.deepcopy(written)
    spoil(spoiled["runs"][0])
    check(f"the schema refuses {what}", errors(spoiled))

finish()
