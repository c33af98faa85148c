#!/usr/bin/env python3
"""Compiles refused.cpp: each of its rows must be an error that names the page of rclcpp's elements.

usage: refused_test.py COMPILER OPTION...
SPDX-License-Identifier: Apache-2.0
"""
import pathlib
import re
import subprocess
import sys

FOLDER = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(FOLDER.parents[1] / "tools/check"))
import rclcpp_elements  # noqa: E402

source = FOLDER / "refused.cpp"
compiled = subprocess.run([*sys.argv[1:], "-fsyntax-only", "-fdiagnostics-color=never", str(source)], capture_output=True, text=True,
                          timeout=300)
# GCC says first from where it comes, then what is wrong.
refused, other, lines = set(), [], set()
for line in compiled.stderr.splitlines():
    lines.update(int(number) for number in re.findall(r"refused\.cpp:(\d+)", line))
    if " error: " in line:
        (refused.update(lines) if "docs/reference/rclcpp" in line else other.append(line))
        lines = set()
rows = rclcpp_elements.rows(source.read_text(encoding="utf-8"))
missing = [row.cells[0] for row in rows if not any(row.begin <= line <= row.end for line in refused)]
if missing or not rows:
    sys.exit("\n".join(["not refused with the name of the page:", *missing, "", "other errors:", *other]))
print(f"{len(rows)} rows are refused")
