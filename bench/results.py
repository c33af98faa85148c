#!/usr/bin/python3
"""Measures, and makes the page of docs/results and the README's figures from the data.

usage: results.py measure [PART...]  measures into docs/results/DATE, 40 minutes; nothing else should run
                                     (PART: only these again, of the newest date, while the code is the same;
                                     bounds: into docs/results/bounds, 13 minutes;
                                     threads [PIECE...]: into docs/results/threads, 7 minutes;
                                     robot: into docs/results/robot, 2 minutes;
                                     footprint: into docs/results/footprint, 3 minutes, as root;
                                     literature: into docs/results/literature, 5 minutes;
                                     reality: into docs/results/reality, 7 to 20 minutes, as root;
                                     simulation [CHECK...]: into docs/results/simulation, 2 minutes, or what is checked)
       results.py write              makes docs/results/DATE.md, bounds.md, threads.md and the README's figures from
                                     that data; its picture, too, where that shows other data
       results.py check              exit status 1 if they are not what the data gives

The newest date counts. A file of data is what the command wrote, without the histograms.
SPDX-License-Identifier: Apache-2.0
"""
import datetime
import functools
import json
import os
import pathlib
import re
import statistics
import subprocess
import sys

import bounds
import footprint
import literature
import paper
import reality
import robot
import simulation
import simulation_checks
import threads

ROOT = pathlib.Path(__file__).resolve().parents[1]
# What the figures measure.
MEASURED = ["base", "sched", "messages", "transport", "callback_groups", "entities", "nodes", "ros2", "executors",
            "containers", "components", "measuring", "bench/workloads", "tools/takt/bench", "tools/takt/run",
            "tools/takt/latency", ":!*_test.*", ":!*.md"]
# Experiment → options. What has curves is repeated as in the paper.
EXPERIMENTS = {
    "memory": "--duration 100ms --repeat 10", "latency": "--duration 500ms --repeat 10",
    "goodput": "--duration 200ms --repeat 10", "executors": "--duration 500ms --repeat 10",
    "nav2": "--duration 2s --repeat 3", "create3": "--duration 1s --repeat 3",
    "reference_system": "--duration 3s --repeat 3"}
TIMERS = "latency -p 80 -i 1000 -D 2s --executor all --early-wake 50us -q"
# Part → module, title. A page with data of its own, which is measured alone.
ALONE = {"literature": (literature, "Which executor for which robot"), "reality": (reality, "Simulations beside runs"),
         "simulation": (simulation, "How fast simulations are, and what holds of them")}
DISPATCH = ("dispatch_benchmark --benchmark_filter=^between_threads|/(events|static_single_threaded|single_threaded)/threads:1/"
            "statistics:[a-z]+/nodes --benchmark_repetitions=9 --benchmark_enable_random_interleaving=true "
            "--benchmark_min_time=0.2 --benchmark_display_aggregates_only=true")


# ---- Measure ----

def git(*words):
    return subprocess.run(["git", *words], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout.strip()


def run(program, options, out):
    """Runs it, and reads what it writes; its stdout is the text."""
    done = subprocess.run([ROOT / "build/release/bin" / program, *options.split(), out], cwd=ROOT,
                          stdout=subprocess.PIPE, text=True, check=True)
    path = pathlib.Path(out.partition("=")[2] or out)
    document = json.loads(path.read_text(encoding="utf-8"))
    path.unlink()
    return document, done.stdout


def measure_dispatch(out):
    document, _ = run("dispatch_benchmark", DISPATCH.partition(" ")[2], f"--benchmark_out={out}")
    kept = ("run_name", "run_type", "cpu_time", "time_unit")
    return {"context": {"load_avg": document["context"]["load_avg"]}, "benchmarks": [
        {key: row[key] for key in kept} for row in document["benchmarks"] if row["run_type"] == "iteration"]}


def measure_experiment(name, out):
    document, _ = run("takt", f"bench {name} {EXPERIMENTS[name]} --json", out)
    document["experiments"][0].pop("ratios")
    for row in document["experiments"][0]["rows"]:
        row.pop("latency_buckets_us", None)
    return {"machine": document["machine"], **document["experiments"][0]}


def measure_timers(out):
    document, _ = run("takt", TIMERS + " --json", out)
    kept = ("name", "cycles", "p50_us", "p99_us", "max", "early", "cpu_percent")
    return {"machine": document["machine"], "thread": {
        key: {name: row[name] for name in kept} for key, row in document["thread"].items()}}


def keep_with_report(name, document, drawn):
    """The data in docs/results, and what report.py draws of `drawn` in build/results, as it is not kept."""
    folder, reports = ROOT / "docs/results" / name, ROOT / "build/results"
    folder.mkdir(exist_ok=True)
    reports.mkdir(exist_ok=True)
    subprocess.run(["/usr/bin/python3", ROOT / "bench/report.py", reports / f"{name}.html"], input=json.dumps(drawn),
                   text=True, check=True)
    (folder / f"{name}.json").write_text(rows_on_lines(document) + "\n", encoding="utf-8")


def measure_bounds():
    """The tightness of before stays, as that of the footprint."""
    path = ROOT / "docs/results/bounds/bounds.json"
    before = {"tightness_before": read_json(path).get("tightness_before", {})} if path.exists() else {}
    document = {"date": str(datetime.date.today()), "commit": git("rev-parse", "HEAD"),
                **bounds.measure(ROOT / "build/release/bin/takt", ROOT), **before}
    keep_with_report("bounds", document, document)


def measure_robot():
    kept, drawn = robot.measure(ROOT / "build/release/bin/takt", ROOT, ROOT / "build/release/robot.json")
    keep_with_report("robot", {"date": str(datetime.date.today()), "commit": git("rev-parse", "HEAD"), **kept}, drawn)


def measure_footprint():
    """What was before stays: it is the state with which the page compares."""
    folder = ROOT / "docs/results/footprint"
    path = folder / "footprint.json"
    document = {"date": str(datetime.date.today()), "commit": git("rev-parse", "HEAD"), "machine": about_now()["machine"],
                **footprint.measure(ROOT / "build/release/bin")}
    document["before"] = read_json(path)["before"] if path.exists() else {
        key: document[key] for key in ("commit", "memory_mb", "idle")}
    folder.mkdir(exist_ok=True)
    path.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def measure_alone(part):
    name = part.__name__
    document = {"date": str(datetime.date.today()), "commit": git("rev-parse", "HEAD"),
                **part.measure(ROOT / "build/release/bin/takt", ROOT)}
    document.setdefault("machine", about_now()["machine"])
    path = ROOT / f"docs/results/{name}/{name}.json"
    path.parent.mkdir(exist_ok=True)
    if path.exists() and (checks := read_json(path).get("checks")):
        document["checks"] = checks
    path.write_text(rows_on_lines(document) + "\n", encoding="utf-8")


def measure_checks(names):
    """Beside the speeds of before."""
    path = ROOT / "docs/results/simulation/simulation.json"
    document = read_json(path)
    document["checks"] = document.get("checks", {}) | simulation_checks.measure(names, ROOT, git("rev-parse", "HEAD"))
    path.write_text(rows_on_lines(document) + "\n", encoding="utf-8")


def about_now():
    run_file = str(ROOT / "build/release/threads.json")
    subprocess.run([ROOT / "build/release/bin/takt", "run", ROOT / "examples/03_robot/robot.yaml", "--duration", "100ms",
                    "--json", run_file], stdout=subprocess.DEVNULL, check=True)
    return json.loads(pathlib.Path(run_file).read_text(encoding="utf-8"))


def measure_threads(wanted):
    """All pieces, or only these again, while the code is the same."""
    if not set(wanted) <= set(threads.PIECES):
        sys.exit(f"a piece of threads is one of: {' '.join(threads.PIECES)}")
    document, path = {"commit": git("rev-parse", "HEAD"), "pieces": {}}, ROOT / "docs/results/threads/threads.json"
    if wanted and path.exists():
        document = json.loads(path.read_text(encoding="utf-8"))
        if code_is_newer(ROOT, document["commit"]):
            sys.exit("the code has changed since docs/results/threads: measure all pieces")
    document["pieces"].update(threads.measure(ROOT / "build/release/bin", wanted or threads.PIECES))
    about = about_now()
    document |= {"date": str(datetime.date.today()), "takt": about["takt"], "machine": about["machine"]}
    keep_with_report("threads", document, {**document, "experiments": threads.experiments(document["pieces"])})


def measure(wanted):
    if git("status", "--porcelain", "--", *MEASURED):
        sys.exit("commit first: the page names the commit that it measures")
    parts = {"dispatch": measure_dispatch,
             **{name: functools.partial(measure_experiment, name) for name in EXPERIMENTS}, "timers": measure_timers}
    if wanted == ["bounds"]:
        return measure_bounds()
    if wanted == ["robot"]:
        return measure_robot()
    if wanted == ["footprint"]:
        return measure_footprint()
    if wanted[:1] == ["simulation"] and wanted[1:]:
        return measure_checks(wanted[1:])
    if len(wanted) == 1 and wanted[0] in ALONE:
        return measure_alone(ALONE[wanted[0]][0])
    if wanted[:1] == ["threads"]:
        return measure_threads(wanted[1:])
    if not set(wanted) <= set(parts):
        sys.exit(f"a part is one of: {' '.join(parts)}, or bounds, robot, footprint, threads, {', '.join(ALONE)} alone")
    if wanted:
        date, data = newest(ROOT)
        about = data["about"]
        if code_is_newer(ROOT, about["commit"]):
            sys.exit(f"the code has changed since {date}: measure all parts")
    else:
        date, about = str(datetime.date.today()), {"commit": git("rev-parse", "HEAD"), "load_before": os.getloadavg()[0]}
    folder = ROOT / "docs/results" / date
    folder.mkdir(exist_ok=True)

    def keep(name, document):
        (folder / f"{name}.json").write_text(rows_on_lines(document) + "\n", encoding="utf-8")

    for name in wanted or parts:
        keep(name, parts[name](str(folder / "out.json")))
    if not wanted:
        keep("about", {**about, "load_after": os.getloadavg()[0]})
        measure_robot()
        measure_bounds()
        measure_threads([])


def rows_on_lines(document):
    """JSON with a line for each row: git shows what has changed."""
    text = json.dumps(document, ensure_ascii=False)
    return re.sub(r'\}, ((?:"\w+": )?)\{("metrics"|"missing"|"run_name"|"file"|"name")', r'},\n \1{\2', text)


# ---- What the figures are ----

def number(value):
    return f"{value:.3g}" if value < 100 else f"{value:.0f}"


def shown(metrics, metric):
    if metric not in metrics:
        return "-"
    value = metrics[metric]
    if "sum" in value:
        return f"{value['sum']:.0f}"
    return f"{number(value['median'])} ({number(value['min'])} – {number(value['max'])})"


MOST_COLUMNS = 6  # that a reader can compare


def table(header, rows, keys=1):
    """One table, or several that repeat the first `keys` columns."""
    rows, tables = [list(row) for row in rows], []
    width = MOST_COLUMNS - keys
    for begin in range(keys, len(header), width):
        lines = [line[:keys] + line[begin:begin + width] for line in [list(header), ["---"] * len(header), *rows]]
        tables.append("\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines))
    return "\n\n".join(tables)


def machine_of(machine):
    return f"{machine['cpus']} × {machine['cpu']}, Linux {machine['kernel']}, {machine['preemption']}"


def load_of(document):
    return f"load average {document['machine']['load_average']:.1f}"


def experiment_section(experiment):
    metrics = experiment["metrics"]
    x_label = [experiment["x_label"]] if experiment["x_label"] else []
    rows = [[row["series"], *([f"{row['x']:g}"] if x_label else []),
             *(shown(row["metrics"], metric) for metric in metrics), shown(row["metrics"], "lost")]
            for row in experiment["rows"] if "metrics" in row]
    missing = sorted({f"{row['series']} ({row['missing']})" for row in experiment["rows"] if "missing" in row})
    parts = [f"## {experiment['name']}: {experiment['title']}",
             f"Statistics `{experiment['statistics']}`; medians and ranges of {experiment['repeat']} runs of "
             f"{experiment['duration']} each, which alternate; counts are sums. {load_of(experiment).capitalize()} "
             "at the end."]
    if experiment["deviations"]:
        parts.append("Not as in the original:\n\n" + "\n".join(f"- {text}" for text in experiment["deviations"]))
    parts.append(table(["series", *x_label, *(experiment["labels"][metric] for metric in metrics), "lost"], rows,
                       keys=1 + len(x_label)))
    if missing:
        parts.append("Not measured: " + ", ".join(missing) + ".")
    return "\n\n".join(parts)


def dispatch_table(dispatch):
    """ns of CPU time for each callback: executor and statistics against the number of nodes."""
    values = {}
    for row in dispatch["benchmarks"]:
        name = re.match(r"ping_pong/(\w+)/threads:1/statistics:(\w+)/nodes/(\d+)", row["run_name"])
        key = name.groups() if name else ("", "", "2")
        values.setdefault(key[:2], {}).setdefault(int(key[2]), []).append(row["cpu_time"])
    nodes = sorted({count for of_nodes in values.values() for count in of_nodes})
    rows = []
    for (executor, level), of_nodes in sorted(values.items(), key=lambda each: (each[0][1], each[0][0])):
        name = f"`{executor}`, statistics `{level}`" if executor else "by hand, with all that a message between threads needs"
        rows.append([name, *(f"{statistics.median(of_nodes[count]):.0f} "
                             f"({min(of_nodes[count]):.0f} – {max(of_nodes[count]):.0f})"
                             if count in of_nodes else "" for count in nodes)])
    repetitions = max(len(numbers) for of_nodes in values.values() for numbers in of_nodes.values())
    load = dispatch["context"]["load_avg"][0]
    return (table(["ns per callback", *(f"{count} nodes" for count in nodes)], rows) +
            f"\n\nMedians and ranges of {repetitions} repetitions, which alternate; load average {load:.1f}.")


def timers_section(timers):
    rows = [[row["name"], f"{row['p50_us']:.2f}", f"{row['p99_us']:.2f}", row["max"], row["early"],
             f"{row['cpu_percent']:.2f}"] for _, row in sorted(timers["thread"].items(), key=lambda each: int(each[0]))]
    return (f"## Timers under each executor\n\n`takt {TIMERS}`: SCHED_FIFO 80, 1 kHz; statistics `full`; "
            f"{load_of(timers)} at the end. `clock_nanosleep` is the bare loop.\n\n" +
            table(["row", "p50 (µs)", "p99 (µs)", "max (µs)", "early", "CPU (%)"], rows))


def robot_table(document):
    return (f"{robot.section(document, table, shown)} (Medians and ranges of six runs of 2 s each in turns, each executor of the file "
            f"with its threads; CPU in % of one; {load_of(document)} at the end.)")


# ---- Pages ----

def first_line(commit, is_older):
    commit = commit[:9]
    if is_older:
        return f"**Older than the code**, which has changed since commit {commit}, where this was measured."
    return f"Measured at commit {commit}; what is measured has not changed since."


def what_follows(data, claims):
    """Three sentences for a user."""
    memory = [paper.here(data, "memory", series, "pss_mb", 20) for series in ("manual", "multi_process")]
    latency = [paper.here(data, "latency", series, "latency_us", 1000) for series in ("ipc", "multi_process")]
    verdicts = [row[-1] for row in claims]
    sentences = []
    if None not in memory + latency:
        sentences.append(f"Put nodes that exchange much into one process: 20 empty nodes take {memory[0]:.0f} MB there and "
                         f"{memory[1]:.0f} MB in a process each, and 1 MB arrives after {latency[0]:.0f} µs instead of "
                         f"{latency[1]:.0f} µs.")
    sentences.append("The executor itself costs tens to hundreds of nanoseconds for a callback, so choose it by the latencies and the "
                     "losses under your own load (`takt compare`), not by that.")
    sentences.append(f"Does the paper hold here? Of its {len(verdicts)} claims below: yes {verdicts.count('yes')}, hardly "
                     f"{verdicts.count('hardly')}, no {verdicts.count('no')}.")
    return " ".join(sentences)


def page(date, data, is_older):
    about = data["about"]
    claims = paper.claims(data)
    experiments = [experiment_section(data[name]) for name in EXPERIMENTS]
    return "\n\n".join([
        first_line(about["commit"], is_older),
        f"# Results of {date}",
        what_follows(data, claims),
        f"On {machine_of(data['memory']['machine'])}, a virtual machine that shares its host: compare the rows, the "
        f"maxima depend on the machine. Load average {about['load_before']:.1f} at the start, "
        f"{about['load_after']:.1f} at the end. SCHED_OTHER unless noted. Made by `./dev results` from "
        f"[the data]({date}). [What the figures are](../explanation/figures.md).",
        "## The paper's claims\n\nSteve Macenski et al., *Impact of ROS 2 Node Composition in Robotic Systems* (2023), measured "
        "rclcpp on a Raspberry Pi 4B. Its figures are larger; whether a claim holds is a matter of their ratio.\n\n" +
        table(["claim", "the paper saw", "seen here", "holds"], claims),
        "## CPU time to bring a message to its callback\n\nInside one process, including the publish: two of N nodes "
        "play ping-pong on one thread.\n\n" + dispatch_table(data["dispatch"]),
        *experiments, timers_section(data["timers"])]) + "\n"


def bounds_page(document, is_older):
    return "\n\n".join([
        first_line(document["commit"], is_older), "# Latencies and their bounds", bounds.what_follows(document),
        f"Measured on {document['date']} on {machine_of(document['machine'])}, a virtual machine that shares its host; "
        f"{load_of(document)} at the end. Made by `./dev results bounds` from [the data](bounds/bounds.json).",
        bounds.section(document, table)]) + "\n"


def threads_page(document, is_older):
    return "\n\n".join([
        first_line(document["commit"], is_older), "# Workers, hand-over, nodes and messages between processes",
        threads.what_follows(document["pieces"]),
        f"Measured on {document['date']} on {machine_of(document['machine'])}, a virtual machine that shares its host: "
        "compare the rows. Made by `./dev results threads` from [the data](threads/threads.json).",
        threads.section(document, table)]) + "\n"


def page_alone(name, document, is_older):
    part, title = ALONE[name]
    return "\n\n".join([
        first_line(document["commit"], is_older), f"# {title}", part.what_follows(document),
        f"Measured on {document['date']} on {machine_of(document['machine'])}, a virtual machine that shares its host; "
        f"{load_of(document)}. Made by `./dev results {name}` from [the data]({name}/{name}.json).",
        part.section(document, table)]) + "\n"


def footprint_page(document, is_older):
    return "\n\n".join([
        first_line(document["commit"], is_older), "# Memory of processes and nodes, and what an idle process costs",
        footprint.what_follows(document),
        f"Measured on {document['date']} on {machine_of(document['machine'])}, a virtual machine that shares its host; before: at commit "
        f"{document['before']['commit'][:9]}. Made by `./dev results footprint` from "
        "[the data](footprint/footprint.json).",
        footprint.section(document, table)]) + "\n"


def with_figures(readme, root):
    """The README with its figures between their marks."""
    date, data = newest(root)
    measured = read_robot(root)

    def at(date, commit, machine):
        return f"Measured on {date} at commit {commit[:9]} on {machine_of(machine)} (virtual, shared)"

    robot_at = at(measured["date"], measured["commit"], measured["machine"])
    dispatch_at = at(date, data["about"]["commit"], data["memory"]["machine"])
    for name, text in (("robot", f"{robot_table(measured)}\n{robot_at}."),
                       ("dispatch", f"{dispatch_table(data['dispatch'])} {dispatch_at}: [all results](docs/results/{date}.md).")):
        readme, count = re.subn(rf"(<!-- figures: {name} -->\n).*?(<!-- end -->)",
                                lambda marks, text=text: f"{marks[1]}{text}\n{marks[2]}", readme, flags=re.DOTALL)
        if count != 1:
            sys.exit(f"README.md: write '<!-- figures: {name} -->' and '<!-- end -->' where they belong, once")
    return readme


def read_json(path):
    return json.loads(path.read_text(encoding="utf-8"))


def read_robot(root):
    return read_json(root / "docs/results/robot/robot.json")


def read_reference(root):
    return read_json(root / "docs/results/reference_system/reference_system.json")


def newest(root):
    dates = sorted(path.parent.name for path in (root / "docs/results").glob("*/about.json"))
    if not dates:
        sys.exit("docs/results: no data: bench/results.py measure")
    folder = root / "docs/results" / dates[-1]
    return dates[-1], {path.stem: read_json(path) for path in folder.glob("*.json")}


def code_is_newer(root, commit):
    """None where git does not know the commit, as in a shallow clone."""
    done = subprocess.run(["git", "diff", "--quiet", commit, "--", *MEASURED], cwd=root, stderr=subprocess.DEVNULL)
    return bool(done.returncode) if done.returncode in (0, 1) else None


def pages(root):
    """Each page: its path, the commit that it measures, and its text as a function of whether the code is newer."""
    date, data = newest(root)
    yield root / f"docs/results/{date}.md", data["about"]["commit"], functools.partial(page, date, data)
    for name, page_of in (("bounds", bounds_page), ("threads", threads_page), ("footprint", footprint_page),
                          *((name, functools.partial(page_alone, name)) for name in ALONE)):
        path = root / f"docs/results/{name}/{name}.json"
        if path.exists():
            document = json.loads(path.read_text(encoding="utf-8"))
            yield root / f"docs/results/{name}.md", document["commit"], functools.partial(page_of, document)


def write(root):
    for path, commit, text in pages(root):
        path.write_text(text(bool(code_is_newer(root, commit))), encoding="utf-8")
    readme = root / "README.md"
    readme.write_text(with_figures(readme.read_text(encoding="utf-8"), root), encoding="utf-8")
    if robot.stale_pictures(root, read_robot(root), read_reference(root)):
        robot.write_pictures(root, read_robot(root), read_reference(root))


def check(root):
    """A page that does not yet say that it is older is no error, as the commit that changes the code cannot measure."""
    wrong, older = [], []
    for path, commit, text in pages(root):
        present = path.read_text(encoding="utf-8") if path.exists() else ""
        if present not in (text(False), text(True)):
            wrong.append(path)
        elif present == text(False) and code_is_newer(root, commit):
            older.append(path)
    readme = (root / "README.md").read_text(encoding="utf-8")
    if readme != with_figures(readme, root):
        wrong.append(root / "README.md")
    wrong += robot.stale_pictures(root, read_robot(root), read_reference(root))
    for path in wrong:
        print(f"{path.relative_to(root)}:1: not what the data of docs/results gives: bench/results.py write")
    for path in older if not wrong else []:
        print(f"note: {path.relative_to(root)} is older than the code; let it say so: bench/results.py write")
    return not wrong


def main():
    if sys.argv[1:2] == ["measure"]:
        measure(sys.argv[2:])
        write(ROOT)
    elif sys.argv[1:] == ["write"]:
        write(ROOT)
    elif sys.argv[1:] == ["check"]:
        sys.exit(0 if check(ROOT) else 1)
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main()
