#!/usr/bin/env python3
"""What docs/reference says is refused, is refused: claims_test.py TAKT

Each sentence there that says "is an error", "rejected", "exits with" or "exit status" has a line in CLAIMS: words that
stand in the sentence, and how the claim is tried: here, or by another test, whose name the line gives. A sentence
without a line fails, and so does a line whose sentence is gone. The page of the command line says all options, and
their defaults, as --help does.

SPDX-License-Identifier: Apache-2.0
"""
import functools
import json
import os
import pathlib
import re
import subprocess
import tempfile

from command import environment, run, takt
from checks import check, finish

ROOT = pathlib.Path(__file__).resolve().parents[3]
CLAIM = re.compile(r"\b(?:is|are)(?: also)? (?:an )?errors?\b|\bis rejected\b|\bare rejected\b|\ban error with\b|\bexits? (?:with|0|1|2)\b|\bexit status\b",
                   re.IGNORECASE)
BAD = "containers/testdata/bad/"
LIDAR = "container: {name: robot, components: [{component: takt::Workload, name: lidar}]}\n"


def sentences(text):
    """Of a page, without its code blocks and headings; a cell of a table ends a sentence, too."""
    text = re.sub(r"^```.*?^```|^#.*?$|^    .*?$", "\n", text, flags=re.DOTALL | re.MULTILINE)
    for part in re.split(r"\n\s*\n|\n- |\|", text):
        yield from re.split(r"(?<=[.;:]) (?=[A-Z`])", " ".join(part.split()))


def refused(*words, file=None, status=2):
    """Runs the command on a file of this content: it must end with the status and say why."""
    def claim(folder):
        path = folder / "system.yaml"
        path.write_text(file or LIDAR, encoding="utf-8")
        done = run(*(str(path) if word == "FILE" else word for word in words), status=status)
        check("and says why", done.stderr != "" or status == 1, done.stderr)
    return claim


def bad_file(name):
    """Is in the collection of wrong files, each of which a test reads."""
    return lambda _: check(f"{name} is in the collection", (ROOT / BAD / (name + ".txt")).is_file())


def tested(path, name):
    """Another test tries it: these words stand in that file."""
    return lambda _: check(f"{path}: {name}", name in (ROOT / path).read_text(encoding="utf-8"))


def doctor(folder):
    findings = json.loads(run_any("doctor", "--json", "-")[1])["findings"]
    bad = any(finding["verdict"] == "bad" for finding in findings)
    check("takt doctor says by its status whether a verdict is BAD", run_any("doctor")[0] == int(bad))
    status, script = run_any("doctor", "--script")
    listed = set(re.findall(r"(?m)^# ([^:#]+): ", script)) - {"by hand"}
    # Whether others have run just now changes between two looks.
    wanted = {finding["what"] for finding in findings if finding["verdict"] != "good"} | {"other real-time threads"}
    check("--script has what is not good, and no more", listed | {"other real-time threads"} == wanted, listed, wanted)
    check("with the same status", status == int(bad), status)
    parsed = subprocess.run(["sh", "-n"], input=script, text=True, capture_output=True)
    check("it is a script", script.startswith("#!/bin/sh\n") and parsed.returncode == 0, parsed.stderr, script)


def run_any(*words):
    done = subprocess.run([takt, *words], env=environment, text=True, capture_output=True, timeout=60)
    return done.returncode, done.stdout


PY = "tools/takt/tests/"
CLAIMS = {
    "configuration.md": [
        ("An unknown key is an error", bad_file("dds_unknown_key")),
        ("one that an earlier version had is an error", bad_file("dds_loopback_only")),
        ("A duplicate key is an error", bad_file("key_twice")),
        ("SCHED_DEADLINE is an error", bad_file("dds_thread_with_reservation")),
        ("A file of the wrong kind is an error here", refused("check", "FILE", file=LIDAR + "dds: {security: {identity_ca: "
         "system.yaml, certificate: system.yaml, private_key: system.yaml, governance: system.yaml, permissions: system.yaml}}\n")),
        ("a topic that no component uses is an error", refused("run", "FILE", "--duration", "10ms", file=LIDAR +
                                                               "topics: {/none: {reliability: best_effort}}\n")),
        ("if it loses, repeats or invents callbacks", tested("sched/scheduler_check_test.cpp", "Loses")),
        ("`futex` with file descriptors and `io_uring` with several", bad_file("executor_wait_io_uring_for_two_threads")),
        ("More threads than the type supports are an error", bad_file("executor_static_with_two_threads")),
        ("otherwise the file is rejected", refused("run", "FILE", "--duration", "10ms", file=LIDAR.replace(
            "name: lidar", "name: lidar, callbacks: {a_timer: {budget: 6ms}, b_timer: {budget: 6ms}}, parameters: {publishers: {topic: [a, b], "
            "period_us: [10000, 10000]}}"))),
    ],
    "rclcpp_build.md": [
        ("or one that was found before, is an error", tested("rclcpp/cmake/build_test.py", "a ROS 2 that was found before is refused")),
        ("for every type support of C++", tested("rclcpp/cmake/build_test.py", "there are none in C or Python")),
    ],
    "command_line.md": [
        ("The exit status is 1 if that of the program", tested("rclcpp/run_test.py", "its status is an error")),
        ("The exit status is 1 if one is missing", tested(PY + "system_test.py", "the others continue, and so does the exit status")),
        ("everything created so far is destroyed in order", tested(PY + "signals_test.py", "one that returns in time is destroyed")),
        ("an error with several processes", refused("run", "FILE", "--composition", "per-node", "--transport", "intra", "--duration", "1ms",
         file=LIDAR.replace("name: lidar}", "name: lidar}, {component: takt::Workload, name: other}"))),
        ("Containers that do not answer", tested(PY + "ros2_commands_test.py", 'run("component", "list", status=1)')),
        ("If a container does not answer within 5 s, it is drawn", tested(PY + "ros2_commands_test.py", 'run("graph", "--json", "-", status=1)')),
        ("Nodes that do not answer", tested(PY + "ros2_commands_test.py", 'run("lifecycle", "list", status=1)')),
        ("if it cannot be loaded", refused("topic", "echo", "/none", "--library", "none.so")),
        ("or a node does not answer", tested(PY + "ros2_commands_test.py", '"param", "list", "/mute"')),
        ("If a parameter cannot be set", tested(PY + "ros2_commands_test.py", "str(file), status=1)")),
        ("aborted or canceled, or the server goes", tested(PY + "ros2_commands_test.py", 'goal("{order: 10}", status=1)')),
        ("The exit status is 1 if a package does not build", tested("rclcpp/cmake/build_test.py", "a package that does not build is named")),
        ("if messages were not recorded", tested("components/recorder_test.cpp", "not recorded: File too large")),
        ("A chunk whose checksum differs is an error", tested(PY + "bag_test.py", "checksum")),
        ("or none of a given name", tested(PY + "top_test.py", "without a container one sentence says so")),
        ("Completed runs are shown and written", tested(PY + "signals_test.py", "compare")),
        ("Exit 0 if there are chains", tested(PY + "analyze_test.py", "a guarantee")),
        ("exit 0 unless a chain is", tested(PY + "analyze_test.py", " is not allowed")),
        ("Keys that the method does not read are errors", refused("rta", "np_fp", "FILE", file='{"tasks": [{"C": 1, "T": 9, "priority": 1, "Y": 3}]}')),
        ("Tasks that want more than the supply are an error", refused("rta", "np_fp", "FILE", file='{"tasks": [{"C": 9, "T": 2, "priority": 1}]}')),
        ("The exit status is 1 if a verdict is", doctor),
        ("The exit status is 1 if a figure is `WRONG`", tested("tools/takt/selftest/findings_test.cpp", "SeeAStatisticThatIsWrong")),
    ],
    "rclcpp.md": [
        ("A file that exists is an error", tested("rclcpp/program_test.cpp", "the file exists, and is not overwritten")),
        ("A name of the file that nobody has is an error", tested("rclcpp/program_test.cpp", "ANameThatNobodyHasIsAnError")),
    ],
}


def check_tables(page):
    """Tables of callbacks in a page have what a run prints: the columns, and none of messages for a timer."""
    for block in re.findall(r"^```.*?^```", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE):
        columns = []
        for line in block.splitlines():
            if re.search(r"\bkind +received\b", line):
                columns = line.split()
            cells = line.split()
            if columns and "timer" in cells and "timer" == cells[columns.index("kind")]:
                kept = {name: cells[columns.index(name)] for name in ("lost", "dropped", "late", "too_late")
                        if name in columns and len(cells) > columns.index(name)}
                check(f"{page.name}: a timer has neither {', '.join(kept)}: {line[:60]}", set(kept.values()) <= {"-", "…"}, kept)


@functools.cache
def ask_help(*words):
    return run_any(*words, "--help")


def help_of(words):
    """Of the command, or of its subcommand, that these words call."""
    for count in (2, 1):
        status, text = ask_help(*(word for word in words[:count] if word.isidentifier()))
        if status == 0:
            return text
    return ""


def check_commands(page):
    """Options in the examples of a page are those of the command."""
    for line in re.findall(r"^\s*(?:\$ )?takt +([a-z][^\n#|&>]*)", page.read_text(encoding="utf-8"), re.MULTILINE):
        words = [word.rstrip(",.;:)`").split("=")[0] for word in line.split()]
        options = [word for word in words if re.fullmatch(r"--[a-z][\w-]+", word)]
        if options:
            text = help_of(words)
            missing = [option for option in options if not re.search(rf"(?<![\w-]){option}(?![\w-])", text)]
            check(f"{page.name}: takt {line.strip()[:90]}", not missing, missing)


def options_of(words):
    """{a name of each option of the command: (all its names, its line of --help)}, those of its subcommands, too."""
    text = ask_help(*words)[1]
    known = {}
    part = re.search(r"^options:\n(.*?)(?:\n\n|\Z)", text, re.DOTALL | re.MULTILINE | re.IGNORECASE)
    for line in re.split(r"\n(?=  -)", part[1]) if part else []:
        names = re.findall(r"(?<![\w-])--?[A-Za-z][\w-]*(?=[, ]|$)", re.split(r"\s{2,}", line.strip())[0])
        known.update({each: (names, " ".join(line.split())) for each in names})
    part = re.search(r"^Subcommands:\n(.*?)(?:\n\n|\Z)", text, re.DOTALL | re.MULTILINE)
    for subcommand in re.findall(r"^  (\w+)", part[1], re.MULTILINE) if part else []:
        known.update(options_of((*words, subcommand)))
    return known


def check_options(page):
    """The page has each option of each command by one of its names, no other, and the defaults of --help."""
    sections = {}
    for title, body in re.findall(r"^## (takt .*?)\n(.*?)(?=^## |\Z)", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL):
        for command in dict.fromkeys(re.findall(r"takt (\w+)", title)):
            sections[command] = sections.get(command, "") + title + body
    for command, text in sections.items():
        known = options_of((command,))
        said = set(re.findall(r"(?<![\w-])(--[a-z][\w-]*|-[A-Za-z](?![\w-]))", text))
        silent = {names[-1] for names, _ in known.values() if not said & set(names)} - {"--help", "--force"}
        check(f"{page.name} says all options of takt {command}", not silent, sorted(silent))
        for option, default in re.findall(r"^\| `(--?[\w-]+).*default: `?(\d\w*)", text, re.MULTILINE):
            check(f"takt {command} --help: the default of {option} is {default}",
                  option in known and re.search(rf"(?:\(|=|default: ){default}\b", known[option][1]), known.get(option))


def removed_options():
    """Of the table in the code: (command, option, what to write instead)."""
    text = (ROOT / "containers/configuration/removed.hpp").read_text(encoding="utf-8")
    return re.findall(r'Removed\{"takt (\w+)",\s*"(--[\w-]+)",\s*"([^"]*)"', text)


with tempfile.TemporaryDirectory() as name:
    os.chdir(name)
    for page in sorted((ROOT / "docs/reference").rglob("*.md")):
        if page.name == "limits.md":  # is made from the code
            continue
        lines = CLAIMS.get(page.name, [])
        claims = [each for each in sentences(page.read_text(encoding="utf-8")) if CLAIM.search(each)]
        for claim in claims:
            check(f"{page.name}: a line of this test tries: {claim[:150]}", any(words in claim for words, _ in lines))
        for words, tries in lines:
            check(f"{page.name} says: {words}", any(words in claim for claim in claims))
            tries(pathlib.Path(name))
    for page in (ROOT / "docs").glob("*/*.md"):
        check_tables(page)
        check_commands(page)
    check_commands(ROOT / "README.md")
    check_options(ROOT / "docs/reference/command_line.md")
    removed = removed_options()
    check("the table of what was removed is read", len(removed) >= 2, removed)
    for command, option, instead in removed:
        wrong = run(command, "system.yaml", option, "value", status=2).stderr
        check(f"{option} names its replacement in one line",
              wrong == f"takt: '{option}' was removed from takt {command}; {instead}\n", wrong)
finish()
