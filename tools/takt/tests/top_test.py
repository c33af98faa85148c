#!/usr/bin/env python3
"""`takt top` and `takt callback`, as somebody uses them: as JSON, and in a terminal (tmux), where keys are
sent and the screen is read.

usage: top_test.py TAKT
"""
# SPDX-License-Identifier: Apache-2.0
import json
import os
import pathlib
import pty
import re
import shutil
import signal
import socket
import subprocess
import tempfile
import time
import xml.etree.ElementTree

from command import run, takt
from checks import check, children_of, environment, eventually, failures, finish, proves, skip

LAYOUT = pathlib.Path(__file__).resolve().parents[3] / "docs/how_to/plotjuggler.xml"
folder = tempfile.TemporaryDirectory(prefix="takt_top_")
os.chdir(folder.name)
SYSTEM = """
dds: {discovery: localhost}
executors:
  fast: {type: events}
  slow: {type: single_threaded}
container:
  name: %s
  components:
    - {component: takt::Workload, name: sender, executor: fast, parameters: {publishers: {topic: [beat], period_us: [20000]}}}
    - {component: takt::Workload, name: hearer, executor: slow, parameters: {subscriptions: {topic: [beat]}}}
chains: [{name: heart, path: [sender/beat_timer, hearer/beat], deadline: 50ms}]
"""


def start(name):
    with open(f"{name}.yaml", "w") as file:
        file.write(SYSTEM % name)
    return subprocess.Popen([takt, "run", f"{name}.yaml"], env=environment, stdout=subprocess.DEVNULL,
                            stderr=subprocess.DEVNULL)


def end(process, how=signal.SIGTERM):
    process.send_signal(how)
    process.wait(60)


def named(rows, **wanted):
    return [row for row in rows if all(row.get(key) == value for key, value in wanted.items())]


# ---- Nobody ----
nobody = run("top", "--json", "--count", "1", status=1).stderr
check(proves("command_line.md", "If there is no container, or none of a given name, one line says so after 3 s"), nobody.count("\n") == 1 and "no container on DDS domain" in nobody, nobody)
run("top", "--interval", "0s", status=2)
run("top", "--count", "0", status=2)

robot = start("robot")
check("a name that nobody has gets the nearest one",
      eventually(lambda: "did you mean 'robot'?" in subprocess.run([takt, "top", "robt", "--count", "1"], env=environment,
                                                                   text=True, capture_output=True).stderr))

# ---- JSON: also because the output is no terminal ----
for words in (["--json"], []):
    lines = run("top", "robot", "--interval", "500ms", "--count", "3", *words).stdout.splitlines()
    check("there is one line for each interval", len(lines) == 3, lines)
    documents = [json.loads(line) for line in lines]
    last = documents[-1]["containers"][0]
    check("it is that of the container", last["name"] == "robot" and last["state"] == "running", last)
    check("time goes on", documents[0]["time"] < documents[1]["time"] < documents[2]["time"], documents)
    check("an interval takes as long as asked, or longer", last["interval_s"] > 0.4, last["interval_s"])
    hearer = named(last["callbacks"], node="/hearer", callback="beat")[0]
    check("a callback has its rate and its times", hearer["rate_hz"] > 0 and hearer["kind"] == "subscription"
          and hearer["latency_us"]["p50"] <= hearer["latency_us"]["p99"] <= hearer["latency_us"]["max"]
          and hearer["execution_us"]["p50"] is not None, hearer)
    fast = named(last["executors"], executor="fast")[0]
    check("an executor has its type, scheduler and threads",
          (fast["type"], fast["scheduler"], fast["threads"]) == ("events", "fifo", 1), fast)
    thread = named(last["threads"], executor="fast")[0]
    check("a thread has what Linux says of it", thread["policy"] == "SCHED_OTHER" and thread["affinity"]
          and thread["wakeups_per_s"] > 0, thread)
    check("a chain is measured", named(last["chains"], name="heart")[0]["latency_us"]["p99"] > 0, last["chains"])
    check("a topic has its rate", named(last["topics"], topic="/beat")[0]["rate_hz"] > 0, last["topics"])
    check("nobody watches its bounds", last["deviations"] is None, last["deviations"])

# ---- The same as a stream, for PlotJuggler ----
def curves(prefix, value):
    """The names that PlotJuggler gives to the numbers of a JSON message."""
    if isinstance(value, dict):
        return {name for key, each in value.items() for name in curves(f"{prefix}/{key}", each)}
    if isinstance(value, list):
        return {name for i, each in enumerate(value) for name in curves(f"{prefix}[{i}]", each)}
    return {prefix} if isinstance(value, (int, float)) and not isinstance(value, bool) else set()


with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as plotter:
    plotter.bind(("127.0.0.1", 0))
    plotter.settimeout(60)
    port = plotter.getsockname()[1]
    said = run("top", "robot", "--interval", "200ms", "--count", "2", "--stream", f"udp://127.0.0.1:{port}").stdout
    sent = [json.loads(plotter.recv(65536)) for _ in range(2)]
check("each interval is a datagram, and nothing else is printed", said == "" and sent[0]["time"] < sent[1]["time"], said)
check("it has what a line has", sent[1].keys() == documents[-1].keys() and
      sent[1]["containers"][0].keys() == documents[-1]["containers"][0].keys(), sent[1])
layout = xml.etree.ElementTree.parse(LAYOUT)
drawn = {curve.get("name") for curve in layout.iter("curve")}
known = curves("", sent[0]) | curves("", sent[1])
check("PlotJuggler's layout draws what is sent", drawn and drawn <= known, drawn - known)
run("top", "robot", "--count", "1", "--stream", f"udp://127.0.0.1:{port}")  # nobody listens any more
for address in ("127.0.0.1:9870", "udp://127.0.0.1", "udp://:9870", "udp://127.0.0.1:0", "udp://127.0.0.1:70000", "udp://1:2:3/x", "tcp://a:1"):
    error = run("top", "--count", "1", "--stream", address, status=2).stderr
    check(f"{address} is refused in one line", error.count("\n") == 1 and "write udp://HOST:PORT" in error, error)
error = run("top", "--count", "1", "--stream", "udp://no.such.host.invalid:9870", status=2).stderr
check("so is a host that nobody knows", error.count("\n") == 1 and "'no.such.host.invalid'" in error, error)

# ---- /diagnostics, as another process receives it ----
said = run("topic", "echo", "/diagnostics", "-n", "1", "--json", "-", "--duration", "40s").stdout
statuses = {status["name"]: status for status in json.loads(said)["status"]}
check("there is a status for container, executors, callbacks and chains",
      {"robot: container", "robot: executor fast", "robot: callback /hearer/beat", "robot: chain heart"} <= set(statuses), statuses)

# ---- takt callback set ----
said = run("callback", "set", "robot", "hearer/beat", "priority=9", "deadline=7ms", "budget=3ms").stdout
check("what is in force is printed", said == "/hearer/beat: priority 9, deadline 7ms, budget 3ms\n", said)
line = json.loads(run("top", "robot", "-d", "200ms", "-n", "1").stdout)
hearer = named(line["containers"][0]["callbacks"], node="/hearer", callback="beat")[0]
check("takt top shows it", (hearer["priority"], hearer["deadline_us"], hearer["budget_us"]) == (9, 7000, 3000), hearer)
for words, status, remedy in ((["hearer/beet", "priority=1"], 1, "did you mean '/hearer/beat'?"),
                              (["hearer/beat", "priorty=1"], 2, "did you mean 'priority'?"),
                              (["hearer/beat", "priority"], 2, "write KEY=VALUE"),
                              (["hearer/beat", "priority={a: b}"], 2, "'{a: b}' is not a whole number"),
                              (["hearer/beat", "priority=99999999999"], 2, "'99999999999' is not a whole number"),
                              (["hearer/beat", "deadline="], 2, "such as 20ms"),
                              (["hearer/beat", "budget=0ms"], 2, "0ms"),
                              (["hearer/beat", "deadline=1ms", "budget=2ms"], 2, "budget"),
                              (["hearer/beat", "priority=1", "priority=2"], 2, "'priority' is there twice"),
                              (["hearer/beat", "deadline=7"], 2, "'7'")):
    said = run("callback", "set", "robot", *words, status=status).stderr
    check(f"{words[-1]} on {words[0]} is refused: {remedy}", remedy in said and "request" not in said, said)

# ---- A terminal that is lost, where SIGHUP is ignored (nohup) ----
for words, status in (([], 0), (["--count", "1000000"], 128 + signal.SIGHUP)):
    ours, theirs = pty.openpty()
    lost = subprocess.Popen([takt, "top", "--interval", "200ms", *words], env=environment | {"TERM": "xterm"}, stdin=theirs,
                            stdout=theirs, stderr=subprocess.DEVNULL, preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))
    os.close(theirs)
    shown = b""
    while b"/hearer/beat" not in shown:
        shown += os.read(ours, 65536)
    os.close(ours)
    check(f"takt top {words} ends with its terminal", lost.wait(60) == status, lost.returncode)

# ---- The terminal ----
if not shutil.which("tmux"):
    end(robot)
    if failures:
        finish()
    skip("there is no tmux (apt-get install tmux)")


class Terminal:
    """A tmux server of its own, as somebody sees it."""

    def __init__(self, command, width=150, height=24):
        self.socket = os.path.join(folder.name, f"tmux_{time.monotonic_ns()}")
        variables = environment | {"LC_ALL": "C.UTF-8"}
        variables.pop("TMUX", None)
        self.variables = variables
        self.tmux("-f", "/dev/null", "new-session", "-d", "-x", str(width), "-y", str(height), "bash --noprofile --norc")
        self.tmux("set-option", "-g", "escape-time", "0")
        self.keys(f"PS1=; stty -a > before; {command}; echo status=$?; stty -a > after; echo is_over", "Enter")

    def tmux(self, *words):
        return subprocess.run(["tmux", "-S", self.socket, *words], env=self.variables, text=True, capture_output=True,
                              timeout=60).stdout

    def keys(self, *keys):
        self.tmux("send-keys", *keys)

    def screen(self):
        return self.tmux("capture-pane", "-p")

    def shows(self, *texts):
        return eventually(lambda: all(re.search(text, self.screen(), re.M) for text in texts))

    def is_over_with(self, status):
        holds = self.shows(rf"^status={status}$", "^is_over$")
        modes = [open(name).read() for name in ("before", "after")] if holds else []
        check(f"the status is {status}, and the terminal is as it was", holds and modes[0] == modes[1], self.screen(), modes)
        self.tmux("kill-server")


top = f"'{takt}' top --interval 200ms"
terminal = Terminal(top)
check("callbacks are shown first", terminal.shows(r"\[3:callbacks\]", r"robot \(pid \d+, CPU", r"/hearer/beat .*slow", r"q quit"),
      terminal.screen())
for key, sign in (("1", "SCHED_OTHER"), ("2", "single_threaded"), ("4", "^.heart "), ("5", "^./beat "), ("6", "assumption"), ("3", "/sender/beat_timer")):
    terminal.keys(key)
    check(f"key {key} shows {sign}", terminal.shows(sign), terminal.screen())
terminal.keys("Right", "Right", "Right")
check("a column of numbers has a history", terminal.shows(r"vcalls/s", r"calls/s of .*: [▁▂▃▄▅▆▇█]{3}"), terminal.screen())
terminal.keys("/", "hear", "Enter")
check("the filter leaves one row", eventually(lambda: "/sender/" not in terminal.screen() and "/hearer/beat" in terminal.screen()),
      terminal.screen())
terminal.keys("Escape")
check("Esc shows all", terminal.shows("/sender/beat_timer"), terminal.screen())
terminal.keys("p")
check("p pauses", terminal.shows("PAUSED"), terminal.screen())
terminal.keys("p")
check("and goes on", eventually(lambda: "PAUSED" not in terminal.screen()), terminal.screen())
terminal.tmux("resize-window", "-x", "60", "-y", "12")
check("a smaller window shows the help in its last line",
      eventually(lambda: len(terminal.screen().splitlines()) == 12 and terminal.screen().splitlines()[-1].startswith("? help")),
      terminal.screen())
terminal.tmux("resize-window", "-x", "150", "-y", "24")
second = start("second")
check("a container that comes later is shown, too", terminal.shows(r"second \(pid", r"/hearer/beat .*second"), terminal.screen())
twin = start("second")
check("of two with one name nobody knows who answers", terminal.shows(r"second \(several processes have this name\)"), terminal.screen())
end(twin)
check("until one has ended", terminal.shows(r"second \(pid"), terminal.screen())
second.send_signal(signal.SIGSTOP)
check("one that is stopped does not answer", terminal.shows(r"second \(does not answer\)", r"/hearer/beat \(old\) +second"), terminal.screen())
second.send_signal(signal.SIGCONT)
check("it answers when it goes on", terminal.shows(r"second \(pid"), terminal.screen())
end(second)
check("when it ends, its rows say so", terminal.shows(r"second \(ended\)", r"/hearer/beat \(ended\) +second"), terminal.screen())
terminal.keys("q")
terminal.is_over_with(0)
for name, status in (("INT", 0), ("TERM", 0)):
    terminal = Terminal(top)
    terminal.shows("/hearer/beat")
    shell = int(terminal.tmux("list-panes", "-F", "#{pane_pid}"))
    os.kill(children_of(shell)[0], getattr(signal, f"SIG{name}"))
    terminal.is_over_with(status)
terminal = Terminal(f"TERM=nonsense {top}")
terminal.is_over_with(1)
end(robot)
finish()
