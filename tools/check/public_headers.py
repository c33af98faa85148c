#!/usr/bin/env python3
"""Prints the headers that are installed, and so make the interface of the library.

These are the headers of the library whose namespace is TAKT_PUBLIC, and those without one, which
have macros or includes only. cmake/TaktPackage.cmake installs them.
SPDX-License-Identifier: Apache-2.0
"""
import pathlib
import re
import subprocess

NOT_INSTALLED = {"bench", "examples", "measuring", "programs", "rt_tests", "testing", "tools"}


def is_public(path, text):
    return (path.endswith(".hpp") and path.split("/")[0] not in NOT_INSTALLED
            and (re.search(r"(?m)^namespace TAKT_PUBLIC ", text) is not None
                 or re.search(r"(?m)^namespace ", text) is None))


if __name__ == "__main__":
    tree = pathlib.Path(__file__).resolve().parents[2]
    listed = subprocess.run(["git", "ls-files", "--cached", "--others", "--exclude-standard"],
                            cwd=tree, capture_output=True, text=True, check=True).stdout
    for path in listed.splitlines():
        if path.endswith(".hpp") and is_public(path, (tree / path).read_text(encoding="utf-8")):
            print(path)
