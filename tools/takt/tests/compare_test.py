#!/usr/bin/env python3
"""What takt compare says of differences, as a person asks for it: compare_test.py TAKT FILE

No time is asserted, only relations: the machine may be as busy as it likes.
SPDX-License-Identifier: Apache-2.0
"""
import csv
import io
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../cmake"))
from checks import check, environment, finish  # noqa: E402

takt, system = map(os.path.abspath, sys.argv[1:3])
folder = pathlib.Path(tempfile.mkdtemp())
os.chdir(folder)
TWO = ("compare", system, "--executors", "single_threaded,events", "--duration", "200ms")
VERDICT = r"(real|the same within [0-9.]+ %|open: [0-9]+ repeats would (not )?decide|no verdict)"


def run(*words, status=0):
    done = subprocess.run([takt, *words], env=environment, stdin=subprocess.DEVNULL, text=True, capture_output=True,
                          timeout=300)
    check(f"takt {' '.join(words[2:])}: status {status}", done.returncode == status, done.returncode, done.stdout[-2000:],
          done.stderr)
    return done.stdout, done.stderr


def lines_of(text):
    return list(csv.DictReader(io.StringIO(text)))


# ---- In virtual time ----
pathlib.Path("one.yaml").write_text("""
machine: {cpus: [0]}
threads: {one: {policy: SCHED_FIFO, priority: 50, affinity: [0]}}
executors: {control: {type: events, threads: [one]}}
chains: [{name: brake, deadline: 6ms, path: [bumper/contact_timer, motor/contact]}]
container:
  components:
    - {component: takt::Workload, name: bumper, executor: control, callbacks: {contact_timer: {priority: 2}},
       parameters: {publishers: {topic: [contact], period_us: [10000], work_us: [1000]}}}
    - {component: takt::Workload, name: motor, executor: control, callbacks: {contact: {priority: 2}},
       parameters: {subscriptions: {topic: [contact], work_us: [2000]}}}
    - {component: takt::Workload, name: camera, executor: control, callbacks: {image_timer: {priority: 1}},
       parameters: {publishers: {topic: [image], period_us: [33000], work_us: [5000]}}}
""")
SIMULATED = ("compare", "one.yaml", "--simulate", "--executors", "events,preemptive", "--schedulers", "fixed_priority",
             "--duration", "2s", "--repeat", "6")
shown, _ = run(*SIMULATED)
check("it says that it is simulated", "6 runs each, simulated;" in shown and "interleaved" not in shown, shown)
check("without the CPU of a process", re.search(r"^events +fixed_priority .* - +\d+ +-$", shown, re.M), shown)
first, second = (json.loads(run(*SIMULATED, "--json", "-")[0]) for _ in range(2))
check("the JSON says so, too", first["simulated"] is True, first.keys())
check("the same again", first["runs"] == second["runs"])
longest = {run["executor"]: 0 for run in first["runs"]}
for one in first["runs"]:
    longest[one["executor"]] = max(longest[one["executor"]], one["chains"][0]["latency_us"]["max"])
check("who interrupts is not late", longest["preemptive"] <= 3000 < 7000 <= longest["events"], longest)
done = subprocess.run([takt, "compare", "one.yaml", "--simulate", "--executors", "preemptive", "--schedulers", "all", "--duration", "1s",
                       "--json", "-"], env=environment, stdin=subprocess.DEVNULL, text=True, capture_output=True, timeout=300)
check("with all, a pair that is refused is left out",
      "note: left out: executor 'preemptive' cannot interrupt by the order of 'ros'" in done.stderr, done.stderr)
check("and the others are compared", {run["scheduler"] for run in json.loads(done.stdout)["runs"]} >= {"edf", "fixed_priority"}, done.stdout[:500])
for words in (("--compositions", "single"), ("--", "true")):
    _, errors = run(*SIMULATED[:3], *words, status=2)
    check("of files as they are", "--simulate is for files as they are" in errors, errors)
_, errors = run("compare", "one.yaml", "--model", "m.yaml", status=2)
check("a model is for simulations", "--model is for --simulate" in errors, errors)

# ---- Published executors ----
pathlib.Path("own.yaml").write_text("""
executors: {mine: {type: events, scheduler: edf}}
container: {components: [{component: takt::Workload, name: nobody}]}
""")
compared = json.loads(run("compare", "one.yaml", "--simulate", "--executors", "file", "--as", "ros_rt,./own.yaml", "--duration", "1s",
                          "--json", "-")[0])["runs"]
check("published executors come after those of Takt, also one of a file",
      [(run["executor"], run["placement"]) for run in compared] == [("file", "file"), ("ros_rt", "as"), ("./own.yaml", "as")], compared)
check("they are what they are made of", [(run["executors"][0]["type"], run["executors"][0]["scheduler"]) for run in compared] ==
      [("events", "fifo"), ("preemptive", "fixed_priority"), ("events", "edf")], compared)
for command in ("run", "simulate", "analyze", "plan", "compare"):
    for word, parts in (("pica", ("the catalogue has no 'pica'", "did you mean 'picas'?", "./pica.yaml")),
                        ("rclc", ("fits no other file", "copy its `executors`")),
                        ("./none.yaml", ("none.yaml", "No such file"))):
        _, errors = run(command, "one.yaml", "--as", word, status=2)
        check(f"takt {command} refuses --as {word}", all(part in errors for part in parts) and errors.count("\n") == 1, errors)
for words in (("one.yaml", "--executor", "events"), ("one.yaml", "--scheduler", "edf"), ("one.yaml", "--placement", "merged"),
              ("--name", "robot"), ("one.yaml", "--", "true")):
    _, errors = run("run", "--as", "picas", *words, status=2)
    check(f"--as goes not with {words[1]}", "--as" in errors, errors)
for words, part in ((("--as", "events", "--executors", "events"), "both name 'events'"), (("--as", "picas,,multi"), "has an empty entry"),
                    (("--as", "picas", "--as", "events"), "--as is given more than once"),
                    (("--as", "picas", "--schedulers", "edf"), "--as has its own"), (("--as", "picas,picas"), "'picas' is given twice")):
    _, errors = run("compare", "one.yaml", *words, status=2)
    check(f"takt compare refuses {' '.join(words)}", part in errors and errors.count("\n") == 1, errors)
shown, _ = run("run", "one.yaml", "--as", "picas", "--duration", "100ms")
check("a run is under it", re.search(r"^brake +chain_aware +brake ", shown, re.M), shown)
shown, _ = run("plan", "one.yaml", "--method", "rate_monotonic")
check("a plan shows priorities by another method", re.search(r"^/motor +contact +default +brake +2 +10 ", shown, re.M), shown)

# ---- Six repeats ----
shown, _ = run(*TWO, "--repeat", "6", "--json", "six.json", "--csv", "six.csv", "--save", "before")
title = [line for line in shown.split("\n") if "95 % intervals, pairs of runs that took turns" in line]
check("one table has the ratios", len(title) == 1, shown)
check("its rows end with verdict, repeats, seconds and n",
      len(re.findall(rf"^events +single_threaded +\S.*{VERDICT} +[1-6] +[0-9.]+ +(\d+|-)$", shown, re.M)) >= 6, shown)
sentences = re.findall(r"^events: .*$", shown, re.M)
check("one sentence is of the executor", len(sentences) == 1, shown)
check("it names what is real, with its interval, or says that nothing is", re.match(
    r"events: (no real difference from single_threaded|"
    r"\S.*? is [0-9.]+ \([0-9.]+ to [0-9.]+\) of single_threaded.*: real, and so differ threads 3 against 2/3)\.", sentences[0]), sentences)
check("what else differs stands above the table", "rows differ in threads: 2/3 (single_threaded); 3 (events)\n" in shown, shown)
document = json.loads(pathlib.Path("six.json").read_text())
ratios = document["ratios"]
check("the figures are in the order of the table",
      [name for name in (of["figure"] for of in ratios) if name in ("p50", "p99", "max", "timer_p99", "cpu_%", "wakeups/s")] ==
      ["p50", "p99", "max", "timer_p99", "cpu_%", "wakeups/s"], ratios)
check("ratios lie in their intervals", all(0 < of["low"] <= of["ratio"] <= of["high"] for of in ratios), ratios)
check("all are of six pairs, or of fewer if a run had no sample", all(of["repeats"] <= 6 and of["is_paired"] for of in ratios), ratios)
check("what is real has an interval without 1",
      all(of["low"] > 1 or of["high"] < 1 for of in ratios if of["verdict"] == "real"), ratios)
check("what is open may need more repeats",
      all((of["repeats_to_decide"] or 1001) > 6 for of in ratios if of["verdict"] == "open"), ratios)
limits = document["bucket_limits_us"]
check("limits of buckets grow", all(low < high for low, high in zip(limits, limits[1:])))

rows = lines_of(pathlib.Path("six.csv").read_text())
check("the CSV has the same ratios", [(row["figure"], row["value"], row["verdict"]) for row in rows if row["of"] == "ratio"] ==
      [(of["figure"], json.dumps(of["ratio"]), of["verdict"]) for of in ratios], rows[-3:])
received = {(run["executor"], run["repeat"]): sum(callback["received"] for callback in run["callbacks"])
            for run in document["runs"]}
of_csv = dict.fromkeys(received, 0)
for row in rows:
    if row["figure"] == "received":
        of_csv[row["executor"], int(row["repeat"])] += int(row["value"])
check("and the same counts of each run", of_csv == received, of_csv, received)
buckets = [row for row in rows if row["figure"] == "latency_us bucket"]
check("each bucket has its limits", buckets and all(float(row["from"]) < float(row["to"]) for row in buckets), buckets[:3])
check("each row has the length of its run", all(float(row["seconds"]) > 0 for row in rows))
check("each time has its sample size", all(int(row["n"]) > 0 for row in rows if "_us " in row["figure"]))

done = subprocess.Popen([takt, *TWO, "--repeat", "1000", "--save", "cut"], env=environment, stdout=subprocess.PIPE,
                        stderr=subprocess.PIPE, text=True, start_new_session=True)
try:
    shown, errors = done.communicate(timeout=3)
except subprocess.TimeoutExpired:
    done.send_signal(signal.SIGINT)
    shown, errors = done.communicate(timeout=60)
check("its titles say how many runs there were", re.search(r"\(([0-9]+ to )?[0-9]+ of 1000 runs each", shown)
      and not re.search(r"\(1000 runs each", shown), shown)
check("an interrupted comparison stores nothing", done.returncode == 130 and "cut.compared.json" not in os.listdir(), errors)
check("and speaks of the signal that came", "SIGINT came" in errors and "SIGTERM" not in errors, errors)

# Stored last, the runs were lost with the report.
os.symlink("/dev/full", "full.html")
_, errors = run(*TWO, "--repeat", "1", "--report", "full.html", "--save", "kept", status=1)
check("a report that fails takes no stored runs with it", len(json.loads(pathlib.Path("kept.compared.json").read_text())["runs"]) == 2,
      errors)

# ---- Too few ----
for repeats, words in (("3", "3 repeats cannot"), ("1", "1 repeat cannot")):
    shown, _ = run(*TWO, "--repeat", repeats)
    said = re.findall(r"^no verdict: .*$", shown, re.M)
    check(f"{repeats} give no verdict, in one line", len(said) == 1 and words in said[0] and "six are the least" in said[0]
          and "ratios" not in shown and ": real" not in shown, shown)
shown, _ = run("compare", system, "--executors", "events", "--duration", "200ms")
check("one row has nothing to be compared with", "verdict" not in shown, shown)

# ---- Against what is stored ----
check("--save has stored the runs where its help says", "before.compared.json" in os.listdir())
shown, _ = run(*TWO, "--repeat", "6", "--against", "before")
check("both executors are compared with their own stored runs", len(re.findall(
    rf"^(events|single_threaded) +\1 \(before\) .*{VERDICT} +[1-6] and [1-6] ", shown, re.M)) >= 12, shown)
check("it says that these are no pairs", "before was stored: its runs and these did not take turns" in shown
      and "pairs of runs" not in shown, shown)
shown, _ = run("compare", system, "--executors", "events", "--duration", "40ms", "--repeat", "6", "--against", "before")
check("counts of runs of another length are left out, in a line that says so",
      "counts (misses, wakeups/s) are left out" in shown and not re.search(r"^events +\S.* wakeups/s ", shown, re.M), shown)
for repeats, words in (("3", "3 stored repeats cannot"), ("1", "1 stored repeat cannot")):
    run(*TWO, "--repeat", repeats, "--save", "few")
    shown, errors = run(*TWO, "--repeat", "4", "--against", "few")
    check(f"of {repeats} stored repeats it says that these are too few", f"no verdict: {words}" in shown
          and "store them again" in shown, shown)
    check("of the same file there is no note of another", "was stored of" not in errors, errors)
shutil.copy(system, "renamed.yaml")
_, errors = run("compare", "renamed.yaml", "--executors", "events", "--duration", "50ms", "--against", "few", "--json", "-")
check("another file is noted", f"note: few was stored of {system}, and is compared with renamed.yaml" in errors, errors)
shown, _ = run(*TWO, "--repeat", "6", "--against", "events")
check("another row is what the ratios are to", re.search(r"^single_threaded +events +p50 ", shown, re.M), shown)

# ---- What is refused, before anything runs ----
LONG = ("compare", system, "--duration", "1h")
for words, parts in (
        (("--against", "evens"), ("'evens' is neither", "did you mean 'events'?", "single_threaded, events, before")),
        (("--save", "nowhere/before"), ("nowhere/before.compared.json", "choose a writable file")),
        (("--save", "events"), ("'events' is an executor", "choose another name")),
        (("--csv", "nowhere/out.csv"), ("nowhere/out.csv", "choose a writable file")),
        (("--executors", "events,file,events"), ("--executors: 'events' is given twice", "name each once")),
        (("--schedulers", "fifo,fifo"), ("--schedulers: 'fifo' is given twice",)),
        (("--compositions", "single,single"), ("--compositions: 'single' is given twice",)),
        ((system,), ("is given twice",)),
        *(((option, name), (f"{option}: '{name}' is no name", "write one such as before")) for option in ("--save", "--against")
          for name in ("", "..", ".", "results/", "/", "a/..", ".json")),
        (("--csv", "-", "--json", "-"), ("cannot both be written to stdout",)),
        (("--against", system), ("is neither",)),
        (("--against", "six.csv.json"), ("this is no file of results",)),
        (("--against", "negative"), ("negative.compared.json", "cpu_percent", "a number from 0"))):
    pathlib.Path("six.csv.json").write_text("{}")
    negative = json.loads(pathlib.Path("before.compared.json").read_text())
    negative["runs"][0]["processes"][0]["cpu_percent"] = -1
    pathlib.Path("negative.compared.json").write_text(json.dumps(negative))
    executors = () if "--executors" in words else ("--executors", "single_threaded,events")
    shown, errors = run(*LONG, *executors, *words, status=2)
    check("in one line", len(errors.strip().split("\n")) == 1, errors)
    check(f"{' '.join(words)} is refused with the remedy", all(part in errors for part in parts) and not shown, errors)

# ---- takt run ----
shown, _ = run("run", system, "--duration", "200ms", "--csv", "-")
rows = lines_of(shown)
check("takt run writes CSV, too", {row["of"] for row in rows} >= {"timer", "subscription", "thread", "process"}, shown[:500])
check("without histograms unless asked", not any("bucket" in row["figure"] for row in rows))
shown, _ = run("run", system, "--duration", "200ms", "--csv", "-", "--histograms")
check("with them if asked", any("bucket" in row["figure"] for row in lines_of(shown)))
# ---- What cannot run the file ----
pathlib.Path("reserved.yaml").write_text("""
machine: {cpus: 2, rt_runtime: 950ms}
threads: {a: {policy: SCHED_DEADLINE, runtime: 9600us, period: 10ms}}
executors: {e: {type: events, threads: [a]}}
container:
  components:
    - {component: takt::Workload, name: x, executor: e, parameters: {publishers: {topic: [x], period_us: [20000], work_us: [500]}}}
""")
shown, errors = run("compare", "reserved.yaml", "--as", "all", "--simulate", "--duration", "100ms", "--json", "-")
served = {row["executor"] for row in json.loads(shown)["runs"]}
check("of --as all, what cannot run the file is left out, by name", "left out: multi cannot run 'reserved.yaml'" in errors
      and "SCHED_DEADLINE threads reserve 1.92 CPUs, of 1.9" in errors, errors)
check("and all others run", {"events", "single"} <= served and "multi" not in served, served)
# ---- A watched file ----
pathlib.Path("watched.yaml").write_text("""
machine: {exclusive: true, rt_runtime: unlimited}
analysis: {watch: true}
threads: {one: {affinity: [0]}}
executors: {default: {type: events, threads: [one]}}
chains: [{name: c, path: [x/x_timer]}]
container:
  components:
    - {component: takt::Workload, name: x, executor: default, parameters: {publishers: {topic: [x], period_us: [5000], work_us: [500]}}}
""")
_, errors = run("compare", "watched.yaml", "--executors", "file", "--duration", "200ms", "--json", "-")
check("what deviates is named", "watched.yaml, executor file: runs deviated from what its bounds rest on: " in errors, errors)
# ---- takt bench ----
shutil.copy(system, "twin.yaml")
shown, _ = run("bench", "topologies", system, "twin.yaml", "--duration", "50ms", "--repeat", "2", "--json", "-")
experiment = json.loads(shown)["experiments"][0]
of_series = {of["series"]: of["against"] for of in experiment["ratios"]}
check("each series of each file is compared with the first one of that file", len(of_series) == len(experiment["rows"]) - 2
      and all(other.split(",")[0] == name.split(",")[0] for name, other in of_series.items()), of_series)
os.chdir("/")
shutil.rmtree(folder)
finish()
