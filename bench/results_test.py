#!/usr/bin/python3
"""What results.py makes of data: results_test.py

SPDX-License-Identifier: Apache-2.0
"""
import contextlib
import io
import json
import os
import pathlib
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path += [HERE, os.path.join(HERE, "../cmake")]
from checks import check, finish  # noqa: E402
import bounds  # noqa: E402
import results  # noqa: E402
import simulation_checks  # noqa: E402
import threads  # noqa: E402
import wire  # noqa: E402

MACHINE = {"cpus": 2, "cpu": "Some CPU", "kernel": "6.1", "preemption": "PREEMPT_RT", "load_average": 0.25}
README = "# Takt\n<!-- figures: robot -->\n<!-- end -->\nand\n<!-- figures: dispatch -->\nold 99\n<!-- end -->\nlast\n"


def value(*runs):
    return {"median": sorted(runs)[len(runs) // 2], "min": min(runs), "max": max(runs), "runs": list(runs)}


def experiment(name):
    metrics = {"latency_us": value(10, 12.34, 4000), "lost": {"sum": 3, "runs": [3]}}
    return {"machine": MACHINE, "name": name, "title": f"Title of {name}", "x_label": "nodes", "statistics": "full",
            "metrics": ["latency_us"], "labels": {"latency_us": "mean latency (µs)"}, "repeat": 3, "duration": "1s",
            "deviations": ["The machine is another."],
            "rows": [{"series": "events", "x": 5, "metrics": metrics}, {"series": "loaned", "missing": "no RouDi"}]}


def dispatch_row(name, *times):
    return [{"run_name": name, "run_type": "iteration", "cpu_time": time, "time_unit": "ns"} for time in times]


def chain(name, bound_us, p999):
    return {"name": name, "deadline_us": None, "bound_us": bound_us, "reason": None if bound_us else "its thread is late",
            "observed_us": {"instances": 60, "p50": 1000, "p99": p999, "p999": p999, "max": p999},
            "segments": [{"executor": "e", "wait_us": 2500, "bound_us": bound_us}]}


def analyses():
    return [{"file": "bench/workloads/reference_system.yaml", "variant": "planned", "analysed_in_s": 0.25,
             "chains": [chain("front", 10_000, 4_000), chain("rear", 10_000, 6_000), chain("other", None, 7_000)]}]


def reality():
    """One system: of two chains one is off, and of four spans one has another order than simulated."""
    def row(p50, p90):
        return {"p50": p50, "p90": p90, "p99": 9000}
    return [{"name": "robot, events", "file": "robot.yaml", "late_us": [900, 300, 400], "windows": 4, "equal": 3, "second_windows": 5, "second_equal": 4,
             "chains": [{"name": "near", "run": row(1000, 2000), "simulated": row(1090, 2250)},
                        {"name": "far", "run": row(100, 200), "simulated": row(151, 300)}]}]


def execution(start, end, ready, callback):
    return (start, end, ready, callback, "timer")


def check_order():
    """Three spans of two executors: the second one has another order on `slow`."""
    rows = {"/a/x": "fast", "/b/y": "slow", "/b/z": "slow"}
    begin = results.reality.BEGIN_US
    one = [execution(begin + 1, begin + 5, begin, "/a/x"), execution(begin + 2, begin + 9, begin, "/b/y"),
           execution(begin + 101, begin + 105, begin + 100, "/b/y"), execution(begin + 106, begin + 109, begin + 100, "/b/z"),
           execution(begin + 201, begin + 205, begin + 200, "/a/x")]
    other = [execution(begin + 1, begin + 8, begin, "/b/y"), execution(begin + 3, begin + 6, begin, "/a/x"),
             execution(begin + 101, begin + 105, begin + 100, "/b/z"), execution(begin + 106, begin + 109, begin + 100, "/b/y"),
             execution(begin + 201, begin + 205, begin + 200, "/a/x")]
    check("the order of starts is compared by executor and span", results.reality.share_of_equal(one, other, rows) == (3, 2),
          results.reality.windows_of((one, other), rows))
    check("releases of a run are a scenario", results.reality.scenario_of(one) ==
          f"1,drawn,/a/x={round(1000 * begin)}ns,/b/y={round(1000 * begin)}ns,/b/z={round(1000 * (begin + 100))}ns")


def literature():
    """One experiment, whose claim holds here and is open simulated; and one about zero."""
    claim = {"text": "It is less.", "metric": "chain_p99_ms", "less": "picas", "more": "multi", "simulated": False, "ratio": 0.5,
             "low": 0.4, "high": 0.625, "repeats": 10, "verdict": "holds"}
    none = {"text": "None starves.", "metric": "starved_timers", "less": "mt_fair", "more": "", "x": 4, "simulated": False, "repeats": 10,
            "verdict": "holds"}
    return [{"name": "picas", "title": "PiCAS (2021)", "x_label": "", "labels": {"chain_p99_ms": "p99 (ms)"}, "rows": [],
             "repeat": 10, "duration": "1s", "deviations": ["The times are ours."], "claims": [claim, claim | {"simulated": True, "high": 1.25, "verdict": "open"}]},
            {"name": "mt_fair", "title": "Fair (2024)", "x_label": "example", "labels": {"starved_timers": "starved"}, "rows": [],
             "deviations": [], "claims": [none]}]


def pieces():
    """A row of each piece of threads."""
    ratio = {"median": 1.94, "min": 1.9, "max": 1.97}
    rows = {
        "scaling": {"name": "events", "shape": "chain", "work_us": 10, "workers": 2, "alone_ns": 10_000, "least_share": 0.97,
                    "metrics": dict.fromkeys(("gain", "gain_apart", "of_apart", "cpu", "line_ns"), ratio)},
        "hand_over": {"name": "events", "hz": 30_000, "metrics": {"futex": {"median": 25_463, "min": 25_254, "max": 25_616}}},
        "transfer": {"name": "stream_bare", "metrics": {"ns": ratio}},
        "nodes": {"name": "ros2", "nodes": 250,
                  "metrics": dict.fromkeys(("create_ms", "spin_ms", "end_ms", "node_kB", "statistics_kB", "objects_kB",
                                            "ratio"), ratio)},
        "round_trips": {"name": "Takt", "bytes": 1_000_000,
                        "metrics": dict.fromkeys(("p50_us", "p99_us", "cpu_us", "switches"), [770, 765.5, 790])},
        "streams": {"name": "Takt", "bytes": 16,
                    "metrics": dict.fromkeys(("per_s", "lost", "cpu_us", "switches"), [3.5, 4, 5])}}
    return {name: {"load_before": 0.5, "load_after": 1.25, "rows": [row]} for name, row in rows.items()}


def data(commit):
    rows = (dispatch_row("between_threads/process_time", 27, 28, 26)
            + dispatch_row("ping_pong/events/threads:1/statistics:count/nodes/2/process_time", 36, 37, 41)
            + dispatch_row("ping_pong/events/threads:1/statistics:full/nodes/20/process_time", 120, 122, 130))
    timer = {"name": "events", "cycles": 1000, "p50_us": 1.5, "p99_us": 30, "max": 99, "early": 0, "cpu_percent": 2}
    return {"about": {"commit": commit, "load_before": 0.1, "load_after": 1.5},
            "dispatch": {"context": {"load_avg": [0.5]}, "benchmarks": rows},
            "timers": {"machine": MACHINE, "thread": {"0": timer}},
            **{name: experiment(name) for name in results.EXPERIMENTS}}


def robot_data(commit):
    rows = [{"name": "events", "buckets": [[26, 99], [2750, 1]],
             "metrics": {"p50_us": value(26.625, 27, 26), "p99_us": value(2750), "cpu_percent": value(18.04)}},
            {"name": "isolated", "buckets": [[54, 99], [4456, 1]],
             "metrics": {"p50_us": value(54), "p99_us": value(4456), "cpu_percent": value(18.5)}}]
    return {"date": "2026-01-05", "commit": commit, "machine": MACHINE, "rows": rows}


REFERENCE = {"rclcpp": [{"label": "events", "planner_deviation_ms": 2.5}], "executors": [
    {"label": "events", "program": "autoware_default_singlethreaded", "planner_period_ms": [99, 101, 100, 1.9]}]}


def git(root, *words):
    done = subprocess.run(["git", "-c", "user.name=t", "-c", "user.email=t@t", *words], cwd=root, check=True,
                          stdout=subprocess.PIPE, text=True)
    return done.stdout.strip()


def outcome(root):
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        holds = results.check(root)
    return holds, said.getvalue()


def commit_source(root, name, text):
    (root / "base").mkdir(exist_ok=True)
    (root / "base" / name).write_text(text, encoding="utf-8")
    git(root, "add", "-A")
    git(root, "commit", "-qm", name)
    return git(root, "rev-parse", "HEAD")


SYSTEM = "# A robot\nthreads:\n  a: {}\nexecutors:\n  default: {}\ncontainer:\n  components:\n    - component: a::B\n"
check("a variant has the executor, and all chains", bounds.variant_of(SYSTEM, "type: events") ==
      f"# A robot\nchains: auto\nthreads:\n  main_cpu: {bounds.THREAD}\nexecutors:\n  default: {{type: events, "
      "threads: [main_cpu]}\ncontainer:\n  components:\n    - component: a::B\n      executor: default\n", bounds.variant_of(SYSTEM, "type: events"))
check("what is planned stays, and so do chains", bounds.variant_of("chains: []\n" + SYSTEM, None) == "chains: []\n" + SYSTEM)

check("a row of Google Benchmark is its words",
      threads.words_of({"run_name": "events/chain/work_us:10/workers:2/iterations:20/real_time"}) == ["events", "chain", "10", "2"])
PING = "[7] 2.000  vm:7 size 16 mean 29.9us min 20.8us 50% 28.5us 90% 32.5us 99% 51.5us max 99us cnt 16663\n"
check("ddsperf halves round trips", wire.ddsperf_figures(PING) == {"p50_us": 57, "p99_us": 103, "per_s": 16663})
SUB = "[7] 1.001  size 16 total 1645552 lost 3 delta 1645552 lost 0 rate 1644.60 kS/s 210.51 Mb/s (164.46 kS/s 21.05 Mb/s)\n"
check("and counts thousands", wire.ddsperf_figures(SUB) == {"per_s": 1_644_600, "lost": 3}, wire.ddsperf_figures(SUB))

with tempfile.TemporaryDirectory() as folder:
    root = pathlib.Path(folder)
    git(root, "init", "-q")
    commit = commit_source(root, "clock.hpp", "1")
    (root / "README.md").write_text(README, encoding="utf-8")
    for date in ("2026-01-01", "2026-01-02"):
        (root / "docs/results" / date).mkdir(parents=True)
        for name, document in data(commit).items():
            path = root / "docs/results" / date / f"{name}.json"
            path.write_text(results.rows_on_lines(document), encoding="utf-8")
            check(f"{date}/{name}: rows on lines are the same data",
                  json.loads(path.read_text(encoding="utf-8")) == document)
    (root / "docs/results/bounds").mkdir()
    (root / "docs/results/bounds/bounds.json").write_text(results.rows_on_lines(
        {"date": "2026-01-03", "commit": commit, "machine": MACHINE, "analyses": analyses()}), encoding="utf-8")
    (root / "docs/results/threads").mkdir()
    (root / "docs/results/reality").mkdir()
    (root / "docs/results/reality/reality.json").write_text(json.dumps(
        {"date": "2026-01-06", "commit": commit, "machine": MACHINE, "systems": reality()}), encoding="utf-8")
    (root / "docs/results/simulation").mkdir()
    (root / "docs/results/simulation/simulation.json").write_text(json.dumps(
        {"date": "2026-01-07", "commit": commit, "machine": MACHINE, "rows": [
            {"name": "one executor", "unit": "callbacks/s", "value": 6e6},
            {"name": "20 callbacks, made, run for 1 µs and taken down", "unit": "s a run", "value": 0.0021}],
         "checks": {"exact": {"name": "exact", "systems": 500, "found": "of 500 systems, 470", "cpu_s": 61.2, "load": 1.25,
                              "date": "2026-01-08", "commit": commit}}}), encoding="utf-8")
    (root / "docs/results/literature").mkdir()
    (root / "docs/results/literature/literature.json").write_text(json.dumps(
        {"date": "2026-01-05", "commit": commit, "machine": MACHINE, "experiments": literature()}), encoding="utf-8")
    (root / "docs/results/threads/threads.json").write_text(results.rows_on_lines(
        {"date": "2026-01-04", "commit": commit, "machine": MACHINE, "pieces": pieces()}), encoding="utf-8")
    for name, document in (("robot", robot_data(commit)), ("reference_system", REFERENCE)):
        (root / "docs/results" / name).mkdir()
        (root / f"docs/results/{name}/{name}.json").write_text(results.rows_on_lines(document), encoding="utf-8")
    # Not drawn here, as matplotlib need not be there.
    results.robot.draw = lambda data, reference, shade: f"{results.robot.mark(data, reference)}\n<svg>{shade}</svg>"
    wide = results.table(["a", *"bcdefgh"], [range(8)], keys=2)
    check("no table has more than six columns", max(line.count("|") - 1 for line in wide.splitlines()) == 6, wide)
    check("nothing made yet: that is wrong", not outcome(root)[0])
    results.write(root)
    page = (root / "docs/results/2026-01-02.md").read_text(encoding="utf-8")
    readme = (root / "README.md").read_text(encoding="utf-8")
    check("the newest date has the page", not (root / "docs/results/2026-01-01.md").exists())
    check("the first line names the commit", page.startswith(f"Measured at commit {commit[:9]};"), page)
    for text in ("| events | 5 | 12.3 (10 – 4000) | 3 |", "- The machine is another.", "loaned (no RouDi)",
                 "Statistics `full`; medians and ranges of 3 runs of 1s each", "Load average 0.2 at the end",
                 "Load average 0.1 at the start, 1.5 at the end", "2 × Some CPU, Linux 6.1, PREEMPT_RT",
                 "| events | 1.50 | 30.00 | 99 | 0 | 2.00 |", "| Nav2 needs less memory in one process"):
        check(f"the page has: {text}", text in page, page)
    page_of_bounds = (root / "docs/results/bounds.md").read_text(encoding="utf-8")
    for text in ("Measured on 2026-01-03 on 2 × Some CPU", f"Measured at commit {commit[:9]};",
                 "| `reference_system` | planned | 3, 2 | 0.60 (0.60) | 7.000 | 10.000 |", "No observed latency was above its bound: 2 bounds",
                 "| front | planned | 4.000 | 4.000 | 10.000 | 2.500 |",
                 "- `reference_system`, planned, other: its thread is late"):
        check(f"the page of bounds has: {text}", text in page_of_bounds, page_of_bounds)
    page_of_literature = (root / "docs/results/literature.md").read_text(encoding="utf-8")
    for text in ("# Which executor for which robot", "Measured on 2026-01-05 on 2 × Some CPU",
                 "`takt bench picas` holds; p99 (ms) under `picas` is 0.50 (0.40 to 0.62) times that under `multi`.", "`takt bench mt_fair` holds.",
                 "| `picas` | It is less. | p99 (ms): `picas` ÷ `multi` | 0.50 (0.40 to 0.62), holds | 0.50 (0.40 to 1.25), open |",
                 "| `mt_fair` | None starves. | starved: `mt_fair`, 4 example | always 0, holds | - |",
                 "**`picas`**, PiCAS (2021). The times are ours."):
        check(f"the page of papers has: {text}", text in page_of_literature, page_of_literature)
    page_of_reality = (root / "docs/results/reality.md").read_text(encoding="utf-8")
    for text in ("Measured on 2026-01-06 on 2 × Some CPU", "Of 2 chains, the simulated median is within its aim of the run's for 1, p90 for 2. In 0 of 1",
                 "| robot, events | 3, 0.3 | 4 | 75.0 % | 80.0 % | 1 of 2 |", "| robot, events | near | 1.000, 1.090 | 2.000, 2.250 | 9.000, 9.000 |",
                 "| robot, events | far | 0.100, 0.151 **off** | 0.200, 0.300 | 9.000, 9.000 |"):
        check(f"the page of runs and simulations has: {text}", text in page_of_reality, page_of_reality)
    page_of_simulation = (root / "docs/results/simulation.md").read_text(encoding="utf-8")
    for text in ("# How fast simulations are", "Measured on 2026-01-07 on 2 × Some CPU", "| one executor | 6,000,000 callbacks/s | ≥ 2,000,000 callbacks/s |",
                 "These miss their goal: 20 callbacks, made, run for 1 µs and taken down.", "| 2.10 ms | ≤ 2.00 ms |",
                 "| a search reaches 90 % of bounds that are exact, in 80 % of systems | 500 | of 500 systems, 470 | 61 s | 2026-01-08, "):
        check(f"the page of speed has: {text}", text in page_of_simulation, page_of_simulation)
    check("of mutants, how many are seen, and the slowest", simulation_checks.found(
        "seen   a: x (3.1 s of CPU)\nMISSED b: y (180.2 s of CPU)\n", simulation_checks.CHECKS["mutants"][3]) ==
          "1 of 2, the slowest in 180 s; MISSED b")
    check("what a search lacks", simulation_checks.found(
        "chain_1 of seed 7: 3ms instead of 4ms\nseeds 1 to 9: of 20 chains, a search finds less for 1\nabout\n",
        simulation_checks.CHECKS["search"][3]) == "chain_1 of seed 7: 3ms instead of 4ms; of 20 chains, a search finds less for 1")
    check_order()
    page_of_threads = (root / "docs/results/threads.md").read_text(encoding="utf-8")
    for text in ("Measured on 2026-01-04 on 2 × Some CPU", "Load average 0.5 before, 1.2 after. Eight callbacks",
                 "| `events` | chain | 10 | 2 | 1.94 (1.90 – 1.97) |", "| `events` | 30,000 | 25,463 (25,254 – 25,616) |",
                 "| `stream_bare` | 1.94 (1.90 – 1.97) | 1.00 |", "| 250 | parameter services, graph and rosout, on DDS | 1.94",
                 "| 1,000,000 | Takt | 770 (766 – 790) |", "| 16 | Takt | 4.0 (3.5 – 5.0) |"):
        check(f"the page of threads has: {text}", text in page_of_threads, page_of_threads)
    for text in ("| `events`, statistics `count` | 37 (36 – 41) |  |",
                 "| `events`, statistics `full` |  | 122 (120 – 130) |", "between threads needs | 27 (26 – 28) |  |",
                 "| `events` | 26.6 (26 – 27) | 2750 (2750 – 2750) | 18 (18 – 18) |", "within 2.8 ms under `events`, within 4.5 ms under `isolated`, for 18.0 to 18.5 %",
                 "](docs/results/2026-01-02.md)"):
        check(f"the README has: {text}", text in readme, readme)
    check("what is between the marks goes, the rest stays",
          "old 99" not in readme and readme.startswith("# Takt\n") and readme.endswith("-->\nlast\n"), readme)
    check("what is made is right, and nothing is said", outcome(root) == (True, ""), outcome(root))
    check("the picture's rows are rclcpp's and Takt's", results.robot.jitter_rows(REFERENCE) == [("rclcpp: events", 2.5), ("Takt: events", 1.9)])
    picture = root / "docs/results/robot/robot_dark.svg"
    picture.write_text(picture.read_text(encoding="utf-8").replace("data ", "data 0"), encoding="utf-8")
    check("a picture of other data is found", "robot_dark.svg:1:" in outcome(root)[1], outcome(root))
    results.write(root)
    check("and made again", outcome(root) == (True, ""), outcome(root))

    (root / "README.md").write_text(readme.replace("122", "121"), encoding="utf-8")
    check("a figure of the README that the data does not have is found", "README.md:1:" in outcome(root)[1])
    results.write(root)
    (root / "docs/results/2026-01-02.md").write_text(page.replace("12.3", "9.3"), encoding="utf-8")
    check("one of the page, too", outcome(root)[0] is False and "2026-01-02.md:1:" in outcome(root)[1])
    results.write(root)

    commit_source(root, "clock_test.cpp", "1")
    check("a test is not what is measured", outcome(root) == (True, ""), outcome(root))
    commit_source(root, "clock.hpp", "2")
    check("a change of the code makes a note, and no error",
          outcome(root)[0] and "older than the code" in outcome(root)[1], outcome(root))
    results.write(root)
    first = (root / "docs/results/2026-01-02.md").read_text(encoding="utf-8").splitlines()[0]
    check("then the page says so in its first line", first.startswith("**Older than the code**"), first)
    check("and that is right", outcome(root) == (True, ""), outcome(root))
    check("a commit that git does not know is no error", results.code_is_newer(root, "0" * 40) is None)
finish()
