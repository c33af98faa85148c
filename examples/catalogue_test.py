#!/usr/bin/env python3
# Each file of the catalogue behaves as its own comment says, under the virtual clock: what runs from when to when. Each has a card, and
# each that fits other files runs one.
# SPDX-License-Identifier: Apache-2.0
# usage: catalogue_test.py TAKT
import json
import os
import re
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
CARDS = os.path.join(HERE, "..", "docs", "reference", "catalogue.md")
PROMISE = re.compile(r"^# On (\d+) CPUs?, the first (\d+ m?s): (.*)$")


def takt(*words):
    done = subprocess.run([sys.argv[1], *words], capture_output=True, text=True, timeout=300)
    if done.returncode != 0:
        sys.exit(f"takt {' '.join(words)}: exit {done.returncode}\n{done.stderr}")
    return done.stdout


def promise(file):
    """CPUs, duration and schedule of the comment; None: it has none."""
    comment = []
    for line in open(file):
        if not line.startswith("#"):
            break
        comment.append(line.rstrip("\n"))
    text = comment[1] + "".join(line[3:] for line in comment[2:]) if len(comment) > 1 else ""
    found = PROMISE.match(text)
    return found and (found[1], found[2].replace(" ", ""), found[3].split(", "))


def schedule(file, cpus, duration):
    """As the comment writes it: a callback has the name of its node, unless that has several."""
    with tempfile.TemporaryDirectory() as folder:
        trace = os.path.join(folder, "trace.json")
        takt("simulate", file, "--cpus", cpus, "--phases", "equal", "--duration", duration, "--trace", trace, "--json", "-")
        events = json.load(open(trace))["traceEvents"]
    runs = sorted((event["ts"] / 1000, event["dur"] / 1000, event["name"][1:]) for event in events if "sequence" in event.get("args", {}))
    callbacks = {name for _, _, name in runs}

    def called(name):
        node = name.split("/")[0]
        return node if sum(each.split("/")[0] == node for each in callbacks) == 1 else name

    return [f"{called(name)} {begin:g}-{begin + length:g}" for begin, length, name in runs]


def check_schedules(files):
    without = []
    for word, file in files.items():
        takt("check", file)
        said = promise(file)
        if said is None:
            without.append(word)
            continue
        seen = schedule(file, said[0], said[1])
        if seen != said[2]:
            sys.exit(f"{file} promises\n  {', '.join(said[2])}\nbut what runs is\n  {', '.join(seen)}")
    if without != ["anytime"]:  # its code decides
        sys.exit(f"without a schedule: {without}")


def check_cards(files):
    cards = re.findall(r"^## `(\w+)`$", open(CARDS).read(), re.MULTILINE)
    if cards != sorted(files):
        sys.exit(f"docs/reference/catalogue.md has cards of {cards}, and there are {sorted(files)}")
    table = re.findall(r"^\| \[`(\w+)`\]", open(CARDS).read(), re.MULTILINE)
    if table != sorted(files):
        sys.exit(f"docs/reference/catalogue.md has a table of {table}, and there are {sorted(files)}")


def on_own_cpus(text):
    """The file with real-time threads that have CPUs of their own, as bounds need them."""
    thread = "{policy: SCHED_FIFO, priority: 50, affinity: [%d]}"
    for cpu, name in enumerate(re.findall(r"(\w+): {}", text)):
        text = text.replace(name + ": {}", name + ": " + thread % cpu)
    if "\nthreads:" not in text and "executors:" in text:
        executors = re.findall(r"(\w+): {type: \w+", text)
        names = [f"t{cpu}" for cpu in range(6 if "isolated" in text else len(executors))]
        for executor, mine in zip(executors, [names] if "isolated" in text else [[name] for name in names]):
            text = re.sub(rf"({executor}: {{)(type: \w+)", rf"\1threads: [{', '.join(mine)}], \2", text)
        text += "threads: {%s}\n" % ", ".join(f"{name}: {thread % cpu}" for cpu, name in enumerate(names))
    return text + "machine: {cpus: 8, exclusive: true, rt_runtime: unlimited}\n" + ("" if "\nchains:" in text else "chains: auto\n")


def has_bounds(file):
    with tempfile.NamedTemporaryFile("w", suffix=".yaml") as changed:
        changed.write(on_own_cpus(open(file).read()))
        changed.flush()
        analysed = json.loads(takt("analyze", changed.name, "--suggest", "off", "--allow-unbounded", "--json", "-"))
    return all(chain["bound_us"] is not None for chain in analysed["chains"]) and bool(analysed["chains"])


def check_bounds(files):
    """Those that the table says."""
    rows = re.findall(r"^\| \[`(\w+)`\].*\| (yes)? \|$", open(CARDS).read(), re.MULTILINE)
    for word, said in rows:
        if word != "anytime" and has_bounds(files[word]) != (said == "yes"):
            sys.exit(f"docs/reference/catalogue.md says that {word} has {'a' if said else 'no'} bound")


def check_others(files):
    """All that fit run another file; the list says why the rest do not."""
    robot = os.path.join(HERE, "03_robot", "robot.yaml")
    os.environ.pop("TAKT_COMPONENT_PATH", None)  # as where it is installed
    unfit = re.findall(r"^(\w+) .*; fits no other file: ", takt("list", "catalogue"), re.MULTILINE)
    compared = json.loads(takt("compare", robot, "--as", "all", "--simulate", "--duration", "1s", "--json", "-"))
    ran = {run["executor"]: {executor["type"] for executor in run["executors"]} for run in compared["runs"]}
    if sorted([*ran, *unfit]) != sorted(files):
        sys.exit(f"ran: {sorted(ran)}; unfit: {unfit}")
    for word, type_ in [("single", "single_threaded"), ("cie", "isolated"), ("picas", "chain_aware"), ("ros_rt", "preemptive")]:
        if ran[word] != {type_}:
            sys.exit(f"--as {word} ran {ran[word]}")


files = {name[: -len(".yaml")]: os.path.join(HERE, "catalogue", name) for name in sorted(os.listdir(os.path.join(HERE, "catalogue")))}
check_schedules(files)
check_cards(files)
check_bounds(files)
check_others(files)
