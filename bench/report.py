#!/usr/bin/python3
"""Draws one self-contained HTML page from a result document of takt bench, compare or analyze.

usage: report.py OUT.html < results.json

Every figure is an SVG with its text as text, the number of samples, and the machine's block.
SPDX-License-Identifier: Apache-2.0
"""
import html
import io
import json
import re
import sys

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt  # noqa: E402  (the backend comes first)

plt.rcParams.update({
    "svg.fonttype": "none", "font.size": 10, "font.family": "sans-serif", "axes.grid": True,
    "grid.alpha": 0.3, "axes.spines.top": False, "axes.spines.right": False,
    "legend.frameon": False, "figure.figsize": (7.2, 4.2), "svg.hashsalt": "takt"})

COLOURS = ["#3566a8", "#d0632b", "#3c8a4e", "#a83c6b", "#7a5cc0", "#8a6d3b", "#2b9aa0", "#555555"]
# What the paper measured, too: experiment, metric → (x values, series, factor to our unit).
PAPER = {
    ("memory", "pss_mb"): ("ram_pss_mb_vs_nodes", "nodes", None, 1),
    ("latency", "latency_us"): ("pub_sub_50hz", "size_kb", "latency_ms", 1000),
    ("latency", "cpu_percent"): ("pub_sub_50hz", "size_kb", "cpu_pct", 1),
    ("goodput", "goodput_mb_s"): ("goodput_mb_s", "size_kb", None, 1),
    ("executors", "latency_us"): ("containers_500kb_50hz_500us_work", "subs", "latency_ms", 1000),
    ("executors", "cpu_percent"): ("containers_500kb_50hz_500us_work", "subs", "cpu_pct", 1)}
# Experiment, series that the paper measured in another way: it limited the rate.
ANOTHER_WAY = {("goodput", "multi_process_loaned")}


class Page:
    """Collects figures and tables, each with what it says about its data."""

    def __init__(self, document):
        machine = document["machine"]
        self.machine = (f"{machine['cpus']} × {machine['cpu']}, Linux {machine['kernel']}, "
                        f"{machine.get('preemption', '')}, load average "
                        f"{machine['load_average']:.2f}, takt {document['takt']['version']}")
        self.parts = []
        self.count = 0

    def heading(self, text):
        self.parts.append(f"<h2>{html.escape(text)}</h2>")

    def figure(self, figure, caption):
        self.count += 1
        text = io.StringIO()
        figure.tight_layout()
        figure.savefig(text, format="svg")
        plt.close(figure)
        svg = text.getvalue()
        svg = svg[svg.index("<svg"):]
        # Several pictures share the page, but their ids must not.
        svg = re.sub(r'id="([^"]+)"', rf'id="f{self.count}_\1"', svg)
        svg = re.sub(r'url\(#([^)]+)\)', rf'url(#f{self.count}_\1)', svg)
        svg = re.sub(r'href="#([^"]+)"', rf'href="#f{self.count}_\1"', svg)
        self.parts.append(
            f"<figure>{svg}<figcaption><b>Figure {self.count}.</b> {html.escape(caption)} "
            f'<span class="machine">{html.escape(self.machine)}</span></figcaption></figure>')

    def table(self, header, rows):
        cells = "".join(f"<th>{html.escape(name)}</th>" for name in header)
        lines = [f"<tr>{cells}</tr>"]
        for row in rows:
            cells = "".join(f"<td>{html.escape(str(cell))}</td>" for cell in row)
            lines.append(f"<tr>{cells}</tr>")
        self.parts.append("<table>" + "\n".join(lines) + "</table>")

    def note(self, text):
        self.parts.append(f'<p class="note">{html.escape(text)}</p>')

    def write(self, path, title):
        with open(path, "w", encoding="utf-8") as file:
            file.write(
                "<!doctype html><html lang=en><head><meta charset=utf-8>"
                f"<title>{html.escape(title)}</title><link rel=icon href=data:,><style>"
                "body{font:15px/1.5 system-ui,sans-serif;max-width:1500px;margin:2em auto;"
                "padding:0 1em;color:#222}figure{display:inline-block;margin:0 1.5em 2em 0;"
                "vertical-align:top;width:700px}figure svg{width:100%;height:auto}"
                "figcaption{font-size:13px}.machine,.note{color:#666;font-size:12px}"
                "table{border-collapse:collapse;margin:1em 0;font-size:13px}"
                "td,th{padding:3px 10px;text-align:right;border-bottom:1px solid #ddd}"
                "td:first-child,th:first-child{text-align:left}"
                f"</style></head><body><h1>{html.escape(title)}</h1>"
                f'<p class="machine">{html.escape(self.machine)}</p>'
                + "\n".join(self.parts) + "</body></html>\n")


def quantile(buckets, fraction):
    """Of [value, count] pairs in order of value."""
    total = sum(count for _, count in buckets)
    seen = 0
    for value, count in buckets:
        seen += count
        if seen >= fraction * total:
            return value
    return 0


def percentile_curves(page, named_buckets, caption):
    """Latency against the percentile, the axis stretched towards 100 % (as HdrHistogram draws)."""
    figure, axes = plt.subplots()
    samples = 0
    for colour, (name, buckets) in zip(COLOURS * 9, named_buckets):
        total = sum(count for _, count in buckets)
        if total == 0:
            continue
        samples += total
        xs, ys, seen = [], [], 0
        for value, count in buckets:
            seen += count
            xs.append(total / max(total - seen, 0.5))
            ys.append(max(value, 0.01))
        axes.plot(xs, ys, label=f"{name} (n={total})", color=colour, drawstyle="steps-pre")
    ticks = [1, 2, 10, 100, 1000, 10000, 100000]
    names = ["0", "50", "90", "99", "99.9", "99.99", "99.999"]
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xticks(ticks, names)
    axes.minorticks_off()
    axes.set_xlim(1, None)
    axes.set_xlabel("percentile (%)")
    axes.set_ylabel("latency (µs)")
    axes.legend(fontsize=8)
    page.figure(figure, f"{caption} n = {samples} samples.")


def boxes(page, named_buckets, caption):
    """p25 to p75 with the median, whiskers from p1 to p99, the maximum as a point."""
    figure, axes = plt.subplots()
    statistics, samples = [], 0
    for name, buckets in named_buckets:
        total = sum(count for _, count in buckets)
        if total == 0:
            continue
        samples += total
        statistics.append({
            "label": f"{name}\nn={total}", "med": quantile(buckets, .5),
            "q1": quantile(buckets, .25), "q3": quantile(buckets, .75),
            "whislo": quantile(buckets, .01), "whishi": quantile(buckets, .99),
            "fliers": [buckets[-1][0]]})
    axes.bxp(statistics, vert=False, patch_artist=True, boxprops={"facecolor": "#c9d8ec"},
             medianprops={"color": "#d0632b"}, flierprops={"markersize": 4})
    axes.set_xscale("log")
    axes.set_xlabel("latency (µs)")
    axes.plot([], [], color="#d0632b", label="median; box p25–p75, whiskers p1–p99, point: maximum")
    axes.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, 1.12))
    page.figure(figure, f"{caption} n = {samples} samples.")


def centre(value):
    """What is counted over all runs, or the median of all else."""
    return value["sum"] if "sum" in value else value["median"]


def ends(value):
    """The range of the runs; a sum has none."""
    return value.get("min", centre(value)), value.get("max", centre(value))


def distances(values):
    """From the centre to both ends, for error bars."""
    return [[centre(value) - ends(value)[0] for value in values],
            [ends(value)[1] - centre(value) for value in values]]


def shown(value):
    if "sum" in value:
        return f"{value['sum']:g} in all"
    return f"{value['median']:.4g} ({value['min']:.4g} – {value['max']:.4g})"


def curves(page, experiment, metric, paper):
    """One metric against x: ours with the spread of its runs, the paper's dashed."""
    figure, axes = plt.subplots()
    series = {}
    for row in experiment["rows"]:
        if "metrics" in row and metric in row["metrics"]:
            series.setdefault(row["series"], []).append(row)
    for colour, (name, rows) in zip(COLOURS * 9, series.items()):
        values = [row["metrics"][metric] for row in rows]
        axes.errorbar([row["x"] for row in rows], [centre(value) for value in values],
                      yerr=distances(values), marker="o", markersize=4, capsize=3, color=colour,
                      label=name)
    source = PAPER.get((experiment["name"], metric))
    if paper and source:
        table, x_key, key, factor = source
        data = paper[table] if key is None else paper[table][key]
        names = [name for name in data if isinstance(data[name], list) and name != x_key
                 and name in series and (experiment["name"], name) not in ANOTHER_WAY]
        for name in names:
            points = [(x, y * factor) for x, y in zip(paper[table][x_key], data[name])
                      if y is not None]
            colour = COLOURS[list(series).index(name) % len(COLOURS)]
            axes.plot(*zip(*points), "--", marker="x", markersize=4, color=colour, alpha=0.6,
                      label=f"{name}, paper (Raspberry Pi 4B)")
    if "size" in experiment["x_label"]:
        axes.set_xscale("log")
    positive = [centre(row["metrics"][metric]) for rows in series.values() for row in rows]
    if positive and min(positive) > 0 and max(positive) / min(positive) > 30:
        axes.set_yscale("log")
    axes.set_xlabel(experiment["x_label"])
    axes.set_ylabel(experiment["labels"][metric])
    axes.legend(fontsize=7)
    page.figure(figure, f"{experiment['title']}: {experiment['labels'][metric]}. Medians and range "
                        f"of n = {experiment['repeat']} runs of {experiment['duration']} each.")


def bars(page, experiment, metric):
    """One metric as a bar for each row, with the spread of its runs."""
    rows = [row for row in experiment["rows"] if metric in row.get("metrics", {})]
    if not rows:
        return
    figure, axes = plt.subplots(figsize=(7.2, 1.2 + 0.35 * len(rows)))
    values = [row["metrics"][metric] for row in rows]
    axes.barh([row["series"] for row in rows], [centre(value) for value in values],
              xerr=distances(values), color="#3566a8", capsize=3,
              label=f"{'sum' if 'sum' in values[0] else 'median and range'} of "
                    f"{experiment['repeat']} runs")
    axes.invert_yaxis()
    axes.set_xlabel(experiment["labels"][metric])
    axes.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, 1.25))
    page.figure(figure, f"{experiment['title']}: {experiment['labels'][metric]}. "
                        f"n = {experiment['repeat']} runs of {experiment['duration']} each.")


def draw_experiment(page, experiment, paper):
    page.heading(f"{experiment['name']}: {experiment['title']}")
    for metric in experiment["metrics"]:
        if experiment["x_label"]:
            curves(page, experiment, metric, paper)
        else:
            bars(page, experiment, metric)
    rows = [row for row in experiment["rows"] if row.get("latency_buckets_us")]
    if experiment["x_label"] and rows:  # the last point, where the series differ most
        most = max(row["x"] for row in rows)
        rows = [row for row in rows if row["x"] == most]
        where = f"at {most:g} {experiment['x_label']}"
    else:
        where = ""
    named = [(row["series"], row["latency_buckets_us"]) for row in rows]
    if named and experiment["name"] not in ("memory", "goodput"):
        percentile_curves(page, named, f"{experiment['title']}: publish → callback {where}.")
        boxes(page, named, f"{experiment['title']}: publish → callback {where}.")
    metrics = experiment["metrics"]
    lost = ["lost"] if any("lost" in row.get("metrics", {}) for row in experiment["rows"]) else []
    page.note(f"Statistics: {experiment['statistics']}.")
    for deviation in experiment["deviations"]:
        page.note(f"Not as in the original: {deviation}")
    page.table(["series"] + ([experiment["x_label"]] if experiment["x_label"] else []) +
               [experiment["labels"][metric] for metric in metrics] + lost,
               [[row["series"]] + ([f"{row['x']:g}"] if "x" in row else []) +
                [shown(row["metrics"][m]) if m in row["metrics"] else "-" for m in metrics] +
                [f"{row['metrics'][metric]['sum']:g}" for metric in lost]
                for row in experiment["rows"] if "metrics" in row])
    for series, why in sorted({(row["series"], row["missing"])
                               for row in experiment["rows"] if "missing" in row}):
        page.note(f"{series}: not measured, {why}.")


def bucket_limit_us(bucket):
    """The upper limit of a bucket of base/histogram.hpp."""
    sub = 32
    if bucket < sub:
        return bucket / 1e3
    shift = bucket // sub - 1
    return (((bucket % sub + sub + 1) << shift) - 1) / 1e3


def draw_runs(page, runs):
    """What takt compare has run: a curve and a box for each executor."""
    files = []
    for run in runs:
        if run["file"] not in files:
            files.append(run["file"])
    for file in files:
        page.heading(file)
        groups = {}
        for run in runs:
            if run["file"] != file:
                continue
            name = run["executor"]
            name += f", {run['scheduler']}" if run["scheduler"] != "file" else ""
            name += f", {run['composition']}" if run["composition"] != "file" else ""
            group = groups.setdefault(
                name, {"buckets": {}, "cpu": [], "received": 0, "lost": 0, "dropped": 0})
            group["cpu"].append(sum(process["cpu_percent"] for process in run["processes"]))
            for callback in run["callbacks"]:
                if callback["kind"] == "timer":
                    continue
                for key in ("received", "lost", "dropped"):
                    group[key] += callback[key]
                for bucket, count in callback["latency_us"].get("histogram", []):
                    limit = bucket_limit_us(bucket)
                    group["buckets"][limit] = group["buckets"].get(limit, 0) + count
        named = [(name, sorted(group["buckets"].items())) for name, group in groups.items()]
        named = [(name, buckets) for name, buckets in named if buckets]
        if named:
            percentile_curves(page, named, "Subscriptions: publish → callback.")
            boxes(page, named, "Subscriptions: publish → callback.")
        page.table(["executor", "received", "lost", "dropped", "p50 (µs)", "p99 (µs)", "CPU (%)"],
                   [[name, groups[name]["received"], groups[name]["lost"],
                     groups[name]["dropped"], f"{quantile(buckets, .5):.4g}",
                     f"{quantile(buckets, .99):.4g}",
                     f"{sorted(groups[name]['cpu'])[len(groups[name]['cpu']) // 2]:.2f}"]
                    for name, buckets in named])


def draw_jitter(page, jitter):
    """The histogram as OSADL draws it: linear x, logarithmic y, the maximum in the legend."""
    page.heading("jitter: timers under each executor beside the bare clock_nanosleep loop")
    rows = list(jitter["thread"].values())
    figure, axes = plt.subplots()
    far = max(quantile(sorted((int(k), v) for k, v in row["histogram"].items()), .999)
              for row in rows if row["histogram"])
    for colour, row in zip(COLOURS * 9, rows):
        points = sorted((int(key), count) for key, count in row["histogram"].items())
        points = [point for point in points if point[0] <= far]
        axes.step([x for x, _ in points], [y for _, y in points], where="mid", color=colour,
                  label=f"{row['name']} (n={row['cycles']}, max {row['max']} µs)", linewidth=1)
    axes.set_yscale("log")
    axes.set_xlabel("latency (µs)")
    axes.set_ylabel("cycles per 1 µs")
    axes.legend(fontsize=7)
    samples = sum(row["cycles"] for row in rows)
    asked = rows[0]["in_force"]
    page.figure(figure, f"Wake-up latency of a periodic timer, {asked['policy']} "
                        f"{asked['priority']}, up to p99.9; n = {samples} cycles.")
    named = [(row["name"], sorted((int(k) + 1, v) for k, v in row["histogram"].items()))
             for row in rows]
    percentile_curves(page, named, "The same as percentiles (resolution 1 µs).")
    page.table(["row", "cycles", "p50 (µs)", "p99 (µs)", "max (µs)", "early", "CPU (%)"],
               [[row["name"], row["cycles"], f"{row['p50_us']:.2f}", f"{row['p99_us']:.2f}",
                 row["max"], row["early"], f"{row['cpu_percent']:.2f}"] for row in rows])


def draw_timeline(page, timeline):
    """Callbacks on their threads, over a short span from the middle of the trace."""
    events = timeline["traceEvents"]
    names = {(event["pid"], event["tid"]): event["args"]["name"] for event in events
             if event["ph"] == "M" and event["name"] == "thread_name"}
    slices = [event for event in events if event["ph"] == "X"]
    if not slices:
        return
    page.heading("timeline: callbacks on their threads")
    times = sorted(event["ts"] for event in slices)
    begin = times[len(times) // 2]
    end = begin + 40_000
    shown = [event for event in slices if begin <= event["ts"] < end]
    threads = sorted({(event["pid"], event["tid"]) for event in shown})
    callbacks = sorted({event["name"] for event in shown})
    figure, axes = plt.subplots(figsize=(7.2, 1.8 + 0.4 * len(threads)))
    for index, name in enumerate(callbacks):
        first = True
        for row, thread in enumerate(threads):
            spans = [((event["ts"] - begin) / 1e3, max(event["dur"], 20) / 1e3) for event in shown
                     if event["name"] == name and (event["pid"], event["tid"]) == thread]
            if spans:
                axes.broken_barh(spans, (row - 0.35, 0.7), facecolors=COLOURS[index % 8],
                                 label=name if first and index < 12 else None)
                first = False
    axes.set_yticks(range(len(threads)), [names.get(thread, str(thread)) for thread in threads])
    axes.set_xlabel("time (ms)")
    axes.set_ylabel("thread")
    axes.legend(fontsize=7, ncol=3, loc="upper center", bbox_to_anchor=(0.5, -0.25))
    page.figure(figure, f"Executions in 40 ms, from takt run --trace; n = {len(shown)} callbacks.")


def draw_analysis(page, analysis):
    """A row for each chain: how late it was, how late it can be, and how late it may be."""
    page.heading(analysis["file"] + (f", {analysis['variant']}" if "variant" in analysis else ""))
    chains = analysis["chains"]
    figure, axes = plt.subplots(figsize=(7.2, 1.6 + 0.5 * len(chains)))
    labels = {}  # each once in the legend

    def label(text):
        return None if text in labels else labels.setdefault(text, text)

    for row, chain in enumerate(chains):
        bound, observed = chain["bound_us"], chain["observed_us"]
        if bound is not None:
            axes.barh(row, bound / 1e3, 0.6, color="#c9d8ec", label=label("bound: never later"))
            waits = sum(segment["wait_us"] or 0 for segment in chain["segments"])
            if waits:
                axes.barh(row, waits / 1e3, 0.6, (bound - waits) / 1e3, color="#c9d8ec", edgecolor="white", hatch="//",
                          label=label("of it, waiting for other inputs"))
        if observed is not None:
            axes.barh(row, observed["p999"] / 1e3, 0.3, color="#3566a8", label=label("observed, p99.9"))
            axes.plot(observed["max"] / 1e3, row, "|", color="#222222", markersize=12, label=label("observed, maximum"))
        if chain["deadline_us"] is not None:
            axes.plot([chain["deadline_us"] / 1e3] * 2, [row - 0.4, row + 0.4], color="#d0632b", linewidth=2,
                      label=label("deadline"))
    names = [chain["name"] + ("\n(no bound)" if chain["bound_us"] is None else "") for chain in chains]
    axes.set_yticks(range(len(chains)), names)
    axes.set_ylim(len(chains) - 0.4, -0.6)
    axes.set_xlim(0, None)
    axes.set_xlabel("latency, release of the first callback → end of the last one (ms)")
    axes.legend(fontsize=8, ncol=4, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    samples = sum(chain["observed_us"]["instances"] for chain in chains if chain["observed_us"] is not None)
    page.figure(figure, "Each chain: observed, bound, and deadline. " +
                (f"n = {samples} observed instances." if samples else "Nothing was observed: analyse with --model."))

    def ms(us):
        return "-" if us is None else f"{us / 1e3:.3f}"

    page.table(["chain", "deadline (ms)", "observed p99.9 (ms)", "observed max (ms)", "bound (ms)", "verdict"],
               [[chain["name"], ms(chain["deadline_us"]), ms((chain["observed_us"] or {}).get("p999")),
                 ms((chain["observed_us"] or {}).get("max")), ms(chain["bound_us"]), chain["verdict"]]
                for chain in chains])
    for chain in chains:
        if chain["reason"] is not None:
            page.note(f"{chain['name']} has no bound: {chain['reason']}.")
    for number, assumption in enumerate(analysis["assumptions"], 1):
        page.note(f"Assumption {number}: {assumption}.")


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    document = json.load(sys.stdin)
    page = Page(document)
    for experiment in document.get("experiments", []):
        draw_experiment(page, experiment, document.get("paper"))
    if "jitter" in document:
        draw_jitter(page, document["jitter"])
    if "timeline" in document:
        draw_timeline(page, document["timeline"])
    if document.get("runs"):
        draw_runs(page, document["runs"])
    for analysis in document.get("analyses", []):
        draw_analysis(page, analysis)
    page.write(sys.argv[1], "takt bench" if "experiments" in document else
               "takt analyze" if "analyses" in document else "takt compare")


if __name__ == "__main__":
    main()
