#!/usr/bin/env python3
"""Compares the public symbols of libtakt.so with those stored for its minor version: abi.py LIBRARY [--renew]

By abidw and abidiff (abigail-tools). The library has no debug information, so what is compared is each symbol with its
version and, of data, its size; a function's arguments are in its symbol, the layout of a class is not.

SPDX-License-Identifier: Apache-2.0
"""
import pathlib
import re
import subprocess
import sys
import tempfile

SYMBOLS = pathlib.Path(__file__).resolve().parent / "symbols"
REMOVED = 8  # a bit of abidiff's status


def dump(library):
    """As XML, without what is private, and without copies of inline code of others."""
    made = subprocess.run(["abidw", "--no-show-locs", "--no-corpus-path", "--no-architecture", library],
                          capture_output=True, text=True, check=True).stdout
    lines = made.splitlines(keepends=True)
    return "".join(line for line in lines if "<dependency " not in line and
                   ("<elf-symbol " not in line or "4takt" in line and "'global-binding'" in line
                    and "TAKT_PRIVATE" not in line))


def difference(before, after):
    """What abidiff says of two dumps; empty: nothing is removed or changed."""
    with tempfile.TemporaryDirectory() as folder:
        paths = [pathlib.Path(folder, name) for name in ("before.abi", "after.abi")]
        for path, text in zip(paths, (before, after)):
            path.write_text(text, encoding="utf-8")
        done = subprocess.run(["abidiff", "--no-added-syms", *paths], capture_output=True, text=True)
        return done.stdout + done.stderr if done.returncode else ""


def compare(library):
    """(whether the symbols may be so, why)."""
    after = dump(library)
    minor = re.search(r"soname='libtakt\.so\.([\d.]+)'", after)[1]
    stored = SYMBOLS / f"libtakt-{minor}.abi"
    if not stored.exists():
        return True, f"{stored.name} is missing: the first of its minor version; packaging/abi.py LIBRARY --renew makes it"
    before = stored.read_text(encoding="utf-8")
    first = re.search(r"    <elf-symbol .*\n", before)[0]
    if not difference(before, before.replace(first, "", 1)):
        return False, "a symbol that is missing is not found"
    found = difference(before, after)
    return not found, found + ("\nraise the minor version in base/version.hpp; or, if no version of this minor one has been "
                               "released, packaging/abi.py LIBRARY --renew" if found else "")


if __name__ == "__main__":
    if "--renew" in sys.argv:
        for old in SYMBOLS.glob("libtakt-*.abi"):
            old.unlink()
        text = dump(sys.argv[1])
        minor = re.search(r"soname='libtakt\.so\.([\d.]+)'", text)[1]
        (SYMBOLS / f"libtakt-{minor}.abi").write_text(text, encoding="utf-8")
    may_be, why = compare(sys.argv[1])
    print(why or "as stored")
    sys.exit(not may_be)
