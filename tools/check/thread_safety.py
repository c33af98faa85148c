#!/usr/bin/env python3
"""Clang checks which lock guards what, in all files of the library that have one of our locks.

usage: thread_safety.py BUILD_FOLDER [MODULE...]
SPDX-License-Identifier: Apache-2.0
"""
import json
import pathlib
import re
import shlex
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
LOCKS = re.compile(r"\b(?:PiMutex|RankedMutex|DispatchLock|TAKT_GUARDED_BY|TAKT_REQUIRES|lock_guard|unique_lock)\b")
# A precise match fails where a lambda names the lock in another way than its caller.
WARNINGS = ["-Wno-everything", "-Wthread-safety", "-Werror=thread-safety", "-Wno-thread-safety-precise"]
SKIPPED = 77


def flags_of(command):
    """What a compiler must know to read a file: include folders, definitions, the standard."""
    words = shlex.split(command)
    flags = []
    for i, word in enumerate(words):
        if word in ("-I", "-isystem"):
            flags += words[i:i + 2]
        elif word.startswith(("-I", "-D", "-std", "-isystem")):
            flags.append(word)
    return flags


def sources(path):
    """What is compiled: of a unity build, the files that it includes."""
    text = path.read_text(encoding="utf-8")
    included = re.findall(r'(?m)^#include "(/[^"]*\.cpp)"', text) if path.suffix == ".cxx" else []
    return [pathlib.Path(each) for each in included] or [path]


def has_locks(file):
    return any(LOCKS.search(each.read_text(encoding="utf-8"))
               for each in (file, file.with_suffix(".hpp")) if each.is_file())


def modules(folder):
    """Of each module of the library: the folder and flags of its compiler, and its files with locks."""
    found = {}
    for entry in json.loads((folder / "compile_commands.json").read_text(encoding="utf-8")):
        module = re.search(r"/takt_(\w+)\.dir/", f"{entry.get('output', '')} {entry['command']}")
        if module and (ROOT / module[1]).is_dir():
            known = found.setdefault(module[1], (entry["directory"], flags_of(entry["command"]), []))
            known[2].extend(file for file in sources(pathlib.Path(entry["file"])) if has_locks(file))
    return found


def main():
    clang = shutil.which("clang++")
    if clang is None:
        print("skipped: there is no clang++ (apt-get install clang)")
        sys.exit(SKIPPED)
    folder = pathlib.Path(sys.argv[1]).resolve()
    running = []
    for module, (directory, flags, files) in modules(folder).items():
        if files and (len(sys.argv) == 2 or module in sys.argv[2:]):
            process = subprocess.Popen([clang, "-x", "c++", "-fsyntax-only", *WARNINGS, *flags, "-"], cwd=directory,
                                       stdin=subprocess.PIPE, text=True)
            process.stdin.write("".join(f'#include "{file}"\n' for file in files))
            process.stdin.close()
            running.append((module, process))
    if not running:
        sys.exit(f"{folder}/compile_commands.json names no module")
    failed = [module for module, process in running if process.wait() != 0]
    print(f"checked {len(running)} modules" + (f"; wrong: {', '.join(failed)}" if failed else ""))
    sys.exit(1 if failed else 0)


main()
