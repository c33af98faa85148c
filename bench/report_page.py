"""The page of a report: its style, its tables, and the figures of latencies.

report.py draws with it; `takt` has both in it.
SPDX-License-Identifier: Apache-2.0
"""
import datetime
import html
import io
import math
import re
import shlex

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt  # noqa: E402  (the backend comes first)
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator  # noqa: E402

plt.rcParams.update({
    "svg.fonttype": "none", "font.size": 10, "font.family": "sans-serif", "axes.grid": True,
    "grid.alpha": 0.3, "axes.spines.top": False, "axes.spines.right": False,
    "text.parse_math": False, "legend.frameon": False, "figure.figsize": (7.2, 4.2), "svg.hashsalt": "takt"})

# Legible on white and on black; more than eight series differ by the style of their lines.
COLOURS = ["#4a7fc4", "#d0632b", "#3c9a54", "#c4508a", "#8a70d0", "#a08040", "#2b9aa0", "#808080"]
STYLES = ["-", "--", ":", "-."]
CSS = """
:root { color-scheme: light dark; --text: #222; --faint: #666; --line: #ddd; --back: #fff }
@media (prefers-color-scheme: dark) { :root { --text: #ddd; --faint: #999; --line: #444; --back: #181818 } }
body { font: 15px/1.5 system-ui, sans-serif; max-width: 1600px; margin: 2em auto; padding: 0 1em; color: var(--text);
       background: var(--back) }
dl { display: grid; grid-template-columns: max-content auto; gap: 0 1em; font-size: 13px; color: var(--faint) }
dt, dd { margin: 0 }
dd { overflow-wrap: anywhere }
.figures { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 600px), 1fr)); gap: 1.5em }
figure { margin: 0; max-width: 760px; break-inside: avoid }
figure svg { width: 100%; height: auto }
figure.wide { max-width: none }
figure.wide svg { width: auto; max-width: 100% }
figure:not(.wide) svg text { fill: var(--text) }
figcaption, .note { font-size: 13px; color: var(--faint) }
.wide { overflow-x: auto }
table { border-collapse: collapse; margin: 1em 0; font-size: 13px; font-variant-numeric: tabular-nums }
td, th { padding: 3px 8px; text-align: right; border-bottom: 1px solid var(--line); white-space: nowrap }
td.text, th.text { text-align: left }
td.better { color: #1a7f37 }
td.worse { color: #c93c20 }
@media (prefers-color-scheme: dark) { td.better { color: #4cc06a } td.worse { color: #ff7b5c } }
summary { cursor: pointer }
@media print { :root { --text: #000; --faint: #333; --back: #fff } body { margin: 0; max-width: none; font-size: 11px }
               .figures { grid-template-columns: 1fr 1fr } .wide { overflow-x: visible } }
"""


def number(value):
    """As people write it: three digits that count, all of a large one, no exponent."""
    if not isinstance(value, (int, float)):
        return str(value)
    if value == int(value) or abs(value) >= 1000:
        return f"{value:.0f}"
    digits = 2 - math.floor(math.log10(abs(value)))
    return f"{value:.{max(digits, 0)}f}"


def scale(axis):
    """A logarithmic axis with ticks at 1, 2 and 5, or at powers of ten where these would be too many."""
    low, high = axis.get_view_interval()
    axis.set_major_locator(LogLocator(subs=(1, 2, 5) if high < 3000 * low else (1,), numticks=30))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.10g}"))
    axis.set_minor_locator(NullLocator())


def lines():
    """A colour and a style for each series."""
    return [{"color": colour, "linestyle": style} for style in STYLES for colour in COLOURS] * 9


def legend_of(axes):
    """In the picture where it is short, else below: it would hide what it names."""
    names = axes.get_legend_handles_labels()[1]
    if len(names) <= 4:
        axes.legend(fontsize=8)
    else:
        axes.legend(fontsize=7, ncol=2, loc="upper center", bbox_to_anchor=(0.5, -0.14))


def svg_of(figure):
    text = io.StringIO()
    figure.tight_layout()
    # Also a long legend is in it.
    figure.savefig(text, format="svg", transparent=True, bbox_inches="tight", metadata={"Date": None})
    plt.close(figure)
    svg = text.getvalue()
    # Black is that of the text, also on a dark screen.
    return svg[svg.index("<svg"):].replace("stroke: #000000", "stroke: var(--text)")


class Page:
    """Collects figures and tables, each with what it says about its data."""

    def __init__(self, document):
        machine = document["machine"]
        self.about = [("date", datetime.datetime.now().astimezone().strftime("%Y-%m-%d %H:%M %Z"))]
        if "command" in document:
            self.about.append(("command", shlex.join(document["command"])))
        self.about += [
            ("machine", f"{machine['cpus']} × {machine['cpu']}, Linux {machine['kernel']}, "
                        f"{machine.get('preemption', '')}, load average {machine['load_average']:.2f}"),
            ("takt", document["takt"]["version"])]
        self.parts = []
        self.count = 0
        self.is_open = False  # a row of figures

    def add(self, part, is_figure=False):
        if is_figure != self.is_open:
            self.parts.append('<div class="figures">' if is_figure else "</div>")
            self.is_open = is_figure
        self.parts.append(part)

    def heading(self, text, level=2):
        self.add(f"<h{level}>{html.escape(text)}</h{level}>")

    def figure(self, figure, caption):
        self.drawing(svg_of(figure), caption)

    def drawing(self, svg, caption, is_wide=False):
        self.count += 1
        # Several pictures share the page, but their ids must not.
        svg = re.sub(r'id="([^"]+)"', rf'id="f{self.count}_\1"', svg)
        svg = re.sub(r'url\(#([^)]+)\)', rf'url(#f{self.count}_\1)', svg)
        svg = re.sub(r'href="#([^"]+)"', rf'href="#f{self.count}_\1"', svg)
        self.add(f"<figure{' class=wide' if is_wide else ''}>{svg}<figcaption><b>Figure {self.count}.</b> {html.escape(caption)}</figcaption></figure>",
                 is_figure=not is_wide)

    def table(self, header, rows, folded=None):
        """`folded`: what it is called where it is not open at first."""
        rows = [[number(cell) for cell in row] for row in rows]
        text = [all(not re.match(r"[-.\d]", row[i]) for row in rows) for i in range(len(header))]

        def cells(tag, row):
            def kind(cell, is_text):
                words = ["text"] * is_text + [word for word in ("better", "worse") if cell.startswith(word)]
                return f' class="{" ".join(words)}"' if words else ""
            return "".join(f"<{tag}{kind(cell, is_text)}>{html.escape(cell)}</{tag}>" for cell, is_text in zip(row, text))

        body = "\n".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
        table = f'<div class="wide"><table><tr>{cells("th", header)}</tr>\n{body}</table></div>'
        self.add(f"<details><summary>{html.escape(folded)}</summary>{table}</details>" if folded else table)

    def note(self, text):
        self.add(f'<p class="note">{html.escape(text)}</p>')

    def write(self, path, title):
        self.add("")
        about = "".join(f"<dt>{html.escape(name)}</dt><dd>{html.escape(text)}</dd>" for name, text in self.about)
        with open(path, "w", encoding="utf-8") as file:
            file.write(
                "<!doctype html><!-- Written by takt --><html lang=en><head><meta charset=utf-8><meta name=viewport "
                f'content="width=device-width"><title>{html.escape(title)}</title><link rel=icon href=data:,>'
                f"<style>{CSS}</style></head><body><h1>{html.escape(title)}</h1><dl>{about}</dl>"
                + "\n".join(self.parts) + "</body></html>\n")


def median(values):
    values = sorted(values)
    return (values[(len(values) - 1) // 2] + values[len(values) // 2]) / 2


def quantile(buckets, fraction):
    """Of [value, count] pairs in order of value."""
    total = sum(count for _, count in buckets)
    seen = 0
    for value, count in buckets:
        seen += count
        if seen >= fraction * total:
            return value
    return 0


def bucket_limit_us(bucket):
    """The upper limit of a bucket of base/histogram.hpp."""
    sub = 32
    if bucket < sub:
        return bucket / 1e3
    shift = bucket // sub - 1
    return (((bucket % sub + sub + 1) << shift) - 1) / 1e3


def row_name(run):
    parts = [run["executor"]] + [run[key] for key in ("placement", "scheduler", "composition") if run.get(key, "file") not in ("file", "as")]
    return ", ".join(parts)


def by_file(runs):
    """Of each file, the runs of each row: {file: {row: [run]}}."""
    files = {}
    for run in runs:
        files.setdefault(run["file"], {}).setdefault(row_name(run), []).append(run)
    return files


def buckets_of(runs, rows, is_meant=lambda row: True):
    """The latencies of these rows in all runs, as [µs, count] pairs in order."""
    result, most = {}, 0
    for run in runs:
        for row in run[rows]:
            if is_meant(row):
                most = max(most, row["latency_us"].get("max") or 0)
                for bucket, count in row["latency_us"].get("histogram", []):
                    result[bucket] = result.get(bucket, 0) + count
    return [(min(bucket_limit_us(bucket), most), count) for bucket, count in sorted(result.items())]


def draw_percentiles(axes, named_buckets):
    """Latency against the percentile, the axis stretched towards 100 % (as HdrHistogram draws). Returns the samples."""
    totals = []
    for line, (name, buckets) in zip(lines(), named_buckets):
        total = sum(count for _, count in buckets)
        if total == 0:
            continue
        totals.append(total)
        xs, ys, seen = [], [], 0
        for value, count in buckets:
            seen += count
            xs.append(total / max(total - seen, 0.5))
            ys.append(max(value, 0.01))
        axes.plot(xs, ys, label=f"{name} (n = {total})", drawstyle="steps-pre", **line)
    if not totals:
        return 0
    axes.set_xscale("log")
    axes.set_yscale("log")
    # As far as the number of samples carries: of 200, one in 100 can be seen, and not one in 1000.
    ticks = [tick for tick in (1, 2, 10, 100, 1000, 10_000, 100_000, 1_000_000) if tick <= max(totals)]
    axes.set_xticks(ticks, [f"{100 - 100 / tick:.10g}" for tick in ticks])
    axes.xaxis.set_minor_locator(NullLocator())
    scale(axes.yaxis)
    axes.set_xlim(1, 2 * max(totals))
    axes.set_xlabel("percentile (%)")
    axes.set_ylabel("latency (µs)")
    legend_of(axes)
    return sum(totals)


def percentile_curves(page, named_buckets, caption):
    figure, axes = plt.subplots()
    samples = draw_percentiles(axes, named_buckets)
    if not samples:
        return plt.close(figure)
    page.figure(figure, f"{caption} Percentiles; n = {samples} samples.")


def over_time(page, named, caption):
    """How latencies went over the measurement: p50 and p99 of each slice of it as lines, its maximum as a point.

    named: the name of each series, with a list of the JSON of its runs ("slice_s", "slices"). Of several runs, each slice has
    the medians of their percentiles, and the largest maximum.
    """
    figure, axes = plt.subplots()
    samples = 0
    for line, (name, runs) in zip(lines(), named):
        length = max((run["slice_s"] for run in runs), default=0)
        slices = {}
        for run in runs:
            for part in run["slices"]:
                slices.setdefault(int(part["begin_s"] / length + 1e-6), []).append(part)
                samples += part["count"]
        times = sorted(slices)
        xs = [(time + 0.5) * length for time in times]

        def of_all(key, combine):
            return [max(combine([part[key] for part in slices[time]]), 0.01) for time in times]

        axes.plot(xs, of_all("p99_us", median), label=name, linewidth=1.2, **line)
        axes.plot(xs, of_all("p50_us", median), linewidth=0.7, **line)
        axes.plot(xs, of_all("max_us", max), linestyle="", marker=".", markersize=4, color=line["color"])
    if not samples:
        return plt.close(figure)
    axes.set_yscale("log")
    scale(axes.yaxis)
    axes.set_xlim(left=0)
    axes.set_xlabel("time since the beginning (s)")
    axes.set_ylabel("latency (µs)")
    legend_of(axes)
    page.figure(figure, f"{caption} Over time: p99 (thick) and p50 (thin) of each slice, and its maximum (points); n = {samples} samples.")


def distribution_curves(page, named_buckets, caption):
    """The share of samples that a latency is not above (ECDF)."""
    figure, axes = plt.subplots()
    samples = 0
    for line, (name, buckets) in zip(lines(), named_buckets):
        total = sum(count for _, count in buckets)
        samples += total
        xs, ys, seen = [], [], 0
        for value, count in buckets:
            seen += count
            xs.append(max(value, 0.01))
            ys.append(100 * seen / total)
        axes.plot(xs, ys, label=name, drawstyle="steps-post", **line)
    axes.set_xscale("log")
    scale(axes.xaxis)
    axes.set_ylim(0, 100)
    axes.set_xlabel("latency (µs)")
    axes.set_ylabel("samples that were not later (%)")
    legend_of(axes)
    page.figure(figure, f"{caption} Distribution; n = {samples} samples.")


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
            "label": f"{name}\nn = {total}", "med": quantile(buckets, .5),
            "q1": quantile(buckets, .25), "q3": quantile(buckets, .75),
            "whislo": quantile(buckets, .01), "whishi": quantile(buckets, .99),
            "fliers": [buckets[-1][0]]})
    axes.bxp(statistics, vert=False, patch_artist=True, boxprops={"facecolor": "#c9d8ec"},
             medianprops={"color": "#d0632b"}, flierprops={"markersize": 4})
    axes.invert_yaxis()  # the order of the table
    axes.set_xscale("log")
    scale(axes.xaxis)
    axes.set_xlabel("latency (µs)")
    axes.plot([], [], color="#d0632b", label="median; box p25–p75, whiskers p1–p99, point: maximum")
    axes.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, 1.12))
    page.figure(figure, f"{caption} n = {samples} samples.")
