#!/usr/bin/env python3
"""Compares what a library exports with the lists of packaging/symbols and with the headers: exports.py LIBRARY [--renew]

A name is a class, function or variable of a namespace. It is public if a header with TAKT_PUBLIC declares it, and
private, with the version TAKT_PRIVATE, if only one with TAKT_INTERNAL does. A name of takt::detail is what its list says,
and a public one has its reason there.

SPDX-License-Identifier: Apache-2.0
"""
import pathlib
import re
import subprocess
import sys

import cpp_source

ROOT = pathlib.Path(__file__).resolve().parents[2]
SYMBOLS = ROOT / "packaging/symbols"
HEADS = {"public": "What programs may use: libtakt.so keeps it while its minor version is the same.",
         "private": "What Takt's own programs and libraries use: it may change in any version, see cmake/TaktSymbols.cmake."}
# A name of the dynamic linker's, and why no header has it.
OTHERS = {"takt_try_library": "the program of this name calls it"}


def at_namespace_scope(text):
    """The code without what is in classes and functions, and the names of the classes."""
    lines = cpp_source.without_comments(text).split("\n")
    classes = set()
    for kind, name, first, last, around in cpp_source.outline(text):
        if kind != "namespace" and all(outer == "namespace" for outer, _ in around):
            lines[first:last - 1] = [""] * (last - 1 - first)
            if kind != "function":
                classes.add(name.split("<")[0])
    return "\n".join(lines), classes


def declared():
    """What headers of each kind declare: classes with their bodies, functions, variables."""
    names = {"public": set(), "private": set()}
    listed = subprocess.run(["git", "ls-files", "*.hpp"], cwd=ROOT, capture_output=True, text=True, check=True)
    for header in listed.stdout.splitlines():
        text = (ROOT / header).read_text(encoding="utf-8")
        macros = re.findall(r"(?m)^namespace TAKT_(PUBLIC|INTERNAL) ", text)
        if macros:
            code, classes = at_namespace_scope(text)
            names["public" if "PUBLIC" in macros else "private"].update(
                classes, re.findall(r"(\w+)\s*\(", code), re.findall(r"\b(?:extern|constinit)\b[^;=]*?(\w+)\s*[;={\[]", code))
    return names


def exported(library):
    """(name, version) of what is compiled into the library, as opposed to copies of inline code."""
    listed = subprocess.run(["nm", "-DC", "--defined-only", "--with-symbol-versions", library], capture_output=True,
                            text=True, check=True)
    for line in listed.stdout.splitlines():
        _, kind, symbol = line.split(" ", 2)
        symbol, _, version = symbol.partition("@@")
        symbol = symbol.replace("[abi:cxx11]", "").replace("non-virtual thunk to ", "")
        if kind not in "TDBRV" or re.search(r"\bstd::|\bfmt::|^typeinfo (name )?for void ", symbol.split("(")[0]):
            continue
        path = re.sub(r"\(.*|<.*|^.* for ", "", symbol).split("::")
        last = next((i for i, part in enumerate(path) if not part.islower()), len(path) - 1)
        yield "::".join(path[:last + 1]), version


def read_list(kind):
    """The names, with their reasons."""
    lines = (SYMBOLS / kind).read_text(encoding="utf-8").splitlines() if (SYMBOLS / kind).exists() else []
    return {name.strip(): reason.strip() for name, _, reason in (line.partition("#") for line in lines) if name.strip()}


def write_list(kind, names):
    lines = [f"# {HEADS[kind]}", "# Made by tools/check/exports.py LIBRARY --renew", "# SPDX-License-Identifier: Apache-2.0"]
    lines += [f"{name}  # {names[name]}" if names[name] else name for name in sorted(names)]
    (SYMBOLS / kind).write_text("\n".join(lines) + "\n", encoding="utf-8")


def kind_of(name, headers, lists):
    if "::detail::" in name and any(name in names for names in lists.values()):
        return next(kind for kind in lists if name in lists[kind])
    return next((kind for kind in headers if name.split("::")[-1] in headers[kind]), None)


def main():
    library, *options = sys.argv[1:]
    headers, lists, found = declared(), {kind: read_list(kind) for kind in HEADS}, []
    now = {kind: {} for kind in HEADS}
    for name, version in sorted(set(exported(library))):
        kind = kind_of(name, headers, lists)
        if kind is None and name not in OTHERS:
            found.append(f"{name}: no header with TAKT_PUBLIC or TAKT_INTERNAL declares it")
        if kind is not None:
            now[kind][name] = lists[kind].get(name, "")
            if version and (version == "TAKT_PRIVATE") != (kind == "private") and "--renew" not in options:
                found.append(f"{name}: is {kind}, and has the version {version}")
    if "--renew" in options:
        for kind in HEADS:
            write_list(kind, now[kind])
    for kind in HEADS:
        listed = read_list(kind)
        found += [f"{name}: is not in packaging/symbols/{kind}; is it meant to be exported?" for name in now[kind]
                  if name not in listed]
        found += [f"{name}: is in packaging/symbols/{kind}, and not exported" for name in listed if name not in now[kind]]
    found += [f"{name}: packaging/symbols/public needs the reason" for name, reason in read_list("public").items()
              if "::detail::" in name and not reason]
    print("\n".join(found))
    sys.exit(f"{len(found)} exported names; `tools/check/exports.py LIBRARY --renew` makes the lists" if found else 0)


main()
