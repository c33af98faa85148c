#!/usr/bin/env python3
"""SIGINT, SIGTERM and SIGHUP at any time: the process ends in bounded time, says why it waits, and
what is sound is destroyed in order.

usage: signals_test.py TAKT WITNESS_LIBRARY
"""
# SPDX-License-Identifier: Apache-2.0
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../cmake"))
from checks import check, environment, eventually, finish, lives, proves, state_of  # noqa: E402

takt, library = (os.path.abspath(path) for path in sys.argv[1:])
LIMIT = 60  # seconds, for what takes a few on an idle machine


def component(name):
    return f"      - {{component: Witness, library: {library}, name: {name}}}\n"


def container(name, more=""):
    return f"  - name: {name}_process\n{more}    components:\n" + component(name)


class Run:
    """A takt process whose components leave traces."""

    def __init__(self, text, words=("run", "FILE"), name="system.yaml", **more):
        self.folder = tempfile.TemporaryDirectory()
        self.file = os.path.join(self.folder.name, name)
        with open(self.file, "w") as file:
            file.write(text)
        self.words, self.more = words, more

    def begin(self):
        words = [self.file if word == "FILE" else self.path(word[1:]) if word[0] == "@" else word
                 for word in self.words]
        self.log = open(self.path("log"), "w")
        self.process = subprocess.Popen([takt, *words], stdout=subprocess.DEVNULL, stderr=self.log,
                                        env=dict(environment, WITNESS=self.folder.name),
                                        **self.more)
        return self

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def read(self, name):
        return open(self.path(name)).read() if os.path.exists(self.path(name)) else ""

    def close(self, name):
        """The next constructor of this component waits."""
        os.mkfifo(self.path(name + ".gate"))
        return self

    def jam(self, name):
        """The callback of this component never returns."""
        os.mkfifo(self.path(name + ".jam"))
        return self

    def open(self, name):
        """The constructor that waits, or is about to, goes on."""
        for _ in range(LIMIT * 100):
            try:
                return os.close(os.open(self.path(name + ".gate"), os.O_WRONLY | os.O_NONBLOCK))
            except OSError:  # nobody waits yet
                time.sleep(0.01)

    def wait(self, name, wanted):
        """Until the file has as many characters, or this text."""
        for _ in range(LIMIT * 100):
            text = self.read(name)
            if wanted in text if isinstance(wanted, str) else len(text) >= wanted:
                return True
            if self.process.poll() is not None:
                return False
            time.sleep(0.01)
        return False

    def begin_jammed(self):
        self.jam("slow").begin()
        self.wait("slow.ticks", 1)
        return self

    def end(self):
        try:
            return self.process.wait(LIMIT)
        except subprocess.TimeoutExpired:
            self.process.kill()
            check(f"takt {self.words[0]} ends within {LIMIT} s", False, self.read("log"))
            return "no end"

    def send(self, number):
        self.process.send_signal(number)


def children_of(process):
    tasks = f"/proc/{process.pid}/task/{process.pid}/children"
    return [int(pid) for pid in open(tasks).read().split()]


def wait_for_ends(pids):
    """Until these processes have ended, also when their parent has not waited for them."""
    return eventually(lambda: not any(map(lives, pids)), LIMIT)


ONE = "container:\n  name: one\n  components:\n" + component("sound") + component("slow")

# These end by themselves while the others are looked at.
TWO_SLOW = "containers:\n" + container("sound") + container("slow")
patient = [Run(text).begin_jammed() for text in (ONE, TWO_SLOW)]
for run in patient:
    run.send(signal.SIGINT)

for number in (signal.SIGINT, signal.SIGTERM):
    run = Run(ONE).close("slow").begin()
    run.wait("slow.entered", 1)
    run.send(number)
    status = run.end()
    check(f"{number.name} ends a process whose constructor never returns", status == -number, status)
    check("which says so", f"{number.name}; waiting for the constructor of component 'slow'"
          in run.read("log") and "did not return" in run.read("log"), run.read("log"))

run = Run(ONE).close("slow").begin()
run.wait("slow.entered", 1)
run.send(signal.SIGINT)
run.wait("log", "waiting for")
run.open("slow")
status = run.end()
check(proves("command_line.md", "If the constructor returns in time, everything created so far is destroyed"), status == 128 + signal.SIGINT
      and run.read("sound.gone") and run.read("slow.gone"), status, run.read("log"))

run = Run("dds: {parameter_services: false}\ncontainer:\n  name: one\n  load: index\n  components:\n"
          + component("sound")).close("slow").begin()
run.wait("sound.ticks", 1)
loader = subprocess.Popen([takt, "component", "load", "one", "Witness", "--library", library,
                           "--name", "slow"], env=environment, stderr=subprocess.DEVNULL)
run.wait("slow.entered", 1)
run.send(signal.SIGINT)
status = run.end()
check("a component that is being loaded holds nothing up either", status == -signal.SIGINT
      and "SIGINT; waiting for the constructor of component 'slow'" in run.read("log"),
      status, run.read("log"))
loader.kill()
loader.wait()

# ---- Several processes ----

run = Run(TWO_SLOW).close("slow").begin()
run.wait("slow.entered", 1)
run.wait("sound.made", 1)
run.send(signal.SIGTERM)
status = run.end()
check("of several processes the sound ones end by themselves", status == 128 + signal.SIGTERM
      and run.read("sound.gone"), status, run.read("log"))
check("the other one is killed, and named", "killing process 'slow_process'" in run.read("log"),
      run.read("log"))

# A second signal only let the destructors begin, which waited for the callback for ever; a child
# whose parent was killed did so, too.
INT, TERM, KILL = signal.SIGINT, signal.SIGTERM, signal.SIGKILL
for what, first, second in (("a second SIGINT", INT, INT), ("SIGTERM right after SIGINT", INT, TERM),
                            ("SIGKILL of their parent", KILL, None)):
    run = Run(TWO_SLOW).begin_jammed()
    run.wait("sound.ticks", 3)
    children = children_of(run.process)
    run.send(first)
    if second:
        time.sleep(0.6 if second == first else 0)
        run.send(second)
    status = run.end()
    check(f"{what} ends all processes though a callback hangs", status == (-KILL if first == KILL else 128 + second)
          and wait_for_ends(children) and len(children) == 2, status, run.read("log"))
    check("the sound one by its destructors", run.read("sound.gone"), run.read("log"))

run = Run(TWO_SLOW).close("slow").begin()
run.wait("slow.entered", 1)
children = children_of(run.process)
run.send(KILL)
run.end()
check("as does SIGKILL during a constructor", wait_for_ends(children), run.read("log"))

# A child that was restarted, and was in its constructor, stopped the supervision of all others:
# deaths went unseen, and Ctrl-C killed sound processes, whose destructors never ran.
run = Run("containers:\n" + container("sound") + container("mortal")
          + container("slow", "    restart: {policy: always, delay: 1ms}\n")).begin()
run.wait("slow.ticks", 1)
run.close("slow")
sound, mortal, slow = children_of(run.process)
os.kill(slow, signal.SIGKILL)
run.wait("slow.entered", 2)
os.kill(mortal, signal.SIGKILL)
check("a death is seen while another process is in its constructor",
      run.wait("log", "process 'mortal_process' was ended by signal 9"), run.read("log"))
run.send(signal.SIGINT)
status = run.end()
check("Ctrl-C ends the sound process by its destructors", status == 1 and run.read("sound.gone"),
      status, run.read("log"))
check("and the one in its constructor by a signal", "killing process 'slow_process'"
      in run.read("log"), run.read("log"))

run = Run("containers:\n" + container("sound")
          + container("slow", "    restart: {policy: always, delay: 1ms}\n")).begin()
run.wait("slow.ticks", 1)
run.close("slow")
os.kill(children_of(run.process)[1], signal.SIGKILL)
run.wait("slow.entered", 2)
ticks = len(run.read("slow.ticks"))
run.open("slow")
check("when its constructor returns, it goes on", run.wait("slow.ticks", ticks + 3),
      run.read("log"))
run.send(signal.SIGINT)
status = run.end()
check("as if nothing had been", status == 0 and run.read("slow.gone"), status, run.read("log"))

# ---- Helpers ----

# A driver starts a process that keeps its output, and the connection to takt run: this waited for the end of that
# output, deaf to signals.
def with_helper(text, *words):
    run = Run(text, words)
    open(run.path("slow.helper"), "w").close()
    return run.begin()


run = with_helper(TWO_SLOW, "run", "FILE", "--duration", "200ms")
status = run.end()
check("a run ends though a component's child keeps its output open and writes", status == 0 and run.read("slow.gone"),
      status, run.read("log")[-500:])
run = with_helper(TWO_SLOW, "run", "FILE")
run.wait("slow.ticks", 3)
os.kill(children_of(run.process)[1], KILL)
check("a death is seen though a child of the process holds its connection",
      run.wait("log", "process 'slow_process' was ended by signal 9"), run.read("log")[-500:])
run.send(INT)
status = run.end()
check("and Ctrl-C ends the run", status == 1 and run.read("sound.gone"), status, run.read("log")[-500:])
run = with_helper(ONE, "compare", "FILE", "--executors", "events", "--duration", "200ms")
status = run.end()
check("so does a comparison", status == 0, status, run.read("log")[-500:])

# ---- SIGHUP ----

TWO = "containers:\n" + container("sound") + container("other")
for text in ("container:\n  name: one\n  components:\n" + component("sound"), TWO):
    run = Run(text, ("run", "FILE", "--json", "@result.json")).begin()
    run.wait("sound.ticks", 3)
    run.send(signal.SIGHUP)
    status = run.end()
    check("SIGHUP ends a run as SIGTERM does", status == 0 and run.read("sound.gone")
          and json.loads(run.read("result.json"))["runs"], status, run.read("log"))

run = Run(TWO, preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN)).begin()
run.wait("sound.ticks", 3)
run.send(signal.SIGHUP)
ticks = len(run.read("sound.ticks"))
run.wait("sound.ticks", ticks + 50)
check("but not under nohup", run.process.poll() is None and not run.read("sound.gone"))
run.send(signal.SIGTERM)
check("where SIGTERM does", run.end() == 0, run.read("log"))

# ---- Twice at once ----

# `timeout -s INT` sends the signal to the process and to its group: the second one killed.
for text in (ONE, TWO):
    run = Run(text, ("run", "FILE", "--json", "@result.json")).begin()
    run.wait("sound.ticks", 3)
    for _ in range(2):
        run.send(INT)
        time.sleep(0.002)
    status = run.end()
    check("the same signal twice at once is one", status == 0 and run.read("sound.gone")
          and json.loads(run.read("result.json"))["runs"], status, run.read("log"))

# ---- Comparisons ----

proved = proves("command_line.md", "Completed runs are shown and written, and the exit status is 130 (SIGINT)")
MANY = ("--duration", "200ms", "--repeat", "1000", "--json", "@result.json")
for words in (("compare", "FILE", "--executors", "events,single_threaded", *MANY),
              ("bench", "topologies", "FILE", *MANY)):
    run = Run("container:\n  name: one\n  components:\n" + component("sound"), words,
              start_new_session=True).begin()
    run.wait("sound.entered", 3)  # so two runs are complete
    os.killpg(run.process.pid, signal.SIGINT)  # as a terminal does
    status = run.end()
    said = run.read("log")
    result = json.loads(run.read("result.json") or "{}")
    rows = result.get("runs") or result.get("experiments")
    check(proved + f" (takt {words[0]})", status == 128 + signal.SIGINT and rows
          and "SIGINT came when " in said, status, said, rows)
    check("and ends the run that was under way by its destructors",
          len(run.read("sound.gone")) == len(run.read("sound.made")),
          run.read("sound.gone"), run.read("sound.made"))

# The run that was under way went on for as long as it was to last.
run = Run("container:\n  name: one\n  components:\n" + component("sound"),
          ("compare", "FILE", "--executors", "events", "--duration", "1h")).begin()
run.wait("sound.ticks", 3)
children = children_of(run.process)
run.send(KILL)
run.end()
check("SIGKILL of takt compare ends the run that was under way", wait_for_ends(children)
      and run.read("sound.gone"), run.read("log"))

# ---- The thread that receives them ----

def nices(process):
    """Of the threads of this name in a process and its children."""
    found = []
    for pid in (process.pid, *children_of(process)):
        for task in pathlib.Path(f"/proc/{pid}/task").iterdir():
            if (task / "comm").read_bytes() == b"signals\n":
                found.append(int(state_of(f"{pid}/task/{task.name}")[16]))
    return found


run = Run("threads: {signals: {nice: 5}}\ncontainers:\n" + container("sound") + container("other")).begin()
run.wait("sound.ticks", 3)
found = nices(run.process)
run.send(TERM)
run.end()
check("the file gives the thread its attributes, in each process", found == [5, 5, 5], found)

# ---- Names ----

pair = "    components: [{component: Witness, library: " + library + "}]\n"
run = Run("containers:\n  - name: a\n" + pair + "  - name: b\n" + pair).begin()
status = run.end()
check("two nodes that the code calls the same, in two processes, are an error of the file",
      status == 2 and "system.yaml:5: the node of 'Witness' is called '/witness', as that of "
      "'Witness' in " in run.read("log"), status, run.read("log"))

for run, by_itself in zip(patient, (-INT, 1)):
    status = run.end()
    check("one signal ends what hangs in a callback, too", status == by_itself, status, run.read("log"))
finish()
