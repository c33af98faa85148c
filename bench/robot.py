"""The robot of the demo under each executor, a part of results.py: the README's picture and table.

The picture has the latencies of the robot's messages, and beside them how regular the planner of the Autoware reference
system is: an unchanged program for rclcpp, on rclcpp itself and on Takt (docs/results/reference_system).
SPDX-License-Identifier: Apache-2.0
"""
import hashlib
import json
import re
import statistics
import subprocess

FILE = "examples/03_robot/robot.yaml"
COMMAND = f"compare {FILE} --executors all --duration 2s --repeat 6"
COLOURS = {"light": "#222222", "dark": "#dddddd"}  # of text


def measure(takt, root, out):
    """The data that is kept, and the document that report.py draws."""
    subprocess.run([takt, *COMMAND.split(), "--json", out], cwd=root, stdout=subprocess.DEVNULL, check=True)
    document = json.loads(out.read_text(encoding="utf-8"))
    import report  # noqa: E402  (it needs matplotlib, which only measuring needs)
    rows = []
    for name in dict.fromkeys(run["executor"] for run in document["runs"]):
        runs = [run for run in document["runs"] if run["executor"] == name]
        messages = [report.buckets_of([run], "callbacks", lambda row: row["kind"] != "timer") for run in runs]
        values = {"p50_us": [report.quantile(buckets, .5) for buckets in messages],
                  "p99_us": [report.quantile(buckets, .99) for buckets in messages],
                  "cpu_percent": [sum(process["cpu_percent"] for process in run["processes"]) for run in runs]}
        buckets = report.buckets_of(runs, "callbacks", lambda row: row["kind"] != "timer")
        rows.append({"name": name, "buckets": [[round(us, 3), count] for us, count in buckets],
                     "metrics": {metric: {"median": statistics.median(of_runs), "min": min(of_runs), "max": max(of_runs)}
                                 for metric, of_runs in values.items()}})
    return {"machine": document["machine"], "rows": rows}, document


# ---- The table ----

def what_follows(rows):
    """One sentence for a user."""
    def median(row, metric):
        return row["metrics"][metric]["median"]

    first, last = (pick(rows, key=lambda row: median(row, "p99_us")) for pick in (min, max))
    cpu = [median(row, "cpu_percent") for row in rows]
    return (f"So the word decides: of a hundred messages 99 arrive within {median(first, 'p99_us') / 1e3:.1f} ms under `{first['name']}`, "
            f"within {median(last, 'p99_us') / 1e3:.1f} ms under `{last['name']}`, for {min(cpu):.1f} to {max(cpu):.1f} % of a CPU.")


def section(document, table, shown):
    rows = [[f"`{row['name']}`", *(shown(row["metrics"], metric) for metric in ("p50_us", "p99_us", "cpu_percent"))]
            for row in document["rows"]]
    return table(["executor", "median (µs)", "p99 (µs)", "CPU (%)"], rows) + "\n\n" + what_follows(document["rows"])


# ---- The picture ----

def names_of(root):
    return [root / f"docs/results/robot/robot_{shade}.svg" for shade in COLOURS]


def mark(robot, reference):
    """Of the data that a picture shows."""
    digest = hashlib.sha256(json.dumps([robot, reference], sort_keys=True).encode()).hexdigest()
    return f"<!-- data {digest} -->"


def jitter_rows(reference):
    """Name and deviation from its period in ms of the planner: rclcpp's executors, Takt's, and Takt with a file."""
    by_name = {}
    for row in reference["executors"]:
        if row["program"] == "autoware_default_singlethreaded":
            by_name.setdefault(row["label"], []).append(row["planner_period_ms"][3])
    return ([(f"rclcpp: {row['label']}", row["planner_deviation_ms"]) for row in reference["rclcpp"]] +
            [("Takt, with threads by a file" if name == "with" else f"Takt: {name}", statistics.median(values))
             for name, values in by_name.items()])


def draw(robot, reference, shade):
    import report_page as page  # noqa: E402  (see above)
    figure, (left, right) = page.plt.subplots(1, 2, figsize=(11, 4.2), width_ratios=(1.15, 1))
    page.draw_percentiles(left, [(row["name"], row["buckets"]) for row in robot["rows"]])
    left.set_title("A robot of ten nodes: publish → callback", fontsize=10)
    rows = jitter_rows(reference)
    places = range(len(rows))
    colours = ["#808080" if name.startswith("rclcpp") else page.COLOURS[0] for name, _ in rows]
    right.barh(places, [value for _, value in rows], color=colours, height=0.6)
    for place, (_, value) in zip(places, rows):
        right.annotate(f" {value:.2g}", (value, place), va="center", fontsize=8)
    right.set_yticks(places, [name for name, _ in rows], fontsize=8)
    right.invert_yaxis()
    right.set_xscale("log")
    page.scale(right.xaxis)
    right.grid(axis="y", visible=False)
    right.set_xlabel("deviation from the period of 100 ms (ms)")
    right.set_title("Autoware's reference system, unchanged: its planner", fontsize=10)
    svg = page.svg_of(figure).replace("var(--text)", COLOURS[shade])
    svg = re.sub(r"(<svg[^>]*>)", rf"\1<style>text {{ fill: {COLOURS[shade]}; font-family: sans-serif }}</style>", svg, count=1)
    return mark(robot, reference) + "\n" + svg


def write_pictures(root, robot, reference):
    for path, shade in zip(names_of(root), COLOURS):
        path.write_text(draw(robot, reference, shade), encoding="utf-8")


def stale_pictures(root, robot, reference):
    """Those that do not show this data."""
    return [path for path in names_of(root)
            if not path.exists() or not path.read_text(encoding="utf-8").startswith(mark(robot, reference))]
