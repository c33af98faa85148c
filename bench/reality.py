"""Simulated systems beside real ones, a part of results.py: does a run of 30 s do what its simulation says?

Each system runs under real-time policies, a model is made of its trace, and it is simulated with that model and with the first
releases of the run. In the simulation execution times are drawn, so order and percentiles are compared, not single instants.
SPDX-License-Identifier: Apache-2.0
"""
import json
import pathlib
import re
import subprocess
import tempfile

DURATION = "30s"
# A run in which a bare loop of sleeps was later than this is none of an undisturbed machine.
MOST_LATE_US = 200
MOST_REPEATS = 5
# What is compared begins then: before, caches are cold and nodes are brought up.
BEGIN_US = 1e6
# What holds: order in at least so many windows; and a percentile within a share, or within so many µs.
GOAL_ORDER = 0.95
GOALS = {"p50": (0.10, 50), "p90": (0.15, 100)}

FIFO = "policy: SCHED_FIFO, priority: {}"


def on_one_thread(executor):
    return f"threads:\n  one: {{{FIFO.format(80)}, affinity: [1]}}\nexecutors:\n  default: {{{executor}, threads: [one]}}\n"


# Name → file, and what it has instead of its own threads and executors; None: Takt plans them.
SYSTEMS = {
    "three_chains, planned": ("bench/workloads/three_chains.yaml", None),
    "reference_system, events": ("bench/workloads/reference_system.yaml", on_one_thread("type: events, scheduler: fixed_priority")),
    "mont_blanc, single_threaded": ("bench/workloads/mont_blanc.yaml", on_one_thread("type: single_threaded")),
    "robot, events and a pool": (
        "examples/03_robot/robot.yaml",
        f"threads:\n  control: {{{FIFO.format(80)}}}\n  planning: {{{FIFO.format(50)}}}\n"
        "executors:\n  fast: {type: events, threads: [control]}\n  slow: {type: multi_threaded, threads: [planning, planning]}\n"),
    "robot, a reservation": (
        "examples/03_robot/robot.yaml",
        f"threads:\n  control: {{policy: SCHED_DEADLINE, runtime: 2ms, period: 5ms}}\n  planning: {{{FIFO.format(50)}}}\n"
        "executors:\n  fast: {type: events, threads: [control]}\n  slow: {type: single_threaded, threads: [planning]}\n"),
    "nav2, a pool": (
        "examples/08_nav2/nav2.yaml",
        f"threads:\n  w: {{{FIFO.format(80)}}}\nexecutors:\n  default: {{type: multi_threaded, threads: [w, w]}}\n"),
}


def file_of(text, own):
    """The file with these threads and executors instead of its own, on this machine's two CPUs, and with chains."""
    parts = re.split(r"^(?=\w)", text, flags=re.MULTILINE)  # a part for each key of the file
    if own is not None:
        parts = [part for part in parts if not part.startswith(("threads:", "executors:"))]
        if "executor: " not in text:  # else Takt would plan from the chains
            parts = [re.sub(r"^( *)- component: .*$", r"\g<0>\n\1  executor: default", part, flags=re.MULTILINE) for part in parts]
        parts.insert(1, own)
    if not any(part.startswith("chains:") for part in parts):
        parts.insert(1, "chains: auto\n")
    return "".join(parts)


def bare_loop(takt, out):
    """A loop around clock_nanosleep on each CPU, for as long as a run: more urgent than all but reservations."""
    return subprocess.Popen([takt, "latency", "-q", "-S", "-p", "99", "-i", "1000", "-D", DURATION, "--executor", "none", "--json", out],
                            stdout=subprocess.DEVNULL)


def run_beside_loop(takt, stem, number):
    """One try of a run, in STEM.NUMBER.json and .trace. Returns how late the loop was at most, in µs."""
    loop_file = stem.with_suffix(".loop")
    loop = bare_loop(takt, loop_file)
    subprocess.run([takt, "run", stem.with_suffix(".yaml"), "--duration", DURATION, "--trace", stem.with_suffix(f".{number}.trace"),
                    "--json", stem.with_suffix(f".{number}.json")], stdout=subprocess.DEVNULL, check=True)
    loop.wait()
    return max(thread["max"] for thread in json.loads(loop_file.read_text(encoding="utf-8"))["thread"].values())


def record(takt, stem):
    """Runs a system at least twice, and until the machine left one run alone. Returns how late the loop was in each."""
    late = []
    while len(late) < 2 or (min(late) > MOST_LATE_US and len(late) <= MOST_REPEATS):
        late.append(run_beside_loop(takt, stem, len(late)))
    return late


# ---- Compare ----

def executions_of(path):
    """(start, end, ready, callback, kind) in µs, by start."""
    events = json.loads(path.read_text(encoding="utf-8"))["traceEvents"]
    slices = [event for event in events if event["ph"] == "X" and event["cat"] != "sched"]
    return sorted((event["ts"], event["ts"] + event["dur"], event["ts"] - event["args"]["latency_us"], event["name"], event["cat"])
                  for event in slices)


def scenario_of(executions):
    """The word of a scenario in which timers are released first when they were in the run."""
    first = {}
    for _, _, ready, callback, kind in executions:
        if kind == "timer":
            first[callback] = min(ready, first.get(callback, ready))
    return ",".join(["1,drawn", *(f"{callback}={round(1000 * ready)}ns" for callback, ready in first.items())])


def windows_of(runs, rows):
    """What runs between two instants at which nothing is ready or runs in any of the runs: for each window, run and row the callbacks by
    start. `rows`: of each callback."""
    merged = sorted((ready, end, run, start, callback) for run, executions in enumerate(runs)
                    for start, end, ready, callback, _ in executions)
    windows, busy_until = [], -1
    for ready, end, run, start, callback in merged:
        if ready > busy_until + 0.001:  # a callback that the one before has released goes on in its span
            windows.append((ready, [{} for _ in runs]))
        windows[-1][1][run].setdefault(rows[callback], []).append((start, callback))
        busy_until = max(busy_until, end)
    return [(begin, [{row: [callback for _, callback in sorted(starts)] for row, starts in of_run.items()} for of_run in of_runs])
            for begin, of_runs in windows]


def share_of_equal(real, other, rows):
    """How many windows, and in how many of them all starts have the same order."""
    end = min(real[-1][0], other[-1][0])
    windows = [of_runs for begin, of_runs in windows_of((real, other), rows) if BEGIN_US <= begin < end]
    return len(windows), sum(one == two for one, two in windows)


def simulate(takt, stem, trace):
    """The chains of a simulation with the model of this run; and its executions."""
    model, simulated = stem.with_suffix(".model.yaml"), stem.with_suffix(".simulated")
    # Both are of one run, so it needs no margin.
    subprocess.run([takt, "model", trace, "-o", model, "--margin", "0"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True)
    done = subprocess.run([takt, "simulate", stem.with_suffix(".yaml"), "--model", model, "--duration", DURATION, "--replay",
                           scenario_of(executions_of(trace)), "--trace", simulated, "--json", "-"],
                          stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=False)
    if done.returncode > 1:  # 1: a deadline was missed
        done.check_returncode()
    return json.loads(done.stdout)["runs"][0]["chains"], executions_of(simulated)


def compare(takt, stem, first, second):
    """A run beside its simulation, and beside another run: stems of files."""
    trace = json.loads(first.with_suffix(".trace").read_text(encoding="utf-8"))
    rows = {callback: name for name, executor in trace["otherData"]["executors"].items() for callback in executor["callbacks"]}
    run = json.loads(first.with_suffix(".json").read_text(encoding="utf-8"))["runs"][0]
    chains, simulated = simulate(takt, stem, first.with_suffix(".trace"))
    executions = executions_of(first.with_suffix(".trace"))
    windows, equal = share_of_equal(executions, simulated, rows)
    other_windows, other_equal = share_of_equal(executions, executions_of(second.with_suffix(".trace")), rows)

    def percentiles(chain):
        return {key: chain["latency_us"][key] for key in ("p50", "p90", "p99")}

    return {"windows": windows, "equal": equal, "second_windows": other_windows, "second_equal": other_equal,
            "chains": [{"name": one["name"], "run": percentiles(one), "simulated": percentiles(other)}
                       for one, other in zip(run["chains"], chains) if one["latency_us"]["count"] and other["latency_us"]["count"]]}


def measure(takt, root):
    """All systems: a document for the page."""
    systems = []
    with tempfile.TemporaryDirectory() as folder:
        for name, (path, own) in SYSTEMS.items():
            stem = pathlib.Path(folder) / re.sub(r"\W+", "_", name)
            stem.with_suffix(".yaml").write_text(file_of((root / path).read_text(encoding="utf-8"), own), encoding="utf-8")
            late = record(takt, stem)
            best = sorted(range(len(late)), key=late.__getitem__)
            first, second = (stem.with_suffix(f".{number}.x") for number in best[:2])
            systems.append({"name": name, "file": path, "late_us": late, **compare(takt, stem, first, second)})
    return {"systems": systems}


# ---- The page ----

def is_within(chain, percentile):
    share, us = GOALS[percentile]
    run, simulated = chain["run"][percentile], chain["simulated"][percentile]
    return abs(run - simulated) <= max(share * run, us)


def percent(part, whole):
    return f"{100 * part / whole:.1f} %" if whole else "-"


def system_row(system):
    chains = system["chains"]
    late = system["late_us"]
    return [system["name"], f"{len(late)}, {min(late) / 1e3:.1f}", system["windows"], percent(system["equal"], system["windows"]),
            percent(system["second_equal"], system["second_windows"]),
            *(f"{sum(is_within(chain, key) for chain in chains)} of {len(chains)}" for key in GOALS)]


def chain_rows(systems):
    for system in systems:
        for chain in system["chains"]:
            yield [system["name"], chain["name"], *(f"{chain['run'][key] / 1e3:.3f}, {chain['simulated'][key] / 1e3:.3f}"
                                                    + ("" if key not in GOALS or is_within(chain, key) else " **off**")
                                                    for key in ("p50", "p90", "p99"))]


def what_follows(document):
    systems = document["systems"]
    chains = [chain for system in systems for chain in system["chains"]]
    ordered = sum(system["equal"] >= GOAL_ORDER * system["windows"] for system in systems)
    return (f"Of {len(chains)} chains, the simulated median is within its aim of the run's for {sum(is_within(chain, 'p50') for chain in chains)}, "
            f"p90 for {sum(is_within(chain, 'p90') for chain in chains)}. In {ordered} of {len(systems)} systems callbacks start in the order of the "
            "run in at least 95 % of its busy spans. So a simulation may stand for a run where percentiles are compared.")


def section(document, table):
    systems = document["systems"]
    return "\n\n".join([
        f"Each system ran for {DURATION.replace('s', ' s')} with real-time threads, as below. `takt model` made a model of its trace, and `takt simulate` ran the same "
        "file with it, with the first releases of the run, and with drawn times. Aims: the median of a chain within 10 % or 50 µs of the run's, "
        "p90 within 15 % or 100 µs; and callbacks of each executor in the same order between two instants at which both were idle, in 95 % "
        "of these spans. "
        "A run beside which a loop of sleeps, more urgent than all but reservations, was late by more than 200 µs is repeated, five times at most; "
        f"the one with the least counts; of {sum(min(system['late_us']) <= MOST_LATE_US for system in systems)} of {len(systems)} systems a run was left alone. "
        "\"Second run\" is the order of that run beside another one: what chance and the host leave to agree on.",
        table(["system", "runs, least lateness (ms)", "spans", "order as simulated", "order of a second run", "p50 within", "p90 within"],
              map(system_row, systems)),
        "## Each chain\n\nIn ms: the run, the simulation.", table(["system", "chain", "p50", "p90", "p99"], chain_rows(systems), keys=2)])
