#!/usr/bin/env python3
"""The page of rclcpp's elements, from the row above each check in rclcpp/elements, and the packages that are refused.

    // Row: `Node`, `NodeOptions` | what is to be said of it
    void nodes() { ... }

usage: rclcpp_elements.py > docs/reference/rclcpp.md    (./dev check compares)
SPDX-License-Identifier: Apache-2.0
"""
import dataclasses
import pathlib
import re
import sys
import textwrap

PAGE = "docs/reference/rclcpp.md"
FOLDER = "rclcpp/elements/"
ABSENT = "rclcpp/cmake/absent.cmake"
FILES = {"supported": ("supported.cpp", "supported_more.cpp"), "differs": ("differs.cpp",), "refused": ("refused.cpp",)}
HEADS = {"supported": ("element", "remarks"), "differs": ("element", "here"), "refused": ("element", "instead")}
HEADING = re.compile(r"// ---- (.+) ----$")


@dataclasses.dataclass
class Row:
    heading: str
    cells: list
    begin: int  # its lines
    end: int = 0
    has_check: bool = False


def rows(text):
    found, heading, is_open = [], None, False
    for number, line in enumerate(text.splitlines(), 1):
        if given := HEADING.match(line):
            heading = given[1]
        elif line.startswith("// Row: "):
            found.append(Row(heading, [line[8:].rstrip()], number))
            is_open = True
        elif line.startswith("//") and is_open:
            found[-1].cells[0] += " " + line[2:].strip()
        elif line.strip() and found:
            is_open = False
            found[-1].has_check = True
        if found:
            found[-1].end = number
    for row in found:
        row.cells = [cell.strip() for cell in row.cells[0].split("|", 1)]
        if len(row.cells) != 2 or not row.has_check:
            sys.exit(f"a row has two cells, and a check below it: {row.cells}")
    return found


def table(part, found):
    lines, heading = [], None
    for row in found:
        if row.heading != heading:
            heading = row.heading
            lines += ["", f"### {heading}", ""]
        if not lines or lines[-1] == "":
            lines += ["| " + " | ".join(HEADS[part]) + " |", "|---|---|"]
        lines.append("| " + " | ".join(row.cells) + " |")
    return "\n".join(lines).strip()


def page(read):
    """`read`: the text of a file by its path."""
    text = read(PAGE + ".in")
    for part, names in FILES.items():
        found = [row for name in names for row in rows(read(FOLDER + name))]
        text = text.replace(f"@{part}@", table(part, found))
    names = re.search(r"set\(takt_ros2_absent_never\s+([^)]*)\)", read(ABSENT))[1].split()
    return text.replace("@packages@", textwrap.fill(", ".join(f"`{name}`" for name in names), 140))


if __name__ == "__main__":
    root = pathlib.Path(__file__).resolve().parents[2]
    sys.stdout.write(page(lambda path: (root / path).read_text(encoding="utf-8")))
