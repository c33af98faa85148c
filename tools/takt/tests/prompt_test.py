#!/usr/bin/env python3
"""The prompt, as people meet it: mistakes end with 2 and one line, a terminal gets colour and a sign of life, files that are
not of Takt are not shown, and a new project is written once.

usage: prompt_test.py TAKT WITNESS_LIBRARY
"""
# SPDX-License-Identifier: Apache-2.0
import os
import pathlib
import pty
import re
import select
import subprocess
import sys
import tempfile
import time

from command import run, takt
from checks import check, environment, finish

witness = pathlib.Path(sys.argv[2]).resolve()
SECRET = "hunter2"
SECRETS = {  # files that a careless word names
    "shadow": f"root:{SECRET}:19000:0:99999:7:::\nbin:{SECRET}:19000:0:99999:7:::\n",
    "id_rsa": f"-----BEGIN OPENSSH PRIVATE KEY-----\n{SECRET}\n-----END OPENSSH PRIVATE KEY-----\n",
    "passwords.yaml": f"{SECRET}: {SECRET}\nother: {SECRET}\n",
    "token.json": f'{{"{SECRET}": "{SECRET}"}}',
    "env": f"TOKEN={SECRET}\n",
    "broken.json": f'{{"a": "{SECRET}',
    "binary": f"\x7fELF\x02{SECRET}",
}
READERS = (["check", "FILE"], ["check", "--construct", "FILE"], ["run", "FILE"], ["plan", "FILE"], ["analyze", "FILE"],
           ["compare", "FILE"], ["list", "schedulers", "FILE"], ["rta", "fp", "FILE"], ["model", "FILE"],
           ["bag", "info", "FILE"], ["analyze", "--model", "FILE", "idle.yaml"])
IDLE = "container: {components: [{component: takt::Workload, name: idle}]}\n"


def on_a_terminal(*words, seconds=20, **variables):
    """What the command writes on a terminal that is its stderr."""
    ours, theirs = pty.openpty()
    child = subprocess.Popen([takt, *words], env=environment | {"TERM": "xterm"} | variables, stdin=subprocess.DEVNULL,
                             stdout=subprocess.DEVNULL, stderr=theirs)
    os.close(theirs)
    text, end = b"", time.monotonic() + seconds
    while time.monotonic() < end:
        if not select.select([ours], [], [], 0.2)[0]:
            continue
        try:
            text += os.read(ours, 65536)
        except OSError:  # nobody has the other end any more
            break
    child.kill()
    child.wait()
    os.close(ours)
    return text.decode(errors="replace")


def check_mistakes():
    for words in ([], ["runn"], ["--verison"], ["topic"], ["topic", "ecko"], ["check"], ["run", "idle.yaml", "more"],
                  ["run", "idle.yaml", "--duration", "5"], ["compare", "idle.yaml", "--repeat", "0"], ["help", "rnu"],
                  ["list", "schedulerz"], ["latency", "-b", "-5"], ["topic", "hz", "/a", "--window", "0"], ["help", "run", "x"],
                  ["latency", "--tracemark"], ["latency", "--histfile", "h"], ["bench", "latncy"], ["run", "--executor"],
                  ["run", "idle.yaml", "--"], ["run", "--"], ["compare", "idle.yaml", "--"], ["graph", "idle.yaml", "-o", ""]):
        wrong = run(*words, status=2)
        check("one line says what to do", re.fullmatch(r"takt: [^\n]+; [^\n]+\n", wrong.stderr), wrong.stderr)
    check("help is help", run("help", "topic", "echo").stdout.startswith("Prints each message\nUsage: takt topic echo "))
    check("without a command, too", "Subcommands:" in run("help").stdout)
    notes = run("latency", *"-n -A 100 --secaligned --smi -R -M -o 10 --mainaffinity 0 --spike 100 -F fifo --laptop --priospread"
                .split(), "-l", "10", "-q", "--executor", "none", "-c", "1", "-s").stderr
    check("options of an old cyclictest are ignored with a note", "note: -n,--nanosleep is history" in notes, notes)
    check("as are those of today's that Takt needs not", all(f"{name} does nothing here: " in notes for name in (
        "-A,--aligned", "--secaligned", "--smi", "-R,--resolution", "-M,--refresh_on_max", "-o,--oscope", "--mainaffinity",
        "--spike", "-F,--fifo")), notes)


def check_terminal():
    red = on_a_terminal("runn")
    check("a terminal has colour", red.startswith("\x1b[31mtakt:\x1b[0m takt has no command"), red)
    plain = on_a_terminal("runn", NO_COLOR="1")
    check("NO_COLOR is obeyed", "\x1b" not in plain, plain)
    check("a pipe has none", "\x1b" not in run("runn", status=2).stderr)
    life = on_a_terminal("lifecycle", "get", "/nobody")
    check("a command that waits shows it", "looking for it on the DDS domain, " in life, life)
    life = on_a_terminal("run", "idle.yaml", "--duration", "3s")
    check("a run says what is left", re.search(r"\d s of 3 s, \d s left", life), life)
    life = on_a_terminal("compare", "idle.yaml", "--executors", "events,static_single_threaded", "--duration", "1s", seconds=60)
    check("a comparison, too", re.search(r"1 of 2: events.*, \d+ s left", life) and "2 of 2: " in life, life)
    life = on_a_terminal("latency", "-D", "1", "--executor", "none")
    check("latency writes over its own lines", "\x1b[1A" in life and "u001b" not in life, life)


def check_files():
    for name, content in SECRETS.items():
        pathlib.Path(name).write_text(content, encoding="utf-8")
        for words in READERS:
            done = subprocess.run([takt, *(name if word == "FILE" else word for word in words)], env=environment, text=True,
                                  capture_output=True, timeout=60, stdin=subprocess.DEVNULL)
            check(f"{' '.join(words)}: {name} is refused", done.returncode in (1, 2) and name in done.stderr, done.stderr)
            check("and not shown", SECRET not in done.stderr + done.stdout, done.stderr, done.stdout)


def check_construction():
    wrong = IDLE.replace("name: idle", "name: idle, parameters: {no_such: 1}")
    pathlib.Path("wrong.yaml").write_text(wrong, encoding="utf-8")
    run("check", "wrong.yaml")  # only its constructor knows its parameters
    said = run("check", "--construct", "wrong.yaml", status=2).stderr
    check("which --construct finds, with its line", said.startswith("wrong.yaml:1: ") and "no_such" in said, said)
    check("and what is right is valid", "valid: 1 component" in run("check", "--construct", "idle.yaml").stdout)
    pathlib.Path("groups.yaml").write_text("""
machine: {cpus: [0], rt_runtime: 950ms}
threads: {t: {policy: SCHED_DEADLINE, runtime: 3ms, period: 10ms}}
executors: {e: {type: isolated, per: group, threads: [t]}}
container: {components: [{component: takt::Workload, name: x, executor: e, parameters: {relays: {input: [a, b, c, d], output: [b, c, d, f]}}}]}
""", encoding="utf-8")
    check("how many groups there are the file does not say", "--construct counts them" in run("check", "groups.yaml").stderr)
    said = run("check", "--construct", "groups.yaml", status=2).stderr
    check("and --construct refuses what the analysis would", "SCHED_DEADLINE threads reserve 1.2 CPUs, of 0.95" in said, said)
    apart = ("dds: {discovery: off}\ncontainers:\n"
             "  - {name: p, components: [{component: takt::Workload, name: a, parameters: {publishers: {topic: [x], period_us: [9000]}}}]}\n"
             "  - {name: q, components: [{component: takt::Workload, name: b, parameters: {subscriptions: {topic: [x]}}}]}\n")
    pathlib.Path("apart.yaml").write_text(apart, encoding="utf-8")
    for command in (["check", "--construct"], ["analyze"], ["simulate"]):
        said = run(*command, "apart.yaml", status=2).stderr
        check(f"{command[0]} knows that processes do not find each other", "apart.yaml:1: " in said and "`discovery: off`" in said, said)
    begin = time.monotonic()
    said = run("run", "apart.yaml", "--duration", "1s", status=1).stderr
    check("and run does not wait for them", "`discovery: off`" in said and time.monotonic() - begin < 8, said)
    recorder = IDLE.replace("]}", ", {component: takt::Recorder, parameters: {file: kept.mcap}}]}")
    pathlib.Path("recorder.yaml").write_text(recorder, encoding="utf-8")
    run("run", "recorder.yaml", "--duration", "100ms")
    before, listed = pathlib.Path("kept.mcap").read_bytes(), sorted(os.listdir())
    for command in (["check", "--construct"], ["analyze"], ["plan"], ["graph"]):
        run(*command, "recorder.yaml", *(["--allow-unbounded"] if command == ["analyze"] else []))
        check(f"{command[0]} constructs, and writes nothing", pathlib.Path("kept.mcap").read_bytes() == before)
    check("and no new file", sorted(os.listdir()) == listed, os.listdir())
    text = f"container: {{components: [{{component: Witness, library: {witness}, name: ends}}]}}\n"
    pathlib.Path("ends.yaml").write_text(text, encoding="utf-8")
    environment["WITNESS"] = os.getcwd()
    run("check", "--construct", "ends.yaml")
    pathlib.Path("ends.exit").touch()
    begin = time.monotonic()
    said = run("check", "--construct", "ends.yaml", status=2).stderr
    check("a constructor that exits is an error", "a constructor may throw, but not exit" in said, said)
    check("and its own children are not waited for", time.monotonic() - begin < 10)
    for command in ("plan", "graph", "analyze"):  # they ended with 0, and printed nothing
        said = run(command, "ends.yaml", status=1).stderr
        check(f"takt {command} says so, too", said.count("\n") == 1 and "the constructor of 'ends' called exit()" in said, said)


def check_new():
    said = run("new", "my_robot").stdout
    files = {str(path.relative_to("my_robot")) for path in pathlib.Path("my_robot").rglob("*") if path.is_file()}
    check("a project is written", files == {"CMakeLists.txt", "my_robot.yaml", "msg/Reading.msg", "src/monitor.cpp",
                                            "src/sensor.cpp"}, files, said)
    text = "".join(pathlib.Path("my_robot", file).read_text(encoding="utf-8") for file in files)
    check("no mark is left in it", "@" not in text, text)
    check("a folder that exists is refused", "exists" in run("new", "my_robot", status=2).stderr)
    for name in ("", "../up", "Robot", "7up", "a__b", "std", "sensor", "takt"):
        run("new", name, status=2)
    for name in ("and", "time", "linux", "std_msgs", "module", "null"):  # that C++, libc, ROS, IDL or YAML know
        run("new", name)
        text = pathlib.Path(name, "src/sensor.cpp").read_text(encoding="utf-8")
        check("the name alone is no name in C++", not re.search(rf"(namespace |[ (]){name}( |::)", text), text)


with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    pathlib.Path("idle.yaml").write_text(IDLE, encoding="utf-8")
    check_mistakes()
    check_terminal()
    check_files()
    check_construction()
    check_new()
    os.chdir("/")
finish()
