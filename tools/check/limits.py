#!/usr/bin/env python3
"""The page of limits, from a marker at each constant.

    // Limit: what it bounds. At it: what happens then. Seen: the counter, or where else it shows.
    constexpr std::size_t kMostPeers = 100;

usage: limits.py > docs/reference/limits.md    (./dev check compares)
SPDX-License-Identifier: Apache-2.0
"""
import pathlib
import re
import subprocess
import sys

import files as file_rules

PAGE = "docs/reference/limits.md"
CONSTANT = re.compile(r"^(?P<comment>(?:[ \t]*//[^\n]*\n)*)[ \t]*(?:static |inline )*constexpr [\w:<>]+ "
                      r"(?P<name>k(?:Most|Max)\w*) = (?P<value>[^;]+);", re.MULTILINE)
MARKER = re.compile(r"Limit: (?P<what>.+?)\. At it: (?P<then>.+?)\. Seen: (?P<seen>.+?)\.$")
# Their records and rounds are not what a user meets; their tests know them.
WITHOUT = ("executors/engine/", "executors/sequences/", "analysis/textbook/", "testing/")
HEAD = """\
# Limits

Every queue, loop and table has a limit. This page has each of them, what happens at it, and where you see that it was
reached. It is made from the markers at the constants: `tools/check/limits.py > docs/reference/limits.md`.

What is not here is limited by the file or the code of a system: the `depth` of a topic, the loans of a publisher, the threads of an
executor. Messages that a full queue drops are counted in the column `dropped`.
"""
TAIL = """
## What wakes an idle process

Executors sleep until there is something to run: an idle process without DDS does not wake at all. With DDS:

| what | thread | wake-ups a second |
|---|---|---|
| Cyclone says that the participant is there, and that it is alive: each within four fifths of the lease of 3 s | `tev` | 0.83 together |
| each other process of Takt on the domain does so: its datagrams, their evaluation, and confirming that they came | `recv`, `dq.builtins`, `tev`, `gc` | 3 to 4 |
| a process of ROS 2 on this machine does so every 8 s | `newcomers`, `recv`, `dq.builtins`, `tev`, `gc` | 1.5 |
| shared memory, where iox-roudi runs: iceoryx's sign of life | `KeepAlive` | 3.3 |
| a process of ROS 2 begins, or ends | the same | once |
| an endpoint has a `deadline`, or a lease of its own | `tev` | one in each period |
| a service that has requests of clients whose reader is not known yet | `tev` | 1000, until it is |
| `/diagnostics`, while somebody subscribes | the container's own | 1 |
| `/rosout` and the log | `log` | as lines are logged |
| statistics, loans, parameters | none | 0 |

[Why](../explanation/decisions/0145_newcomers_are_heard.md); `bench/footprint.py` measures it.
"""
PARTS = {
    "Files and commands": ("containers/configuration", "containers/model", "containers/planning", "containers/component", "recording", "measuring",
                           "components", "programs", "rclcpp", "tools", "analysis", "base/error", "base/library"),
    "Messages, nodes and executors": ("base", "callback_groups", "entities", "executors", "nodes", "ros2", "sched", "containers"),
    "Between processes": ("messages", "transport"),
}


def without(path):
    return not file_rules.is_product(path) or path.startswith(WITHOUT)


def constants(path, text):
    """(line, name, value, marker or None) of each constant that is named as a limit."""
    for found in CONSTANT.finditer(text):
        comment = " ".join(line.strip().lstrip("/").strip() for line in found["comment"].splitlines())
        begin = comment.find("Limit: ")
        marker = MARKER.match(comment[begin:]) if begin >= 0 else None
        yield text.count("\n", 0, found.start("name")) + 1, found["name"], found["value"], marker


def unmarked(path, text):
    """(line, what is wrong)"""
    if without(path):
        return
    for line, name, _, marker in constants(path, text):
        if not marker:
            yield line, f"write above {name}: // Limit: what it bounds. At it: what happens. Seen: a counter."


def number(value):
    """Of an initializer, for people."""
    plain = re.sub(r"std::size_t\{(\d+)\}|std::uint64_t\{(\d+)\}", lambda found: found[1] or found[2], value).replace("'", "")
    shift = re.fullmatch(r"(\d+) << (\d+)", plain)
    if shift:
        count = int(shift[1]) << int(shift[2])
        unit, name = next(row for row in ((30, "Gi"), (20, "Mi"), (10, "Ki")) if count >= 1 << row[0])
        return f"{count >> unit} {name}"
    if plain.isdigit():
        return f"{int(plain):,}"
    duration = re.fullmatch(r"std::chrono::milliseconds\((\d+)\)", plain)
    return f"{duration[1]} ms" if duration else None


def part_of(path):
    places = [(len(begin), part) for part, begins in PARTS.items() for begin in begins if path.startswith(begin)]
    return max(places)[1]


def page(sources):
    """`sources`: (path, text), sorted."""
    rows = {part: [] for part in PARTS}
    for path, text in sources:
        if without(path):
            continue
        for _, name, value, marker in constants(path, text):
            shown = number(value)
            if marker and shown:  # without a number of its own it is another one's
                rows[part_of(path)].append(f"| {marker['what']} | {shown} | {marker['then']} | {marker['seen']} | "
                                           f"[{name}](../../{path}) |")
    parts = [HEAD]
    for part, lines in rows.items():
        parts.append(f"## {part}\n\n| limit | value | at it | seen by | constant |\n|---|---|---|---|---|\n" + "\n".join(lines) + "\n")
    return "\n".join([*parts, TAIL.lstrip("\n")])


def main():
    root = pathlib.Path(__file__).resolve().parents[2]
    listed = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=root, capture_output=True,
                            text=True, check=True).stdout
    paths = [path for path in sorted(set(listed.split("\0")) - {""}) if not without(path) and (root / path).is_file()]
    sys.stdout.write(page((path, (root / path).read_text(encoding="utf-8")) for path in paths))


if __name__ == "__main__":
    main()
