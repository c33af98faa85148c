#!/usr/bin/python3
"""Draws one self-contained HTML page from a result document of takt bench, compare or analyze; or a figure of takt compare's.

usage: report.py OUT.html|OUT.pdf < results.json

Every figure is an SVG with its text as text and the number of samples. The page is one file, for a light or a dark
screen and for print.
SPDX-License-Identifier: Apache-2.0
"""
import json
import os
import sys

from report_figure import draw_figure
from report_page import (COLOURS, Page, boxes, buckets_of, by_file, distribution_curves, legend_of, lines, median, number, over_time,
                         percentile_curves, plt, quantile, row_name, scale)

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
        return f"{number(value['sum'])} in all"
    return f"{number(value['median'])} ({number(value['min'])} – {number(value['max'])})"


def curves(page, experiment, metric, paper):
    """One metric against x: ours with the spread of its runs, the paper's dashed."""
    figure, axes = plt.subplots()
    series = {}
    for row in experiment["rows"]:
        if "metrics" in row and metric in row["metrics"]:
            series.setdefault(row["series"], []).append(row)
    for line, (name, rows) in zip(lines(), series.items()):
        values = [row["metrics"][metric] for row in rows]
        axes.errorbar([row["x"] for row in rows], [centre(value) for value in values],
                      yerr=distances(values), marker="o", markersize=4, capsize=3, label=name, **line)
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
        scale(axes.xaxis)
    positive = [centre(row["metrics"][metric]) for rows in series.values() for row in rows]
    if positive and min(positive) > 0 and max(positive) / min(positive) > 30:
        axes.set_yscale("log")
        scale(axes.yaxis)
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
              xerr=distances(values), color=COLOURS[0], ecolor="#808080", capsize=3,
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
               [[row["series"]] + ([row["x"]] if "x" in row else []) +
                [shown(row["metrics"][m]) if m in row["metrics"] else "-" for m in metrics] +
                [row["metrics"][metric]["sum"] for metric in lost]
                for row in experiment["rows"] if "metrics" in row])
    for series, why in sorted({(row["series"], row["missing"])
                               for row in experiment["rows"] if "missing" in row}):
        page.note(f"{series}: not measured, {why}.")


def percentiles(buckets):
    """As far as the number of samples carries."""
    n = sum(count for _, count in buckets)
    return [quantile(buckets, share) if n * (1 - share) >= 0.999 else "-" for share in (.5, .9, .99, .999)] + [
        buckets[-1][0] if buckets else "-"]


LATENCY = ["p50 (µs)", "p90 (µs)", "p99 (µs)", "p99.9 (µs)", "max (µs)"]


def median_of(values):
    values = [value for value in values if value is not None]
    return median(values) if values else "-"


def sum_of(rows, key):
    """What is not known of any is a dash."""
    known = [row[key] for row in rows if row[key] is not None]
    return sum(known) if known else "-"


def threads_of(run):
    """"2", or "1/2" where an executor's type cannot use all; "-" of an earlier Takt."""
    given = {(row["process"], row["name"]): row["threads_given"] for row in run.get("executors", [])}
    used = [(thread["process"], thread["executor"]) for thread in run["threads"]]
    run_here = sum(key in given for key in used)
    unused = sum(max(count - used.count(key), 0) for key, count in given.items())
    return "-" if not given else f"{run_here}/{run_here + unused}" if unused else run_here


def draw_summary(page, groups):
    """A row for each executor, in the order and with the columns of the terminal."""
    def is_timer(callback):
        return callback["kind"] == "timer"

    named = [(name, buckets_of(runs, "callbacks", lambda row: not is_timer(row))) for name, runs in groups.items()]
    drawn = [(name, buckets) for name, buckets in named if buckets]
    if drawn:
        for draw in (percentile_curves, distribution_curves, boxes):
            draw(page, drawn, "Subscriptions and services: publish → callback.")
    timed = [(name, [run["over_time"] for run in runs if run.get("over_time")]) for name, runs in groups.items()]
    over_time(page, [each for each in timed if each[1]], "Subscriptions and services: publish → callback.")
    rows, served = [], []
    for name, runs in groups.items():
        callbacks = [callback for run in runs for callback in run["callbacks"]]
        messages = [callback for callback in callbacks if not is_timer(callback)]
        seconds = sum(run["duration_s"] for run in runs)
        received = sum_of(messages, "received")
        rows.append([name, threads_of(runs[0]), seconds, received, received / seconds if messages and seconds else "-"] +
                    [sum_of(messages, key) for key in ("lost", "dropped")] + [sum_of(callbacks, "overruns")] +
                    [sum_of(messages, key) for key in ("late", "too_late", "deadline_misses")] +
                    percentiles(dict(named)[name]) + [percentiles(buckets_of(runs, "callbacks", is_timer))[2]] +
                    [median_of([sum(process["cpu_percent"] for process in run["processes"]) for run in runs]),
                     median_of([sum(thread["wakeups"] for thread in run["threads"]) / run["duration_s"]
                                for run in runs if run["duration_s"]]),
                     median_of([sum(process["pss_kb"] for process in run["processes"]) / 1024 for run in runs])])
        due = sum(run["releases"]["due"] for run in runs)
        if due:
            done = sum(run["releases"]["served"] for run in runs)
            served.append(f"{name} {done * 1000 // due / 10:.1f} % ({done} of {due})")
    page.table(["executor", "threads", "seconds", "received", "received/s", "lost", "dropped", "overruns", "late", "too late",
                "misses"] + LATENCY + ["timer p99 (µs)", "CPU (%)", "wakeups/s", "PSS (MB)"], rows)
    if served:
        page.note("Releases of timers that were served: " + ", ".join(served) + ".")


def draw_chains(page, groups):
    rows = []
    names = list(dict.fromkeys(chain["name"] for runs in groups.values() for run in runs for chain in run["chains"]))
    if names:
        page.heading("Chains", 3)
    for chain in names:
        named = []
        for name, runs in groups.items():
            buckets = buckets_of(runs, "chains", lambda row: row["name"] == chain)
            if buckets:
                named.append((name, buckets))
            mine = [row for run in runs for row in run["chains"] if row["name"] == chain]
            rows.append([chain, name] + [sum_of(mine, key) for key in ("instances", "misses", "aborted")] +
                        [mine[0]["deadline_us"] if mine and mine[0]["deadline_us"] else "-"] + percentiles(buckets))
        percentile_curves(page, named, f"Chain {chain}: release of the first callback → end of the last.")
    if names:
        page.table(["chain", "executor", "instances", "misses", "aborted", "deadline (µs)"] + LATENCY, rows)


def draw_callbacks(page, groups):
    """All that was measured of each callback; of one executor open, of several folded."""
    for name, runs in groups.items():
        callbacks = {}
        for run in runs:
            for callback in run["callbacks"]:
                callbacks.setdefault((callback["node"], callback["callback"], callback["kind"]), []).append(callback)
        rows = []
        for (node, callback, kind), mine in callbacks.items():
            latencies = buckets_of(
                runs, "callbacks", lambda row: (row["node"], row["callback"], row["kind"]) == (node, callback, kind))
            most = [row["execution_us"].get("max") or 0 for row in mine]
            rows.append([node, callback, kind] + [sum_of(mine, key) for key in
                                                  ("received", "lost", "dropped", "overruns", "deadline_misses")] +
                        percentiles(latencies) + [median_of([row["execution_us"].get("p50") for row in mine]),
                                                  max(most) or "-"])
        page.table(["node", "callback", "kind", "received", "lost", "dropped", "overruns", "misses"] + LATENCY +
                   ["execution p50 (µs)", "execution max (µs)"], rows, folded=f"Callbacks under {name}")


def draw_ratios(page, ratios):
    """Which differences between the rows are real, as takt compare says it."""
    def verdict(of):
        if of["verdict"] == "same":
            return f"the same within {100 * (max(of['high'], 1 / of['low']) - 1):.1f} %"
        if of["verdict"] == "open":
            return (f"open: {of['repeats_to_decide']} repeats would decide" if of["repeats_to_decide"]
                    else "open: 1000 repeats would not decide")
        if of["verdict"] == "real":  # of all figures, less is better
            return "better: a real difference" if of["ratio"] < 1 else "worse: a real difference"
        return of["verdict"]

    ratios = [of for of in ratios if of["verdict"] != "none"]
    if not ratios:
        page.note("No verdict: six repeats are the least that tell a difference from chance.")
        return
    page.table(["executor", "of", "figure", "ratio", "95 % interval", "verdict", "repeats", "seconds", "n"],
               [[row_name(of), of["against"], of["figure"], of["ratio"], f"{number(of['low'])} to {number(of['high'])}",
                 verdict(of), of["repeats"] if of["is_paired"] else f"{of['repeats']} of {of['against_repeats']}",
                 of["duration_s"], "-" if of["samples"] is None else of["samples"]] for of in ratios])
    if not all(of["is_paired"] for of in ratios):
        page.note("The other runs were stored: they and these did not take turns, so how the machine changed in between "
                  "is in these ratios.")


def draw_runs(page, document):
    """What takt compare has run."""
    runs, ratios = document["runs"], document.get("ratios", [])
    for file, groups in by_file(runs).items():
        repeats = max(len(group) for group in groups.values())
        page.heading(f"{file}: {repeats} {'run' if repeats == 1 else 'runs'} each, interleaved")
        draw_summary(page, groups)
        of_file = [of for of in ratios if of["file"] == file]
        if of_file or len(groups) > 1:
            draw_ratios(page, of_file)
            for sentence in document.get("sentences", []):  # as on the terminal
                if sentence["file"] == file:
                    page.note(sentence["text"])
        draw_chains(page, groups)
        page.heading("Callbacks", 3)
        draw_callbacks(page, groups)


def draw_jitter(page, jitter):
    """The histogram as OSADL draws it: linear x, logarithmic y, the maximum in the legend."""
    page.heading("jitter: timers under each executor beside the bare clock_nanosleep loop")
    rows = [row for _, row in sorted(jitter["thread"].items(), key=lambda item: int(item[0]))]
    figure, axes = plt.subplots()
    far = max(quantile(sorted((int(k), v) for k, v in row["histogram"].items()), .999)
              for row in rows if row["histogram"])
    for line, row in zip(lines(), rows):
        points = sorted((int(key), count) for key, count in row["histogram"].items())
        points = [point for point in points if point[0] <= far]
        axes.step([x for x, _ in points], [y for _, y in points], where="mid", linewidth=1,
                  label=f"{row['name']} (n = {row['cycles']}, max {row['max']} µs)", **line)
    axes.set_yscale("log")
    scale(axes.yaxis)
    axes.set_xlabel("latency (µs)")
    axes.set_ylabel("cycles per 1 µs")
    legend_of(axes)
    samples = sum(row["cycles"] for row in rows)
    asked = rows[0]["in_force"]
    page.figure(figure, f"Wake-up latency of a periodic timer, {asked['policy']} "
                        f"{asked['priority']}, up to p99.9; n = {samples} cycles.")
    named = [(row["name"], sorted((int(k) + 1, v) for k, v in row["histogram"].items()))
             for row in rows]
    percentile_curves(page, named, "The same as percentiles (resolution 1 µs).")
    over_time(page, [(row["name"], [row["over_time"]]) for row in rows], "Wake-up latency; the rows take turns.")
    page.table(["row", "cycles", "p50 (µs)", "p99 (µs)", "max (µs)", "early", "CPU (%)"],
               [[row["name"], row["cycles"], row["p50_us"], row["p99_us"], row["max"], row["early"],
                 row["cpu_percent"]] for row in rows])


def slices_of(events):
    """Executions, and what ran on CPUs."""
    slices = [event for event in events if event["ph"] == "X"]
    return [event for event in slices if event["cat"] != "sched"], [event for event in slices if event["cat"] == "sched"]


def without(span, others):
    """The parts of a span that no other one covers."""
    begin, end = span
    for other_begin, other_end in sorted(others):
        if other_end <= begin or other_begin >= end:
            continue
        if other_begin > begin:
            yield begin, other_begin
        begin = other_end
    if begin < end:
        yield begin, end


def schedule_figure(page, events, begin, end, caption):
    """Callbacks on their threads, and threads on their CPUs, from `begin` to `end` in µs. While a callback is preempted it is hatched."""
    def shown(slices):
        return [event for event in slices if event["ts"] < end and event["ts"] + event["dur"] > begin]

    def span_of(event):
        return event["ts"] - begin, event["ts"] + event["dur"] - begin

    def bar(axes, row, spans, **style):  # wide enough to be seen
        axes.broken_barh([(first / 1e3, max(last - first, (end - begin) / 2000) / 1e3) for first, last in spans], (row - 0.35, 0.7), **style)

    executions, runs = map(shown, slices_of(events))
    names = {(event["pid"], event["tid"]): event["args"]["name"] for event in events
             if event["ph"] == "M" and event["name"] == "thread_name"}
    threads = sorted({(event["pid"], event["tid"]) for event in executions})
    cpus = sorted({(event["pid"], event["tid"]) for event in runs})
    callbacks = sorted({event["name"] for event in executions})
    figure, axes = plt.subplots(figsize=(7.2, 1.8 + 0.4 * (len(threads) + len(cpus))))
    for event in executions:
        row, index = threads.index((event["pid"], event["tid"])), callbacks.index(event["name"])
        bar(axes, row, [span_of(event)], facecolors=COLOURS[index % 8])
        if not cpus:
            continue
        on_cpus = [span_of(run) for run in runs if run["args"]["tid"] == event["tid"]]
        waits = list(without(span_of(event), on_cpus))
        bar(axes, row, waits, facecolors="#ffffff", edgecolors=COLOURS[index % 8], hatch="////", linewidth=0.5)
    for run in runs:
        row = len(threads) + cpus.index((run["pid"], run["tid"]))
        first, last = (min(max(time, 0), end - begin) for time in span_of(run))
        bar(axes, row, [(first, last)], facecolors="#bbbbbb", edgecolors="#ffffff", linewidth=0.5)
        if last - first > (end - begin) / 12:
            axes.text((first + last) / 2e3, row, run["name"], ha="center", va="center", fontsize=7, clip_on=True)
    axes.set_yticks(range(len(threads) + len(cpus)), [names.get(row, str(row)) for row in threads + cpus])
    axes.set_ylim(len(threads) + len(cpus) - 0.5, -0.5)
    axes.set_xlim(0, (end - begin) / 1e3)
    axes.set_xlabel("time (ms)")
    for index, name in enumerate(callbacks[:12]):
        axes.plot([], [], color=COLOURS[index % 8], linewidth=6, label=name)
    axes.legend(fontsize=7, ncol=3, loc="upper center", bbox_to_anchor=(0.5, -0.25))
    page.figure(figure, f"{caption}; n = {len(executions)} executions.")


def draw_timeline(page, timeline):
    """A short span from the middle of the trace."""
    executions, _ = slices_of(timeline["traceEvents"])
    if not executions:
        return
    page.heading("timeline: callbacks on their threads")
    times = sorted(event["ts"] for event in executions)
    begin = times[len(times) // 2]
    schedule_figure(page, timeline["traceEvents"], begin, begin + 40_000, "Executions in 40 ms, from takt run --trace")


def draw_worst_schedule(page, worst):
    """How the instance came about that was closest to its deadline, or later, of all simulated ones."""
    begin, end = worst["release_us"], worst["end_us"]
    schedule_figure(page, worst["traceEvents"], begin, end,
                    f"{worst['chain']}, the instance that took longest of all simulated ones, {(end - begin) / 1e3:.3f} ms from its "
                    f"release to the end of its last callback, in the scenario {worst['scenario']}: hatched where a callback waits for a CPU")


def draw_analysis(page, analysis):
    """A row for each chain: how late it was, how late it can be, and how late it may be."""
    page.heading(analysis["file"] + (f", {analysis['variant']}" if "variant" in analysis else ""))
    chains = analysis["chains"]
    if not chains:
        page.note("The file has no chains: add `chains`, or `chains: auto`.")
        return
    figure, axes = plt.subplots(figsize=(7.2, 1.6 + 0.5 * len(chains)))
    labels = {}  # each once in the legend

    def label(text):
        return None if text in labels else labels.setdefault(text, text)

    for row, chain in enumerate(chains):
        bound, observed, simulated = chain["bound_us"], chain["observed_us"], chain["simulated_us"]
        if bound is not None:
            axes.barh(row, bound / 1e3, 0.6, color="#c9d8ec", label=label("bound: never later"))
            waits = sum(segment["wait_us"] or 0 for segment in chain["segments"])
            if waits:
                axes.barh(row, waits / 1e3, 0.6, (bound - waits) / 1e3, color="#c9d8ec", edgecolor="white", hatch="//",
                          label=label("of it, waiting for other inputs"))
        if observed is not None:
            axes.barh(row, observed["p999"] / 1e3, 0.3, color="#3566a8", label=label("observed, p99.9"))
            axes.plot(observed["max"] / 1e3, row, "|", color="#222222", markersize=12, label=label("observed, maximum"))
        if simulated is not None:
            axes.plot(simulated["max"] / 1e3, row, "d", color="#2f7d4f", markersize=6, label=label("simulated, maximum"))
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

    page.table(["chain", "deadline (ms)", "observed p99.9 (ms)", "observed max (ms)", "simulated max (ms)", "bound (ms)", "verdict"],
               [[chain["name"], ms(chain["deadline_us"]), ms((chain["observed_us"] or {}).get("p999")),
                 ms((chain["observed_us"] or {}).get("max")), ms((chain["simulated_us"] or {}).get("max")),
                 ms(chain["bound_us"]), chain["verdict"]]
                for chain in chains])
    if (analysis["simulated"] or {}).get("why_not") is not None:
        page.note(f"Not simulated: {analysis['simulated']['why_not']}.")
    if "worst_schedule" in analysis:
        draw_worst_schedule(page, analysis["worst_schedule"])
    for chain in chains:
        if (chain["simulated_us"] or {}).get("witness") is not None:
            page.note(f"{chain['name']} is late in: {chain['simulated_us']['witness']}")
        if chain["reason"] is not None:
            page.note(f"{chain['name']} has no bound: {chain['reason']}.")
    for number, assumption in enumerate(analysis["assumptions"], 1):
        page.note(f"Assumption {number}: {assumption}.")


def title_of(document):
    """Tells one page from another in a browser's tabs."""
    if "experiments" in document:
        return "takt bench " + " ".join(experiment["name"] for experiment in document["experiments"])
    rows, command = ((document["analyses"], "analyze") if "analyses" in document else ([], "latency")
                     if "jitter" in document else (document["runs"], "compare"))
    return " ".join([f"takt {command}"] + list(dict.fromkeys(os.path.basename(row["file"]) for row in rows)))


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    document = json.load(sys.stdin)
    if sys.argv[1].endswith(".pdf"):
        return draw_figure(document["runs"], sys.argv[1])
    page = Page(document)
    for experiment in document.get("experiments", []):
        draw_experiment(page, experiment, document.get("paper"))
    if "jitter" in document:
        draw_jitter(page, document["jitter"])
    if "timeline" in document:
        draw_timeline(page, document["timeline"])
    if document.get("runs"):
        draw_runs(page, document)
    for analysis in document.get("analyses", []):
        draw_analysis(page, analysis)
    for graph in document.get("graphs", []):
        page.heading(f"{graph['file']}: graph")
        if "svg" in graph:
            page.drawing(graph["svg"], "Processes, executors with their threads, nodes and topics; chains are coloured, "
                                       "and what does not match is red. n = 1 file.", is_wide=True)
        else:
            page.note(f"Not drawn: {graph['missing']}.")
    page.write(sys.argv[1], title_of(document))


if __name__ == "__main__":
    main()
