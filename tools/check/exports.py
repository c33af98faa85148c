#!/usr/bin/env python3
"""Compares what a library exports with what its public and internal headers declare: exports.py LIBRARY

SPDX-License-Identifier: Apache-2.0
"""
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
# What is exported without being declared in such a header as part of an interface, with the reason.
OTHERS = {
    "takt_try_library": "the program of this name calls it",
    "takt::detail::finish_message_type": "tools that make message types call it",
    "takt::detail::make_message_type": "TAKT_MESSAGE calls it",
    "takt::detail::FieldDescription": "TAKT_MESSAGE makes them",
    "takt::detail::name_of": "TAKT_MESSAGE calls it",
    "takt::detail::name_of_sequence": "TAKT_MESSAGE calls it",
    "takt::detail::name_of_array": "TAKT_MESSAGE calls it",
    "takt::detail::name_of_bounded": "TAKT_MESSAGE calls it",
    "takt::detail::RemovableBase": "templates of callback lists derive from it",
    "takt::detail::Removable": "rclcpp's layer has lists of these, too",
    "takt::detail::CallbackList": "rclcpp's layer has some, too",
    "takt::detail::WaitInCallback": "rclcpp's layer waits for callbacks, too",
    "takt::detail::Running": "rclcpp's layer waits for callbacks, too",
    "takt::detail::GoalCalls": "templates of action clients call it",
    "takt::detail::refuse_call": "templates of clients call it",
    "takt::detail::warn_of_ended_calls": "templates of clients call it",
    "takt::detail::yaml_integer": "to_yaml of every message calls it",
    "takt::detail::yaml_unsigned": "to_yaml of every message calls it",
    "takt::detail::yaml_real": "to_yaml of every message calls it",
    "takt::detail::yaml_text": "to_yaml of every message calls it",
    "takt::detail::loaded_tracepoints": "publishers read it where they send",
    "takt::detail::refuse_type": "templates of parameters call it",
    "takt::detail::refuse_narrow": "templates of parameters call it",
}


def declared(namespace):
    """The words of the headers that export this namespace."""
    words = set()
    for header in subprocess.run(["git", "ls-files", "*.hpp"], cwd=ROOT, capture_output=True, text=True,
                                 check=True).stdout.splitlines():
        text = (ROOT / header).read_text(encoding="utf-8")
        if re.search(rf"(?m)^namespace TAKT_(PUBLIC|INTERNAL) {namespace} ", text):
            words.update(re.findall(r"\w+", text))
    return words


def exported(library):
    """Demangled names of what is compiled into the library, as opposed to copies of inline code."""
    listed = subprocess.run(["nm", "-DC", "--defined-only", library], capture_output=True, text=True, check=True)
    for line in listed.stdout.splitlines():
        _, kind, name = line.split(" ", 2)
        name = name.replace("[abi:cxx11]", "").replace("non-virtual thunk to ", "")
        if kind in "TDBRV" and not re.search(r"\bstd::|\bfmt::|^typeinfo (name )?for void ", name.split("(")[0]):
            yield name


def main():
    words, details = declared(r"(?!detail)\w+"), declared("detail")
    found = []
    for name in exported(sys.argv[1]):
        path = re.sub(r"\(.*|<.*|^.* for ", "", name)
        parts = path.replace("~", "").split("::")
        is_other = any(path == other or path.startswith(other + "::") for other in OTHERS)
        if not is_other and not (details if "detail" in parts else words).issuperset(parts):
            found.append(name)
    print("\n".join(found))
    sys.exit(f"{len(found)} names are exported that no TAKT_PUBLIC or TAKT_INTERNAL header has" if found else 0)


main()
