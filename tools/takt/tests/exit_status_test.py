#!/usr/bin/env python3
"""One exit status says one thing in every command: those of `takt help exit-status`.

usage: exit_status_test.py TAKT WITNESS_LIBRARY
SPDX-License-Identifier: Apache-2.0
"""
import concurrent.futures
import os
import re
import signal
import subprocess
import sys
import tempfile
import time

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../cmake"))
from checks import check, environment, eventually, finish, proves  # noqa: E402

takt, library = map(os.path.abspath, sys.argv[1:])
folder = tempfile.TemporaryDirectory(prefix="takt_exit_status_")
os.chdir(folder.name)
environment = {**environment, "WITNESS": folder.name}
for name, component in (("good", f"component: Witness, library: {library}"), ("wrong", "component: Nobody")):
    with open(f"{name}.yaml", "w") as file:
        file.write("container:\n  components:\n      - {%s}\n" % component)
with open("simulated.yaml", "w") as file:
    file.write("machine: {cpus: 1}\nchains: [{name: c, deadline: 1s, path: [driver/imu_timer]}]\ncontainer:\n  components:\n    - {component: takt::Workload, "
               "name: driver, parameters: {publishers: {topic: [imu], period_us: [1000]}}}\n")
with open("endless.yaml", "w") as file:  # two relays, in no time
    file.write("machine: {cpus: 1}\ncontainer:\n  components:\n    - {component: takt::Workload, name: driver, parameters: "
               "{publishers: {topic: [a], period_us: [1000]}, relays: {input: [a, b], output: [b, a], work_us: [0, 0]}}}\n")
# A definition that is wrong: `interface show` said 2, what sends and calls said 1.
for kind, text in (("msg", "Loop a\n"), ("srv", "bad/Loop a\n---\n"), ("action", "bad/Loop a\n---\n---\n")):
    os.makedirs(f"share/bad/{kind}")
    with open(f"share/bad/{kind}/Loop.{kind}", "w") as file:
        file.write(text)
environment["AMENT_PREFIX_PATH"] = folder.name


def start(*words, **options):
    return subprocess.Popen([takt, *words], env=environment, text=True, stdin=subprocess.DEVNULL,
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, **options)


def status_of(words):
    with start(*words) as process:
        said = process.communicate(timeout=200)[0]
        return process.returncode, said


# Of each command: what it can do, what it cannot, and what is wrong with the words or a file.
COMMANDS = {
    "action": (["list"], ["info", "/nowhere"], ["info"]),
    "analyze": (None, ["good.yaml"], ["nowhere.yaml"]),
    "bag": (None, None, ["info", "nowhere.mcap"]),
    "bench": (None, None, ["nothing"]),
    "bundle": (None, None, ["nowhere.tar.zst"]),
    "callback": (None, ["set", "nowhere", "a/b", "priority=1"], ["set", "nowhere", "a/b", "priority"]),
    "check": (["good.yaml"], None, ["wrong.yaml"]),
    "compare": (None, None, ["nowhere.yaml"]),
    "component": (["types"], ["list", "/nowhere"], ["load"]),
    "doctor": (None, None, ["--what"]),
    "help": (["exit-status"], None, ["nothing"]),
    "interface": (["show", "std_msgs/msg/String"], None, ["show", "nothing"]),
    "latency": (["-D", "10ms", "--executor", "none"], None, ["-a", "5000"]),
    "lifecycle": (["nodes"], ["get", "/nowhere"], ["set"]),
    "list": (["executors"], None, ["nothing"]),
    "model": (None, None, ["nowhere.json"]),
    "new": (["my_robot"], None, ["My Robot"]),
    "node": (["list"], ["info", "/nowhere"], ["info"]),
    "param": (["list"], ["get", "/nowhere", "a"], ["load", "/nowhere", "nowhere.yaml"]),
    "graph": (["good.yaml"], ["nowhere"], ["wrong.yaml"]),
    "plan": (["good.yaml"], None, ["wrong.yaml"]),
    "random": (["--seed", "1"], None, ["--seed", "a"]),
    "reference": (["config"], None, ["nothing"]),
    "ros2": (["prefix"], None, ["build", "nowhere"]),
    "rta": ([], None, ["np_fp", "nowhere.json"]),
    "run": (["good.yaml", "--duration", "10ms"], None, ["wrong.yaml"]),
    "selftest": (None, None, ["--duration", "1h"]),
    "service": (["list"], ["call", "/nowhere", "std_srvs/srv/Empty"], ["call"]),
    "simulate": (None, None, ["nowhere.yaml"]),
    "top": (None, ["nowhere"], ["--interval", "5"]),
    "topic": (["list"], ["echo", "/nowhere"], ["pub", "/a", "std_msgs/msg/String", "{nothing: 1}"]),
    "trace": (None, ["stop", "nowhere", "-o", "t.json"], ["stop", "nowhere"]),
}
status, text = status_of(["--help"])
listed = set(re.findall(r"^  (\w+)  ", text[text.index("Subcommands"):], re.M))
check("each command is tried", listed == set(COMMANDS), listed ^ set(COMMANDS))

tried = [(expected, [command, *words]) for command, cases in COMMANDS.items()
         for expected, words in enumerate(cases) if words is not None]
tried += [(2, [command, "--no-such-option"]) for command in COMMANDS]
tried += [(0, [command, "--help"]) for command in COMMANDS] + [(0, ["--version"]), (2, []), (2, ["nothing"])]
tried += [(2, ["simulate", "good.yaml", "--runs", "10001", "--json", "-"]), (2, ["run", "good.yaml", "--json", "no/folder"]), (2, ["plan", "good.yaml", "--json", "no/folder"]),
          (2, ["interface", "show", "bad/msg/Loop"]), (2, ["topic", "pub", "/a", "bad/msg/Loop", "{}"]),
          (2, ["service", "call", "/a", "bad/srv/Loop"]),
          (2, ["action", "send_goal", "/a", "bad/action/Loop", "{}"]), (1, ["plan", "good.yaml", "--json", "/dev/full"]),
          (1, ["run", "good.yaml", "--duration", "10ms", "--json", "/dev/full"])]
with concurrent.futures.ThreadPoolExecutor(4) as pool:
    for (expected, words), (status, said) in zip(tried, pool.map(lambda each: status_of(each[1]), tried)):
        check(f"takt {' '.join(words)}: {expected}", status == expected, status, said)


# A shell has 128 + the number for what a signal has ended.
def ended_by(number, process):
    process.send_signal(number)
    said = process.communicate(timeout=100)[0]
    return 128 - process.returncode if process.returncode < 0 else process.returncode, said


def runs():
    return os.path.exists("witness.ticks")


EVERY_SECOND = ("topic", "pub", "/a", "std_msgs/msg/Empty", "--rate", "10")
for words, is_bounded in ((("run", "good.yaml"), False), (("run", "good.yaml", "--duration", "1h"), True),
                          (("compare", "good.yaml", "--duration", "1h"), True)):
    for number in (signal.SIGINT, signal.SIGTERM):
        if runs():
            os.remove("witness.ticks")
        process = start(*words)
        check("it runs", eventually(runs))
        status, said = ended_by(number, process)
        check(f"{number.name} to takt {' '.join(words)}", status == (128 + number if is_bounded else 0), status, said)
# In a simulation, of which some runs are complete by then, or none.
for claim, words in (
        (proves("command_line.md", "Ctrl-C ends it in the middle of a run, and shows the runs before, without `--trace`; the exit status is then 130."),
         ("simulate", "simulated.yaml", "--runs", "1000000")),
        (proves("command_line.md", "Ctrl-C ends the simulation in the middle of a run: the analysis counts those before, and the exit status is 130."),
         ("analyze", "simulated.yaml", "--simulate", "1000000", "--suggest", "off"))):
    process = start(*words)

    def has_worked():
        with open(f"/proc/{process.pid}/stat") as stat:
            return int(stat.read().rsplit(")", 1)[1].split()[11]) > os.sysconf("SC_CLK_TCK")

    check("it simulates", eventually(has_worked))
    status, said = ended_by(signal.SIGINT, process)
    check(claim, status == 130 and re.search(r"^c .* [0-9]", said, re.M) and
          re.search(r"SIGINT came when [1-9][0-9]* of 1000000 (simulated )?runs were complete", said), status, said)
process = start("simulate", "simulated.yaml", "--duration", "10000h")
check("it simulates", eventually(has_worked))
begin = time.monotonic()
status, said = ended_by(signal.SIGTERM, process)
check("SIGTERM ends takt simulate in a run, as soon", status == 143 and "SIGTERM came when 0 of 1 run" in said and
      time.monotonic() - begin < 10, status, said, time.monotonic() - begin)
status, said = status_of(("simulate", "endless.yaml"))
check("a simulation without end ends", status == 2 and "executions and arrivals in a second" in said, status, said)
for words, is_bounded in ((("bag", "record", "--all"), False), (("bag", "record", "--all", "--duration", "1h"), True)):
    process = start(*words)
    check("it records", "Ctrl-C ends it" in process.stdout.readline())
    status, said = ended_by(signal.SIGINT, process)
    check(f"SIGINT to takt {' '.join(words)}", status == (130 if is_bounded else 0), status, said)
pub = start(*EVERY_SECOND)
for words, is_bounded in ((("topic", "echo", "/a"), False), (("topic", "echo", "/a", "-n", "1000000"), True),
                          (("topic", "hz", "/a"), False), (("topic", "hz", "/a", "--duration", "1h"), True)):
    process = start(*words)
    check("it receives", process.stdout.readline() != "")
    status, said = ended_by(signal.SIGINT, process)
    check(f"SIGINT to takt {' '.join(words)}", status == (130 if is_bounded else 0), status, said)
status, said = ended_by(signal.SIGINT, pub)
check("SIGINT to takt topic pub --rate", status == 0, status, said)
finish()
