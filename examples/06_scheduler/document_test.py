#!/usr/bin/env python3
"""Is the C++ or YAML block of a document this file, and short? And, where one is given, the YAML block?

usage: document_test.py DOCUMENT FILE MOST_LINES [YAML]
"""
# SPDX-License-Identifier: Apache-2.0
import re
import sys

document, file, most_lines, *yaml = sys.argv[1:]


def check(language, of):
    blocks = re.findall(rf"^```{language}\n(.*?)^```$", open(document).read(),
                        re.MULTILINE | re.DOTALL)
    if blocks != [open(of).read()]:
        sys.exit(f"{document}: its {language} block is not {of}; copy the file into it")


check("yaml" if file.endswith(".yaml") else "cpp", file)
for one in yaml:
    check("yaml", one)
lines = len(open(file).read().splitlines())
if lines > int(most_lines):
    sys.exit(f"{file} has {lines} lines; the document promises {most_lines}")
