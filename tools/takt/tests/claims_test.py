#!/usr/bin/env python3
"""What docs/reference says is refused, is refused: claims_test.py TAKT

Each sentence there that says "is an error", "rejected", "exits with" or "exit status" has exactly one place that tries
it: a line in CLAIMS, which gives words of the sentence and how they are tried here, or proves() in another test (of
cmake/checks.py or testing/proves.hpp), which has the set-up for it. The page of the command line says all options, and
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
TALKER = ("container: {name: robot, components: [{component: takt::Workload, name: talker, parameters: "
          "{publishers: {topic: [talk], size_bytes: [1000], period_us: [1000]}}}]}\n")
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


def bad_file(*names):
    """Are in the collection of wrong files, each of which a test reads."""
    return lambda _: [check(f"{name} is in the collection", (ROOT / BAD / (name + ".txt")).is_file()) for name in names]


def full_disk(folder):
    """Records what a container says until its file may not grow."""
    path = folder / "talk.yaml"
    path.write_text(f"dds: {{domain: {environment['ROS_DOMAIN_ID']}, shared_memory: off}}\n" + TALKER, encoding="utf-8")
    talker = subprocess.Popen([takt, "run", str(path)], env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    done = subprocess.run(["sh", "-c", 'ulimit -f 64; exec "$0" bag record /talk -o full.mcap --duration 60s', takt], env=environment,
                          text=True, capture_output=True, timeout=100)
    talker.terminate()
    talker.wait(60)
    check("what was not recorded is an error", done.returncode == 1 and "were not recorded: File too large" in done.stderr, done)


def damaged_recording(folder):
    path = folder / "record.yaml"
    path.write_text(TALKER.replace("]}\n", ", {component: takt::Recorder, name: recorder, parameters: {file: whole.mcap}}]}\n"), encoding="utf-8")
    run("run", str(path), "--duration", "100ms")
    whole = pathlib.Path("whole.mcap").read_bytes()
    place = whole.index(b"Workload")  # the type's name, in the first chunk
    pathlib.Path("other.mcap").write_bytes(whole[:place] + b"w" + whole[place + 1:])
    pathlib.Path("cut.mcap").write_bytes(whole[:len(whole) // 2])
    run("bag", "info", "whole.mcap")
    check("its checksum differs", "its checksum differs" in run("bag", "info", "other.mcap", status=2).stderr)
    check("one that was cut off is shown", "cut.mcap" in run("bag", "info", "cut.mcap").stdout)


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


CLAIMS = {
    "configuration.md": [
        ("An unknown key is an error", bad_file("dds_unknown_key", "dds_loopback_only")),
        ("A duplicate key is an error", bad_file("key_twice")),
        ("it is an error to describe it", bad_file("mode_normal", "mode_changes_nothing", "mode_names_a_callback_twice",
                                                   "mode_of_several_processes")),
        ("SCHED_DEADLINE is an error", bad_file("dds_thread_with_reservation")),
        ("A file of the wrong kind is an error here", refused("check", "FILE", file=LIDAR + "dds: {security: {identity_ca: "
         "system.yaml, certificate: system.yaml, private_key: system.yaml, governance: system.yaml, permissions: system.yaml}}\n")),
        ("a topic that no component uses is an error", refused("run", "FILE", "--duration", "10ms", file=LIDAR +
                                                               "topics: {/none: {reliability: best_effort}}\n")),
        ("`futex` with file descriptors and `io_uring` with several", bad_file("executor_wait_io_uring_for_two_threads")),
        ("More threads than the type supports are an error", bad_file("executor_static_with_two_threads")),
        ("otherwise the file is rejected", refused("run", "FILE", "--duration", "10ms", file=LIDAR.replace(
            "name: lidar", "name: lidar, callbacks: {a_timer: {budget: 6ms}, b_timer: {budget: 6ms}}, parameters: {publishers: {topic: [a, b], "
            "period_us: [10000, 10000]}}"))),
    ],
    "preemptive.md": [
        ("inside the band is an error", refused("check", "FILE", file=LIDAR + "threads: {band: {policy: SCHED_FIFO, priority: 60..62, affinity: "
                                                "[0]}, log: {policy: SCHED_FIFO, priority: 61}}\n")),
    ],
    "command_line.md": [
        ("Exit 1: a chain missed its deadline.", refused("simulate", "FILE", "--duration", "1s", status=1, file=LIDAR.replace(
            "name: lidar", "name: lidar, parameters: {publishers: {topic: [a], period_us: [10000], work_us: [5000]}}") +
            "chains: [{name: c, deadline: 1ms, path: [lidar/a_timer]}]\n")),
        ("an error with several processes", refused("run", "FILE", "--composition", "per-node", "--transport", "intra", "--duration", "1ms",
         file=LIDAR.replace("name: lidar}", "name: lidar}, {component: takt::Workload, name: other}"))),
        ("if it cannot be loaded", refused("topic", "echo", "/none", "--library", "none.so")),
        ("if messages were not recorded", full_disk),
        ("A chunk whose checksum differs is an error", damaged_recording),
        ("Keys that the method does not read are errors", refused("rta", "np_fp", "FILE", file='{"tasks": [{"C": 1, "T": 9, "priority": 1, "Y": 3}]}')),
        ("Tasks that want more than the supply are an error", refused("rta", "np_fp", "FILE", file='{"tasks": [{"C": 9, "T": 2, "priority": 1}]}')),
        ("The exit status is 1 if a verdict is", doctor),
    ],
}


def places():
    """[(page, words, where)]: what tries the words, here and in other tests."""
    found = [(page, words, "CLAIMS") for page, lines in CLAIMS.items() for words, _ in lines]
    tests = (path for folder in ROOT.iterdir() if folder.is_dir() and folder.name not in (".git", "build")
             for path in folder.rglob("*_test.*"))
    for path in sorted(tests):
        for page, words in re.findall(r'\bproves\(\s*"(\w+\.md)",\s*((?:"[^"]*"\s*)+)\)', path.read_text(encoding="utf-8")):
            found.append((page, "".join(re.findall(r'"([^"]*)"', words)), path.relative_to(ROOT)))
    return found


def check_claims():
    tried = places()
    said = {}
    for page in sorted((ROOT / "docs/reference").rglob("*.md")):
        if page.name != "limits.md":  # is made from the code
            said[page.name] = [each for each in sentences(page.read_text(encoding="utf-8")) if CLAIM.search(each)]
    for page, claims in said.items():
        for each in claims:
            by = [str(where) for name, words, where in tried if name == page and words in each]
            check(f"{page}: one test tries: {each[:150]}", len(by) == 1, by)
    for page, words, where in tried:
        check(f"{where}: {page} says once: {words}", sum(words in each for each in said.get(page, [])) == 1)


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
    check_claims()
    for lines in CLAIMS.values():
        for _, tries in lines:
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
