"""How fast simulations are, a part of results.py: in processor time, as others use the machine meanwhile.

SPDX-License-Identifier: Apache-2.0
"""
import json
import pathlib
import resource
import subprocess
import tempfile

import simulation_checks

REPEATS = 5  # the least counts: what disturbs takes longer
RUNS = 1000


def on_one_cpu(executors, components):
    """A file whose executors have a thread each."""
    threads = "".join(f"  t{i}: {{policy: SCHED_FIFO, priority: {50 + i}, affinity: [0]}}\n" for i in range(executors))
    made = "".join(f"  e{i}: {{type: events, threads: [t{i}]}}\n" for i in range(executors))
    listed = "".join(f"    - {{component: takt::Workload, name: n{i}, executor: e{executor}, parameters: {{{parameters}}}}}\n"
                     for i, (executor, parameters) in enumerate(components))
    return f"machine: {{cpus: 1}}\nthreads:\n{threads}executors:\n{made}container:\n  components:\n{listed}"


def timer(topic, period_us, work_us):
    return f"publishers: {{topic: [{topic}], period_us: [{period_us}], work_us: [{work_us}]}}"


def relay(source, topic, work_us):
    return f"relays: {{input: [{source}], output: [{topic}], work_us: [{work_us}]}}"


def reader(topic, work_us):
    return f"subscriptions: {{topic: [{topic}], work_us: [{work_us}]}}"


ONE = on_one_cpu(1, [(0, timer("a", 20, 5)), (0, reader("a", 5))])
FOUR = on_one_cpu(4, [(0, timer("a", 1000, 100)), (1, relay("a", "b", 100)), (2, relay("b", "c", 100)), (3, reader("c", 100))])
TWENTY = on_one_cpu(1, [(0, callback) for i in range(10) for callback in (timer(f"x{i}", 10000, 100), reader(f"x{i}", 100))])
REFERENCE = "bench/workloads/reference_system.yaml"
# Name → file, options, what is shown, and the goal: at least so many a second, or at most so many seconds.
ROWS = {
    "one executor": (ONE, "--duration 20s", "callbacks/s", 2e6),
    "four executors on one CPU": (FOUR, "--duration 60s", "callbacks/s", 150e3),
    "an hour of the Autoware reference system, one executor": (REFERENCE, "--duration 1h --placement merged", "s", 6),
    "an hour of the Autoware reference system, as planned": (REFERENCE, "--duration 1h", "s", 30),
    "20 callbacks, made, run for 1 µs and taken down": (TWENTY, f"--duration 1us --runs {RUNS}", "s a run", 2e-3),
}


def is_rate(unit):
    return unit == "callbacks/s"


def holds(row):
    value, goal = row["value"], ROWS[row["name"]][3]
    return value >= goal if is_rate(row["unit"]) else value <= goal


def measure_once(takt, file, options, unit):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder, "out.json")
        # Exit 1: a chain missed its deadline.
        done = subprocess.run([takt, "simulate", file, *options.split(), *(["--json", out] if is_rate(unit) else [])],
                              stdout=subprocess.DEVNULL, check=False)
        if done.returncode not in (0, 1):
            raise SystemExit(f"takt simulate {file}: exit {done.returncode}")
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        used_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        if not is_rate(unit):
            return used_s / (RUNS if unit == "s a run" else 1)
        run = json.loads(out.read_text(encoding="utf-8"))["runs"][0]
        return sum(callback["received"] for callback in run["callbacks"]) / used_s


def measure(takt, root):
    rows = []
    for name, (text, options, unit, _) in ROWS.items():
        with tempfile.TemporaryDirectory() as folder:
            file = root / text
            if "\n" in text:
                file = pathlib.Path(folder, "system.yaml")
                file.write_text(text, encoding="utf-8")
            values = [measure_once(takt, file, options, unit) for _ in range(REPEATS)]
        rows.append({"name": name, "unit": unit, "value": max(values) if is_rate(unit) else min(values)})
    return {"rows": rows}


def shown(value, unit):
    if is_rate(unit):
        return f"{value:,.0f} {unit}"
    return f"{1000 * value:.2f} ms" if unit == "s a run" else f"{value:.1f} s"


def what_follows(document):
    missed = [row["name"] for row in document["rows"] if not holds(row)]
    return ("Processor time of `takt simulate`, its start and its result included, the least of "
            f"{REPEATS} times. " + (f"These miss their goal: {'; '.join(missed)}." if missed else "All goals hold."))


def section(document, table):
    speeds = table(["simulated", "takes", "goal"],
                   [[row["name"], shown(row["value"], row["unit"]),
                     ("≥ " if is_rate(row["unit"]) else "≤ ") + shown(ROWS[row["name"]][3], row["unit"])]
                    for row in document["rows"]])
    checks = document.get("checks")
    return f"{speeds}\n\n{simulation_checks.section(checks, table)}" if checks else speeds
