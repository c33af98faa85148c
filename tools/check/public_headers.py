#!/usr/bin/env python3
"""Prints the headers that are installed, and so make the interface of the library.

cmake/TaktPackage.cmake says which are not.
SPDX-License-Identifier: Apache-2.0
"""
import functools
import pathlib
import re
import subprocess

NOT_INSTALLED = {"bench", "examples", "measuring", "rt_tests", "testing", "tools"}


@functools.lru_cache
def internal_headers(root):
    """The pattern of the headers that cmake/TaktPackage.cmake does not install."""
    package = root / "cmake/TaktPackage.cmake"
    text = package.read_text(encoding="utf-8") if package.exists() else ""
    found = re.search(r'headers EXCLUDE REGEX "((?:[^"\\]|\\.)*)"', text, re.DOTALL)
    return re.compile(found[1].replace("\\\n", "").replace(r"\\", "\\") if found else r"_test\.hpp$")


def is_public(path, internal):
    return (path.endswith(".hpp") and path.split("/")[0] not in NOT_INSTALLED
            and not internal.search(path))


if __name__ == "__main__":
    tree = pathlib.Path(__file__).resolve().parents[2]
    pattern = internal_headers(tree)
    listed = subprocess.run(["git", "ls-files", "--cached", "--others", "--exclude-standard"],
                            cwd=tree, capture_output=True, text=True, check=True).stdout
    print("\n".join(path for path in listed.splitlines() if is_public(path, pattern)))
