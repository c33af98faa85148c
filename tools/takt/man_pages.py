#!/usr/bin/env python3
"""Makes pages for man of what a program says of itself: takt.1, takt-run.1, ..., or rt_loading.1.

usage: man_pages.py FOLDER PROGRAM...   (the words that start it: of another processor's, an emulator first)
"""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import re
import subprocess
import sys

# A line of a list: two spaces, what is listed, and what it is, there or in the next line.
ITEM = re.compile(r"  (\S.*?)(?:  +(\S.*))?")
HEADING = re.compile(r"([A-Z][a-z]+):")


def roff(text):
    text = text.replace("\\", "\\e").replace("-", "\\-").replace("'", "\\(aq").replace("`", "\\(ga")
    return re.sub(r"^\.", r"\\&.", text, flags=re.MULTILINE)


class Help:
    """The description, the usage, lists of (name, text) by their headings, and what follows."""

    def __init__(self, text):
        lines = text.splitlines()
        usage = next((i for i, line in enumerate(lines) if line.startswith("Usage: ")), None)
        if usage is None:  # of another program, which takt starts
            self.description, self.usage, self.lists, self.rest = "", "", {}, lines
            return
        self.description = " ".join(lines[:usage]).strip()
        self.usage, self.lists, self.rest = lines[usage].removeprefix("Usage: "), {}, []
        items = None
        for i, line in enumerate(lines[usage + 1:], usage + 1):
            heading, item = HEADING.fullmatch(line), ITEM.fullmatch(line)
            if heading and not heading[1].startswith("Example"):
                items = self.lists[heading[1]] = []
            elif items is not None and line.startswith(" " * 20) and items:
                items[-1][1] += " " + line.strip()
            elif items is not None and item:
                items.append([item[1], item[2] or ""])
            elif line:  # the footer, to the end
                self.rest = lines[i:]
                break


def body(help_text, heading):
    """heading: of the lists, .SH in a page and .SS in a section."""
    out = []
    for name, items in help_text.lists.items():
        out.append(f"{heading} {roff(name.upper() if heading == '.SH' else name)}")
        for item, text in items:
            out += [".TP", f".B {roff(item)}", roff(text)]
    if help_text.rest:
        is_example = help_text.rest[0].startswith("Example")
        name = "Examples" if is_example else "Notes"
        out += [f"{heading} {name.upper() if heading == '.SH' else name}", ".nf"]
        out += [roff(line) for line in help_text.rest[is_example:]] + [".fi"]
    return out


def page(name, what, version, lines):
    return "\n".join([f'.TH "{name.upper()}" 1 "" "{version}" "Takt"', ".SH NAME",
                      f"{roff(name)} \\- {roff(what)}", *lines, ""])


def takt_pages(folder, said):
    for old in folder.glob("takt*.1"):
        old.unlink()
    version = f"Takt {said('--version').strip()}"
    top = Help(said("--help"))
    commands = [name for name, _ in top.lists["Subcommands"]]
    pages = ",\n".join(f".BR {roff('takt-' + name)} (1)" for name in commands)
    lines = [".SH SYNOPSIS", f".B {roff(top.usage)}", *body(top, ".SH"), ".SH EXIT STATUS"]
    for status, what, _ in re.findall(r"(?m)^\| (\d+) \| (.*?) \| (.*) \|$", said("help", "exit-status")):
        lines += [".TP", f".B {status}", roff(what)]
    lines += [".SH SEE ALSO", pages.replace(",\n", " ,\n")]
    (folder / "takt.1").write_text(page("takt", top.description, version, lines))
    for command in commands:
        own = Help(said(command, "--help"))
        lines = [".SH SYNOPSIS", f".B {roff(own.usage)}", *body(own, ".SH")]
        for name, _ in own.lists.get("Subcommands", []):
            try:
                each = Help(said(command, name, "--help"))
            except subprocess.CalledProcessError:  # of another program, which is not built
                continue
            if each.rest == own.rest:  # the examples stand above
                each.rest = []
            lines += [f".SH {roff(f'takt {command} {name}'.upper())}", roff(each.description),
                      *([".PP", f".B {roff(each.usage)}"] if each.usage else []), *body(each, ".SS")]
        lines += [".SH SEE ALSO", ".BR takt (1)"]
        (folder / f"takt-{command}.1").write_text(page(f"takt-{command}", own.description, version, lines))


def main(folder, *program):
    def said(*words):
        return subprocess.run([*program, *words], text=True, capture_output=True, check=True).stdout

    folder = pathlib.Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    name = pathlib.Path(program[-1]).name
    if name == "takt":
        takt_pages(folder, said)
    else:
        own = Help(said("--help"))
        (folder / f"{name}.1").write_text(page(name, own.description, "", [
            ".SH SYNOPSIS", f".B {roff(own.usage)}", *body(own, ".SH"), ".SH SEE ALSO", ".BR takt-latency (1)"]))


main(*sys.argv[1:])
