#!/usr/bin/env python3
"""A new user's first day, as a script: each step at a terminal ends with its status and says what it should, in words of a
user's, and is never silent for long. docs/tutorial/first_day.md is its transcript.

usage: first_day_test.py TAKT [--write]

--write: makes the page of this run. Without it, the page must have these steps.
"""
# SPDX-License-Identifier: Apache-2.0
import os
import pathlib
import pty
import re
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../cmake"))
from checks import check, environment, eventually, finish  # noqa: E402

takt = pathlib.Path(sys.argv[1]).resolve()
page = pathlib.Path(__file__).resolve().parents[3] / "docs/tutorial/first_day.md"
ROBOT = """\
threads:
  urgent: {policy: SCHED_FIFO, priority: 80}
executors:
  fast: {type: events, scheduler: edf, threads: [urgent]}
chains:
  - {name: drive, path: [/lidar/scan_timer, /filter/scan, /motor/points], deadline: 20ms}
dds: {}
container:
  name: robot
  load: index
  components:
    - component: takt::Workload
      name: lidar
      executor: fast
      parameters: {publishers: {topic: [scan, image], period_us: [10000, 100000], reliability: [reliable, best_effort]}}
    - component: takt::Workload
      name: filter
      executor: fast
      parameters: {relays: {input: [scan], output: [points]}}
    - component: takt::Workload
      name: motor
      executor: fast
      parameters: {subscriptions: {topic: [points, battery]}}
    - component: takt::Workload
      name: screen
      parameters: {subscriptions: {topic: [image]}}
"""
# What follows a heading of the page; what is typed; the exit status, or two where the machine decides; what is said.
STEPS = [
    ("Look around", "What is this, and is this machine fit for it?"),
    ("takt --version", 0, r"^\d+\.\d+"),
    ("takt --help", 0, r"^Subcommands:"),
    ("takt doctor", (0, 1), r"preemption model"),
    ("takt list executors", 0, r"^events +every event at once"),
    ("takt list schedulers", 0, r"^edf "),
    ("takt lst executors", 2, r"did you mean 'list'"),
    ("takt list executor", 2, r"did you mean 'executors'"),
    ("takt help exit-status", 0, r"\| 2 \|"),
    ("takt interface show std_msgs/msg/String", 0, r"string data"),
    ("A project of one's own", "`takt new` writes one that builds (see [your robot](2_your_robot.md)); for now, a file will do."),
    ("takt new first_robot", 0, r"first_robot"),
    ("takt new 'My Robot'", 2, r"My Robot"),
    ("ls first_robot", 0, r"CMakeLists.txt"),
    ("cat robot.yaml", 0, r"takt::Workload"),
    ("Is the file right?", "What is wrong is said before anything runs, with the line."),
    ("takt check robot.yaml", 0, r"robot.yaml"),
    ("takt check robt.yaml", 2, r"robt.yaml"),
    ("sed 's/scheduler: edf/shceduler: edf/' robot.yaml > wrong.yaml; takt check wrong.yaml", 2, r"did you mean 'scheduler'"),
    ("sed 's/executor: fast/executor: fats/' robot.yaml > wrong.yaml; takt check wrong.yaml", 2, r"did you mean 'fast'"),
    ("takt plan robot.yaml", 0, r"drive.*→"),
    ("takt graph robot.yaml", 0, r"/image .*less reliability is offered"),
    ("takt graph robot.yaml -o robot.dot", 0, r"picture: robot.dot"),
    ("takt graph robot.yaml -o robot.png", 2, r"\.svg, \.html or \.dot"),
    ("Run it", "Then the same system under another executor, which is one word."),
    ("takt run robot.yaml --duration 2s", 0, r"/filter +scan"),
    ("takt run robot.yaml --duration 2", 2, r"has no unit"),
    ("takt run robot.yaml --executor evnts", 2, r"did you mean 'events'"),
    ("takt run robot.yaml --executor multi_threaded --duration 1s", 0, r"^fast +/lidar +scan_timer"),
    ("takt run robot.yaml --duration 3s --trace trace.json", 0, r"/motor +points"),
    ("takt model trace.json -o model.yaml", 0, r"/filter"),
    # On a machine that others use, a run may also have missed the deadline, been longer than its bound, or so long that messages wait: each has
    # a next step.
    ("takt analyze robot.yaml --model model.yaml", 1, r"^drive is bounded if\n(.*\n)+ +→ |^drive took .* measure longer|^drive took .* its deadline|^drive is in time, but not every instance comes through"),
    ("Which executor is best?", "A difference that is real is said so; below six repeats there is no verdict."),
    ("takt compare robot.yaml --executors file,multi_threaded --repeat 6 --duration 300ms", 0, r"multi_threaded"),
    ("takt compare robot.yaml --report robot.pdf", 2, r"\.html"),
    ("takt latency -D 500ms", (0, 1), r"clock_nanosleep"),
    ("takt latency -D 500x", 2, r"500x"),
    ("See it while it runs", "In another terminal, or behind an `&`. `takt top` is a live table at a terminal, and lines of JSON elsewhere."),
    ("takt run robot.yaml &", 0, r"running"),
    ("takt component list", 0, r"robot +1 +/lidar"),
    ("takt node list", 0, r"/filter"),
    ("takt topic list", 0, r"/scan"),
    ("takt topic info /scan", 0, r"publisher +/lidar"),
    ("takt topic hz /scan --duration 2s", 0, r"^ +\d+\.\d+ "),
    ("takt topic echo /scan -n 1", 0, r"tracking_number"),
    ("takt topic echo /scn -n 1", 1, r"did you mean '/scan'"),
    ("takt param list /lidar", 0, r"publishers"),
    ("takt graph", 0, r"/scan +takt/msg/Workload"),
    ("takt graph robto", 1, r"did you mean '/robot'"),
    ("takt top robot --json -n 1 | cut -c 1-100", 0, r'"containers"'),
    ("takt callback set robot /motor/points priority=5", 0, r"priority 5, deadline none"),
    ("takt callback set robot /motor/point priority=5", 1, r"did you mean"),
    ("takt component load robot takt::Workload --name extra --executor fast", 0, r"/extra"),
    ("takt component unload robot 5; takt component list robot", 0, r"/lidar"),
    ("takt component unload robot 9", 1, r"there is no component 9"),
    ("takt bag record --all --duration 1s -o day.mcap", 0, r"day.mcap"),
    ("takt bag info day.mcap", 0, r"/scan"),
    ("kill -INT %1", 0, r"/filter +scan"),
    ("takt node list", 0, r"no node"),
]
# Words that no user has typed or can do anything with.
INTERNAL = re.compile(r"std::|CLI::|CLI11|nlohmann|json\.exception|terminate called|basic_string|Traceback|\.[ch]pp\b|dds_(?!threads_elsewhere)\w+|"
                      r"0x[0-9a-f]{6}|[Aa]ssert|core dumped|errno|YAML::|yaml-cpp|No such process")
# A sign of life is due after two seconds. More is of a machine that has other things to do.
MOST_SILENCE = 6
MOST_LINES = 14  # of a step on the page


def undisturbed():
    """A clock that stands still while something waits for a CPU, in seconds."""
    try:
        pressure = pathlib.Path("/proc/pressure/cpu").read_text(encoding="ascii")
    except OSError:  # the kernel does not tell
        return time.monotonic()
    return time.monotonic() - int(re.search(r"^some .*total=(\d+)", pressure, re.M)[1]) / 1e6


class Step:
    """A command at a terminal of its own."""

    def __init__(self, words, folder):
        self.words, self.said, self.silence = words, "", 0.0
        self.pid, self.terminal = pty.fork()
        if self.pid == 0:
            os.chdir(folder)
            os.execvpe("bash", ["bash", "-c", words.removesuffix(" &")], environment | {
                "PATH": f"{takt.parent}:{os.environ['PATH']}", "TERM": "dumb", "NO_COLOR": "1", "COLUMNS": "120"})

    def listen(self, until=None):
        """Until it ends, or says this."""
        heard = undisturbed()
        while until is None or not re.search(until, self.said):
            try:
                part = os.read(self.terminal, 65536) if select.select([self.terminal], [], [], 90)[0] else b""
            except OSError:  # the terminal has gone with the last process
                part = b""
            if not part:
                break
            now = undisturbed()
            self.silence, heard = max(self.silence, now - heard), now
            self.said += part.decode("utf-8", "replace")

    def end(self):
        self.listen()
        return os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])

    def text(self):
        """As it stands on the terminal at the end: lines about progress have been overwritten."""
        lines, row, column = [""], 0, 0
        for count, code, control, text in re.findall(r"\x1b\[(\d*)[;?\d]*([A-Za-z])|([\r\n])|([^\x1b\r\n]+)", self.said):
            if code == "A":
                row = max(row - int(count or 1), 0)
            elif code == "K":
                lines[row] = lines[row][:column]
            elif code == "J":
                lines[row:] = [lines[row][:column]]
            elif control == "\r":
                column = 0
            elif control == "\n":
                row += 1
                lines += [""] * (row + 1 - len(lines))
            elif text:
                lines[row] = lines[row].ljust(column)[:column] + text + lines[row][column + len(text):]
                column += len(text)
        return "\n".join(line.rstrip() for line in lines if line.strip())


def take(words, status, pattern, folder, background):
    """Does a step; what it says, and its status."""
    if words == "kill -INT %1":
        step = background.pop()
        step.said = ""
        os.kill(step.pid, signal.SIGINT)
    else:
        step = Step(words, folder)
    if words.endswith(" &"):
        step.listen(pattern)
        background.append(step)
        # It runs when DDS shows all its nodes.
        check("it runs", eventually(lambda: all(node in subprocess.run(
            [takt, "node", "list"], env=environment, text=True, capture_output=True).stdout for node in ("/lidar", "/screen"))))
        return step.text(), 0
    ended = step.end()
    said = step.text()
    check(f"$ {words}: status {ended}", ended in (status if isinstance(status, tuple) else (status,)), ended, said)
    check("  it says so", re.search(pattern, said, re.M), said)
    check("  and names nothing that is inside", not (found := INTERNAL.search(said)), found, said)
    check(f"  and is never silent for long ({step.silence:.1f} s)", step.silence < MOST_SILENCE)
    return said, ended


def block(words, said, status):
    lines = said.splitlines()
    if len(lines) > MOST_LINES:
        lines = [*lines[:MOST_LINES - 1], "…"]
    return "\n".join([f"    $ {words}", *(f"    {line}" for line in lines), *([f"    (exit status {status})"] if status else [])])


def main():
    folder = pathlib.Path(tempfile.mkdtemp())
    (folder / "robot.yaml").write_text(ROBOT, encoding="utf-8")
    text = ["# A first day with Takt", "", "What somebody types who has just installed Takt, mistakes included, and what it says. "
            "`tools/takt/tests/first_day_test.py`", "has done these steps on a machine with two processors, and made this page of them. "
            "Long outputs are cut."]
    background = []
    for step in STEPS:
        if len(step) == 2:
            text += ["", f"## {step[0]}", "", step[1]]
            continue
        said, status = take(*step, folder, background)
        text += ["", block(step[0], said.replace(str(folder), "~"), status)]
    for step in background:  # after a failure
        os.kill(step.pid, signal.SIGKILL)
    shutil.rmtree(folder)
    if "--write" in sys.argv:
        page.write_text("\n".join(text) + "\n", encoding="utf-8")
    typed = re.findall(r"(?m)^    \$ (.*)$", page.read_text(encoding="utf-8"))
    wanted = [step[0] for step in STEPS if len(step) > 2]
    check("the page has these steps; otherwise make it again, with --write", typed == wanted, set(typed) ^ set(wanted))
    finish()


main()
