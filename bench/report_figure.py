"""The figure of a comparison for a paper: one column wide, with its data as CSV.

report.py draws with it; `takt` has both in it.
SPDX-License-Identifier: Apache-2.0
"""
import csv
import sys

from report_page import buckets_of, by_file, draw_percentiles, plt

# A column of a paper in two columns is 3.3 to 3.5 inches wide, its captions have 8 points; type 3 fonts are refused by most publishers.
STYLE = {"pdf.fonttype": 42, "font.size": 7, "legend.fontsize": 6, "lines.linewidth": 1, "axes.linewidth": 0.6}
WIDTH, HEIGHT = 3.4, 2.3
MOST_PANELS = 6


def panels_of(runs):
    """What is drawn: of each file its chains, or the messages if it has none. (title, [(row, buckets)])."""
    panels = []
    for file, groups in by_file(runs).items():
        chains = dict.fromkeys(chain["name"] for group in groups.values() for run in group for chain in run["chains"])
        for chain in chains or [None]:
            of = "chains" if chain else "callbacks"
            named = [(name, buckets_of(group, of, lambda row: row["name"] == chain if chain else row["kind"] != "timer"))
                     for name, group in groups.items()]
            panels.append((file, chain or "messages", [(name, buckets) for name, buckets in named if buckets]))
    return [panel for panel in panels if panel[2]]


def cell(text):
    """As in all CSV of Takt: a spreadsheet takes no name for a formula."""
    return "'" + text if text.startswith(("=", "+", "-", "@", "\t", "\r")) else text


def write_data(panels, path):
    with open(path, "w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(["file", "of", "row", "latency_us", "share_not_above", "samples"])
        for name, of, named in panels:
            for row, buckets in named:
                total, seen = sum(count for _, count in buckets), 0
                for value, count in buckets:
                    seen += count
                    rows.writerow([cell(name), cell(of), cell(row), f"{value:.3f}", f"{seen / total:.9g}", total])


def short(name):
    """As much of both ends as a column has room for."""
    return name if len(name) <= 34 else f"{name[:16]}…{name[-17:]}"


def height_of(named):
    """With the legend below, where it does not fit into the picture."""
    return HEIGHT + (0.095 * len(named) if len(named) > 4 else 0)


def draw_figure(runs, path):
    panels = panels_of(runs)
    write_data(panels, path.removesuffix(".pdf") + ".csv")
    shown = panels[:MOST_PANELS]
    if len(shown) < max(len(panels), 1):
        print(f"note: the figure shows {len(shown)} of {len(panels)}; all are in the CSV" if panels else "note: nothing was received, so the figure is empty",
              file=sys.stderr)
    heights = [height_of(named) for _, _, named in shown] or [HEIGHT]
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(len(heights), squeeze=False, figsize=(WIDTH, sum(heights)), gridspec_kw={"height_ratios": heights})
        for (file, of, named), ax in zip(shown, axes[:, 0]):
            draw_percentiles(ax, [(short(name), buckets) for name, buckets in named])
            ax.set_title(short(of if len({panel[0] for panel in shown}) == 1 else f"{file}: {of}"), fontsize=7)
            if len(named) > 4:  # below the axis' name, which it would hide
                ax.legend(loc="upper left", bbox_to_anchor=(-0.1, -0.38))
        figure.tight_layout()
        figure.savefig(path, format="pdf", metadata={"CreationDate": None, "Creator": "takt"})
    plt.close(figure)
