#!/usr/bin/python3
"""Makes the pictures of the tutorials and how-to pages from real runs of a system.

usage: pictures.py make TAKT [NAME…]   runs TAKT, half a minute, and writes docs/pictures/*.svg, or those of these names
                               (needs graphviz, tmux and python3-matplotlib)
       pictures.py check       exit status 1 if a picture is missing, of another system than the file now describes, or
                               on no page

SPDX-License-Identifier: Apache-2.0
"""
import hashlib
import html
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]
FOLDER = ROOT / "docs/pictures"
SYSTEM = "examples/03_robot/robot.yaml"  # what all of them show
TEXT = "#808080"  # legible on white and on black
WIDTH, HEIGHT = 100, 26  # of the terminal
WINDOW_MS = 30  # of the timeline


def mark():
    return f"<!-- {SYSTEM} {hashlib.sha256((ROOT / SYSTEM).read_bytes()).hexdigest()} -->"


def run(*words):
    subprocess.run(words, cwd=ROOT, stdout=subprocess.DEVNULL, check=True)


def graph(takt, folder):
    run(takt, "graph", SYSTEM, "-o", folder / "graph.svg")
    text = (folder / "graph.svg").read_text(encoding="utf-8")
    return text[text.index("<svg"):]


def report(takt, folder):
    run(takt, "compare", SYSTEM, "--executors", "single_threaded,multi_threaded,events", "--duration", "2s", "--report",
        folder / "report.html")
    page = (folder / "report.html").read_text(encoding="utf-8")
    curves = re.search(r"<figure[^>]*>(<svg(?:(?!</svg>).)*latency \(µs\).*?</svg>)", page, re.DOTALL)[1]
    return re.sub(r"(<svg[^>]*>)", rf"\1<style>text {{ fill: {TEXT} }}</style>", curves, count=1).replace("var(--text)", TEXT)


def terminal_svg(lines):
    """What `tmux capture-pane -e` says of a screen: text, bold, inverse and its eight colours."""
    colours = ["#444", "#d0632b", "#3c9a54", "#a08040", "#4a7fc4", "#c4508a", "#2b9aa0", TEXT]
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH * 7.3:.0f} {len(lines) * 16 + 12}" font-family="monospace" '
             f'font-size="12"><rect width="100%" height="100%" fill="#181818" rx="6"/>']
    for row, line in enumerate(lines):
        column, colour, weight = 0, "#dddddd", "normal"
        for text, codes in re.findall(r"([^\x1b]+)|\x1b\[([\d;]*)m", line):
            for code in map(int, (codes or "0").split(";") if not text else ()):
                if code == 0:
                    colour, weight = "#dddddd", "normal"
                elif code in (1, 7):
                    weight = "bold"
                elif 30 <= code <= 37:
                    colour = colours[code - 30]
            if text.strip():
                parts.append(f'<text x="{6 + column * 7.22:.1f}" y="{row * 16 + 18}" fill="{colour}" font-weight="{weight}" '
                             f'xml:space="preserve">{html.escape(text)}</text>')
            column += len(text)
    return "\n".join(parts) + "\n</svg>"


def top(takt, folder):
    system = folder / "robot.yaml"
    system.write_text((ROOT / SYSTEM).read_text(encoding="utf-8") + "dds: {discovery: localhost}\n", encoding="utf-8")
    environment = {**os.environ, "ROS_DOMAIN_ID": str(20 + os.getpid() % 80)}
    socket = ["tmux", "-S", folder / "tmux"]
    robot = subprocess.Popen([takt, "run", system], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment)
    try:
        subprocess.run([*socket, "new-session", "-d", "-x", str(WIDTH), "-y", str(HEIGHT), f"{takt} top"], env=environment, check=True)
        time.sleep(8)  # discovery, and two intervals
        screen = subprocess.run([*socket, "capture-pane", "-e", "-p"], stdout=subprocess.PIPE, text=True, check=True).stdout
        subprocess.run([*socket, "kill-server"], check=False)
    finally:
        robot.terminate()
        robot.wait()
    return terminal_svg(screen.rstrip().splitlines())


def traced(takt, folder, has_cpus):
    sys.path.append(str(ROOT / "bench"))
    import report_page  # noqa: E402  (it needs matplotlib)
    run(takt, "run", SYSTEM, "--duration", "1s", "--trace", folder / "trace.json")
    events = json.loads((folder / "trace.json").read_text(encoding="utf-8"))["traceEvents"]
    rows = [event for event in events if event["ph"] == "M" and event["name"] == "thread_name"]
    names = {(event["pid"], event["tid"]): event["args"]["name"] for event in rows if "is_prompt" in event["args"]}
    slices = [event for event in events if event["ph"] == "X" and event["cat"] != "sched"]
    begin = sorted(event["ts"] for event in slices)[len(slices) // 2]
    figure, axes = report_page.plt.subplots(figsize=(9, 0.9 + 0.5 * (len(names) + 2 * has_cpus)))
    nodes = sorted({event["name"].split("/")[1] for event in slices})
    for event in slices:
        if not begin <= event["ts"] <= begin + WINDOW_MS * 1e3:
            continue
        row = list(names).index((event["pid"], event["tid"]))
        colour = report_page.COLOURS[nodes.index(event["name"].split("/")[1]) % len(report_page.COLOURS)]
        axes.broken_barh([((event["ts"] - begin) / 1e3, max(event["dur"] / 1e3, 0.03))], (row - 0.35, 0.7), facecolors=colour)
        if event["dur"] > 700:
            axes.annotate(event["name"].split("/")[1], ((event["ts"] - begin) / 1e3, row), fontsize=7, va="center", xytext=(2, 0),
                          textcoords="offset points", color="white")
    if has_cpus:  # and the threads of callbacks that ran there
        threads = {tid: list(names).index((pid, tid)) for pid, tid in names}
        cpus = {(event["pid"], event["tid"]): event["args"]["name"] for event in rows if event["args"]["name"].startswith("CPU ")}
        if not cpus:
            sys.exit("the kernel tells nothing here: " + rows[-1]["args"]["name"])
        names |= cpus
        for event in events:
            if event["ph"] == "X" and event["cat"] == "sched" and begin <= event["ts"] <= begin + WINDOW_MS * 1e3:
                tid = event["args"]["tid"]
                colour = report_page.COLOURS[threads[tid] % len(report_page.COLOURS)] if tid in threads else TEXT
                axes.broken_barh([((event["ts"] - begin) / 1e3, max(event["dur"] / 1e3, 0.03))],
                                 (list(names).index((event["pid"], event["tid"])) - 0.35, 0.7), facecolors=colour)
    axes.set_yticks(range(len(names)), list(names.values()))
    axes.set_xlim(0, WINDOW_MS)
    axes.set_xlabel("time (ms)")
    svg = report_page.svg_of(figure).replace("var(--text)", TEXT)
    return re.sub(r"(<svg[^>]*>)", rf"\1<style>text {{ fill: {TEXT} }}</style>", svg, count=1)


def timeline(takt, folder):
    return traced(takt, folder, has_cpus=False)


def cpus(takt, folder):
    return traced(takt, folder, has_cpus=True)


PICTURES = {picture.__name__: picture for picture in (graph, report, top, timeline, cpus)}


def make(takt, names):
    FOLDER.mkdir(exist_ok=True)
    for name in names or PICTURES:
        picture = PICTURES[name]
        with tempfile.TemporaryDirectory() as folder:
            svg = picture(takt, pathlib.Path(folder))
        (FOLDER / f"{name}.svg").write_text(f"{mark()}\n{svg}\n", encoding="utf-8")


def check():
    pages = "".join(page.read_text(encoding="utf-8") for part in ("tutorial", "how_to") for page in (ROOT / "docs" / part).glob("*.md"))
    holds = True
    for name in PICTURES:
        path = FOLDER / f"{name}.svg"
        wrong = ("is missing" if not path.exists() else
                 f"does not show what {SYSTEM} is now" if not path.read_text(encoding="utf-8").startswith(mark()) else
                 "is on no page of docs/tutorial and docs/how_to" if f"pictures/{name}.svg" not in pages else "")
        if wrong:
            print(f"docs/pictures/{name}.svg:1: {wrong}: docs/pictures.py make TAKT")
            holds = False
    return holds


if __name__ == "__main__":
    if sys.argv[1:2] == ["make"] and len(sys.argv) >= 3 and set(sys.argv[3:]) <= PICTURES.keys():
        make(pathlib.Path(sys.argv[2]).absolute(), sys.argv[3:])
    elif sys.argv[1:] == ["check"]:
        sys.exit(0 if check() else 1)
    else:
        sys.exit(__doc__)
