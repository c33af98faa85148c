#!/usr/bin/env python3
"""Each command has a page for man, with all its options, which man formats without a warning.

usage: man_pages_test.py TAKT FOLDER RT_TEST
"""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import re
import shutil
import subprocess
import sys

from command import environment, run
from checks import check, finish

folder = pathlib.Path(sys.argv[2])
commands = re.findall(r"(?m)^  (\w+)  ", run("--help").stdout.partition("Subcommands:")[2].partition("\n\n")[0])
check("there are commands", len(commands) > 20, commands)
pages = {page.name for page in folder.glob("takt*")}
check("each has a page, and no page is of another", pages == {"takt.1", *(f"takt-{name}.1" for name in commands)}, pages)
for command in commands:
    page = (folder / f"takt-{command}.1").read_text().replace("\\-", "-")
    options = re.findall(r"(?m)^  (-\S+)", run(command, "--help").stdout)
    missing = [option for option in options if option not in page]
    check(f"takt {command}: its page has its options", options and not missing, missing)
nested = (folder / "takt-component.1").read_text()
check("a page has what stands below its command", "--remap".replace("-", "\\-") in nested, nested)
# A page is as old as its program: of the others, those are there that are built.
rt_test = pathlib.Path(sys.argv[3])
said = subprocess.run([rt_test, "--help"], env=environment, text=True, capture_output=True).stdout
page = (folder / f"{rt_test.name}.1").read_text().replace("\\-", "-")
check("a real-time test has a page, with its question and options", said.splitlines()[0] in page and
      all(option in page for option in ("--rounds N", "--json FILE", "--help")), page)
if shutil.which("man") is None:
    print("skipped: man's warnings; there is no man (apt-get install man-db)")
else:
    for page in sorted(folder.iterdir()):
        said = subprocess.run(["man", "--warnings", "-E", "UTF-8", "-l", "-Tutf8", "-Z", str(page)], text=True,
                              capture_output=True)
        check(f"{page.name}: man is silent", said.returncode == 0 and not said.stderr, said.stderr)
finish()
