#!/usr/bin/env python3
"""What formatters and compilers cannot see: ./dev check runs it.

It reads the files that git tracks, and new ones. Findings that are older than their rule are listed
in tools/check/exceptions.txt with their number, which may only fall.
SPDX-License-Identifier: Apache-2.0
"""
import argparse
import ast
import collections
import dataclasses
import pathlib
import re
import subprocess
import sys
import urllib.parse

import classes
import cpp_source
import files as file_rules
import limits
import ignored
import mutations
import rclcpp_elements
import waiting
from phrases import RETIRED
from public_headers import is_public

MOST_LINES = 500
MOST_LINES_OF_FUNCTION = 60
MOST_OF_SUBJECT = 72
SUBJECTS_SINCE = "ca1df3ac4356"  # the last commit whose subject is too long
EXCEPTIONS = "tools/check/exceptions.txt"
CPP = {".cpp", ".hpp", ".c", ".h"}
SOURCES = CPP | {".py", ".sh", ".cmake"}
PROSE = SOURCES | {".md", ".in", ".yaml", ".xml"}
SCRIPTS = {"dev", ".ci/run"}
RULES = {
    "generated": "what programs make of data is not in git",
    "subject": f"subjects of commits above {MOST_OF_SUBJECT} characters",
    "format": "clang-format has nothing to change",
    "file-length": f"lines above {MOST_LINES} in a file",
    "function-length": f"lines above {MOST_LINES_OF_FUNCTION} in a function",
    "class-size": "functions and fields of a class",
    "spdx": "sources with the SPDX line, alone on its line",
    "public": "headers export all that they declare, and include only such headers",
    "contract": "public classes say 'Thread safety:' and 'Real-time:'",
    "once": "a type is defined in one place of the product",
    "keep": "what create_… returns is [[nodiscard]]",
    "temporary": "temporary files have names that nobody can foresee",
    "output": "what other processes say is escaped",
    "reader": "files are read by one reader",
    "interpreter": "Python is started with -I",
    "writer": "files are written by one writer, and what options name is checked",
    "unsound": "no last pointer for a comparison, no static object on the heap, no list of callbacks of one's own",
    "wait": "who waits for others' code is known, or says why not",
    "clock": "nodes give entities the real clock",
    "environment": "variables of the environment are tried with all values",
    "link": "links in documents lead somewhere",
    "phrase": "retired phrases",
    "one-list": "one page says what is not implemented",
    "waiting": "tests wait with an end",
    "limit": "each limit has a marker, and the page of limits has them",
    "elements": "the page of rclcpp's elements has the rows of their checks",
    "mutation": "what ./dev stress falsifies stands in the sources, once",
    "time-sum": "no plain sum of a time and a duration: later()",
    "time-text": "no number of ns in a text for people: to_string()",
}


@dataclasses.dataclass
class Finding:
    path: str
    line: int
    rule: str
    message: str
    weight: int = 1  # what counts against the exception


@dataclasses.dataclass
class File:
    path: str
    text: str

    def __post_init__(self):
        self.suffix = pathlib.PurePath(self.path).suffix
        self.name = pathlib.PurePath(self.path).name
        self.is_source = (self.suffix in SOURCES or self.name == "CMakeLists.txt"
                          or self.path in SCRIPTS)
        self.lines = self.text.splitlines()

    def line_at(self, offset):
        return self.text.count("\n", 0, offset) + 1


# ---- Rules: each yields its findings in one file ----

def check_file_length(file, _):
    above = len(file.lines) - MOST_LINES
    if file.is_source and above > 0:
        yield Finding(file.path, MOST_LINES + 1, "file-length",
                      f"{len(file.lines)} lines, {MOST_LINES} at most", above)


def functions_of(file):
    """(name, first line, last line) of each function."""
    if file.suffix in CPP:
        for kind, name, first, last, _ in cpp_source.outline(file.text):
            if kind == "function":
                yield name, first, last
    elif file.suffix == ".py":
        for node in ast.walk(ast.parse(file.text, file.path)):
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
                yield node.name, node.lineno, node.end_lineno


def check_function_length(file, _):
    for name, first, last in functions_of(file):
        above = last - first + 1 - MOST_LINES_OF_FUNCTION
        if above > 0:
            yield Finding(file.path, first, "function-length",
                          f"{name} has {last - first + 1} lines, {MOST_LINES_OF_FUNCTION} at most",
                          above)


def check_class_size(file, _):
    for line, what in classes.too_large(file.path, file.text):
        yield Finding(file.path, line, "class-size", what)


# On a line of its own: a formatter once glued it to the sentence before.
SPDX = re.compile(r"(?:(?://|#) )?SPDX-License-Identifier: Apache-2\.0")


def check_spdx(file, _):
    if file.is_source and not any(SPDX.fullmatch(line) for line in file.lines[:40]):
        yield Finding(file.path, 1, "spdx", "no line 'SPDX-License-Identifier: Apache-2.0'")


def check_public(file, root):
    exporting = re.search(r"(?m)^namespace TAKT_(PUBLIC|INTERNAL) ", file.text)
    public = is_public(file.path, file.text)
    if not file.path.endswith(".hpp") or not (public or exporting):
        return
    if public and file.path.startswith("executors/engine/"):
        yield Finding(file.path, 1, "public", "the engine is private: no user includes its headers (decision 0091)")
    macro = exporting[1] if exporting else "PUBLIC"
    for found in re.finditer(r"(?m)^namespace (?!TAKT_)(takt\b.*)\{\n(?!namespace TAKT_)", file.text):
        yield Finding(file.path, file.text.count("\n", 0, found.start()) + 1, "public",
                      f"write 'namespace TAKT_{macro} {found[1]}{{', or move it to a header of its own")
    for number, line in enumerate(file.lines, 1):
        included = re.match(r'#include "takt/(.*)"', line)
        header = root / included[1] if included else None
        if not header or not header.is_file():
            continue
        text = header.read_text(encoding="utf-8")
        if not is_public(included[1], text) and (public or "\nnamespace TAKT_INTERNAL " not in text):
            yield Finding(file.path, number, "public",
                          f"the namespace of {included[1]} must be " +
                          ("TAKT_PUBLIC" if public else "TAKT_PUBLIC or TAKT_INTERNAL") + ", too")


def check_contract(file, _):
    if not is_public(file.path, file.text):
        return
    for kind, name, first, _, around in cpp_source.outline(file.text):
        is_public_class = (
            kind == "class" and "::" not in name and
            all(scope == "namespace" and called and "detail" not in called.split("::")
                for scope, called in around))
        if not is_public_class:
            continue
        said = cpp_source.comment_above(file.lines, first)
        missing = [f"'{contract}:'" for contract in ("Thread safety", "Real-time")
                   if not re.search(rf"\b{contract}:|Thread safety and real-time:", said)]
        if missing:
            yield Finding(file.path, first, "contract",
                          f"the comment of {name} has no {' and no '.join(missing)}")


# Who drops what it returns has no callback, and learns nothing of it.
CREATES = re.compile(r"(?m)^ *(?:\w+ )*std::shared_ptr<[^;={}()]*>\s+create_\w+\(")


def check_once(files):
    """The linker takes one of two definitions for both, and says nothing."""
    places = {}
    for file in files:
        if not (file_rules.is_product(file.path) and pathlib.PurePath(file.path).suffix in CPP):
            continue
        for kind, name, line, _, scopes in cpp_source.outline(file.text):
            path = [scope_name for scope_kind, scope_name in scopes if scope_kind != "extern"]
            is_local = any(scope_kind != "namespace" for scope_kind, _ in scopes) or "" in path
            if kind.split()[0] not in ("class", "struct", "union", "enum") or "<" in name or is_local or not name:
                continue
            place = places.setdefault("::".join([*path, name]), file.path)
            if place != file.path:
                yield Finding(file.path, line, "once", f"{'::'.join([*path, name])} is defined in {place}, too")


def check_keep(file, _):
    if is_public(file.path, file.text):
        for found in CREATES.finditer(cpp_source.without_comments(file.text)):
            yield Finding(file.path, file.line_at(found.start()), "keep",
                          f"write [[nodiscard]]: {' '.join(found[0].split())}…")


def check_lines(file, _):
    """Rules that look at one file alone."""
    for kind, rule, content in (
            ("temporary", file_rules.temporary_names, file.lines), ("output", file_rules.raw_output, file.lines),
            ("reader", file_rules.readers, file.lines), ("writer", file_rules.writers, file.lines),
            ("interpreter", file_rules.interpreters, file.text), ("unsound", file_rules.unsound, file.lines),
            ("wait", file_rules.unknown_waits, file.lines), ("clock", file_rules.clocks, file.lines),
            ("waiting", waiting.endless, file.text)):
        for line, what in rule(file.path, content):
            yield Finding(file.path, line, kind, what)


def check_environment(file, root):
    test = root / file_rules.TEST_OF_ENVIRONMENT
    for line, what in file_rules.variables(file.path, file.lines, test.read_text(encoding="utf-8") if test.is_file() else ""):
        yield Finding(file.path, line, "environment", what)


def anchor_of(heading):
    """As GitHub makes it."""
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "").strip().lower()
    return re.sub(r"[^\w\- ]", "", text).replace(" ", "-")


# Fenced, indented, or in a line.
CODE = re.compile(r"^```.*?^```|(?<=\n\n)(?:(?: {4}[^\n]*)?\n)+|`(?:[^`\n]|\n(?!\n))+`",
                  re.DOTALL | re.MULTILINE)


def without_code(text):
    """The same places, with spaces for code."""
    return CODE.sub(lambda code: re.sub(r"[^\n]", " ", code[0]), text)


def anchors_of(text):
    fenced = re.sub(r"^```.*?^```", "", text, flags=re.DOTALL | re.MULTILINE)
    anchors = set(re.findall(r'<a (?:id|name)="([^"]+)"', fenced))
    count = collections.Counter()
    for heading in re.findall(r"^#+ +(.*?)(?: +#+)?$", fenced, re.MULTILINE):
        anchor = anchor_of(heading)
        anchors.add(f"{anchor}-{count[anchor]}" if count[anchor] else anchor)
        count[anchor] += 1
    return anchors


def check_links(file, root):
    if file.suffix != ".md":
        return
    for link in re.finditer(r"\]\(<?([^)\s>]+)[^)]*\)", without_code(file.text)):
        target, _, anchor = urllib.parse.unquote(link[1]).partition("#")
        if re.match(r"\w+:", target):
            continue
        leads_to = (root / file.path).parent / target if target else root / file.path
        line = file.line_at(link.start())
        if not leads_to.exists():
            yield Finding(file.path, line, "link", f"there is no {link[1]}")
        elif anchor and leads_to.suffix == ".md":
            if anchor not in anchors_of(leads_to.read_text(encoding="utf-8")):
                yield Finding(file.path, line, "link", f"there is no heading for {link[1]}")


# The end of a line within a comment, a paragraph, or a string that goes on.
LINE_END = re.compile(r'"?[ \t]*\n[ \t]*(?:/{2,}|#+|\*)?[ \t]*"?')
# One pattern, so that no word is counted twice; the group says which phrase it is.
PHRASES = re.compile("|".join(f"(?P<p{number}>{pattern})" for number, (pattern, _)
                              in enumerate(RETIRED)).replace(" ", " +"),
                     re.IGNORECASE)


def check_phrases(file, _):
    is_prose = file.suffix in PROSE or file.is_source
    if not is_prose or file.path.startswith("tools/check/"):
        return
    text = LINE_END.sub(lambda end: " " * len(end[0]), file.text)
    for found in PHRASES.finditer(text):
        phrase = " ".join(found[0].split())
        better = RETIRED[int(found.lastgroup[1:])][1]
        yield Finding(file.path, file.line_at(found.start()), "phrase", f"'{phrase}': {better}")


# Four lists of it contradicted each other. A link to the page has square brackets.
MISSING = re.compile(r"(?<!what is )\bnot (?:yet )?(?:implemented|built yet)\b", re.IGNORECASE)
PAGE_OF_MISSING = "docs/explanation/goals.md"


def check_one_list(file, _):
    if file.suffix != ".md" or file.path == PAGE_OF_MISSING or file.path.startswith("docs/explanation/decisions/"):
        return
    for found in MISSING.finditer(without_code(file.text)):
        yield Finding(file.path, file.line_at(found.start()), "one-list", f"say it in {PAGE_OF_MISSING}, and link to it")


# A sum with a time of now, or with what is called as durations are that users give. A plain one
# overflows where a user says "for ever".
TIME_SUM = re.compile(r"""(?<!steady_clock::)\bnow_?(?:\(\))?\s*\+(?!\+)
                        | (?<!\+)\+=?\s*(?:[\w.>()-]*[.>])?\w*
                          (?:timeout|duration|lifespan|lease|(?<!with_)period|interval|delay|patience|limit)
                          (?:_duration|_period)?_?(?:\(\))?\s*[;,)&|<>]""", re.VERBOSE)
# Numbers that are no times, or times that end within a test or a simulation; rclcpp's own times throw.
NO_TIMES = ("analysis/", "bench/", "testing/", "rt_tests/", "executors/sequences/", "rclcpp/")


def check_time_sums(file, _):
    if (file.suffix not in CPP or file.path.startswith(NO_TIMES) or "_test." in file.name
            or file.path == "base/time.hpp"):
        return
    for found in TIME_SUM.finditer(cpp_source.without_comments(file.text)):
        yield Finding(file.path, file.line_at(found.start()), "time-sum",
                      f"'{' '.join(found[0].split())}': later(time, duration) cannot overflow")


TIME_TEXT = re.compile(r'"[^"\n]*\{[^{}"\n]*\} ?ns\b|\+ " ?ns\b')


def check_time_texts(file, _):
    if file.suffix not in CPP or file.path.startswith(NO_TIMES) or "_test." in file.name or file.path == "base/time.cpp":
        return
    for found in TIME_TEXT.finditer(file.text):
        yield Finding(file.path, file.line_at(found.start()), "time-text", f"{found[0]}…: to_string(time) writes its unit")


def check_limits(files):
    sources = [(file.path, file.text) for file in files]
    for path, text in sources:
        for line, what in limits.unmarked(path, text):
            yield Finding(path, line, "limit", what)
    present = next((file.text for file in files if file.path == limits.PAGE), None)
    if present is not None and present != limits.page(sources):
        yield Finding(limits.PAGE, 1, "limit", f"not what the markers give: tools/check/limits.py > {limits.PAGE}")


def check_elements(files):
    texts = {file.path: file.text for file in files}
    if rclcpp_elements.PAGE in texts and texts[rclcpp_elements.PAGE] != rclcpp_elements.page(texts.__getitem__):
        yield Finding(rclcpp_elements.PAGE, 1, "elements",
                      f"not what the checks give: tools/check/rclcpp_elements.py > {rclcpp_elements.PAGE}")


def check_mutations(files):
    texts = {file.path: file.text for file in files}
    if mutations.PAGE not in texts:  # a tree of check_test.py
        return
    for name, (path, there, *_) in mutations.MUTATIONS.items():
        right = mutations.plain(there)
        count = texts.get(path, "").count(right)
        if count != 1:
            yield Finding(mutations.PAGE, 1, "mutation", f"{name}: '{right}' stands {count} times in {path}")
    if ignored.TABLE in texts:
        for fact in ignored.without_mutation(texts[ignored.TABLE], mutations.MUTATIONS):
            yield Finding(ignored.TABLE, 1, "mutation", f"'{fact}' counts, and no mutation is called 'ignored: {fact}'")


def check_generated(listed, root):
    for path in listed.split("\0"):
        if path.endswith(".html") and (root / path).is_file():
            yield Finding(path, 1, "generated", "write it into build/")


def check_format(files, root):
    """One finding for each file that clang-format would change."""
    paths = [file.path for file in files if file.suffix in CPP]
    if not paths:
        return
    done = subprocess.run(["clang-format", "--dry-run", *paths], cwd=root, text=True,
                          stderr=subprocess.PIPE, check=True)
    seen = set()
    for path, line in re.findall(r"^(.+?):(\d+):\d+: warning: .*clang-format", done.stderr,
                                 re.MULTILINE):
        if path not in seen:
            seen.add(path)
            yield Finding(path, int(line), "format", "not as clang-format has it: ./dev format")


def check_subjects(root, since):
    """A clone that does not have that commit has nothing to check."""
    log = subprocess.run(["git", "log", "--format=%h %s", f"{since}..HEAD"], cwd=root, text=True,
                         capture_output=True, check=False)
    for line in log.stdout.splitlines():
        commit, subject = line.split(" ", 1)
        if len(subject) > MOST_OF_SUBJECT:
            yield Finding(commit, 1, "subject", f"{len(subject)} characters: {subject}")


# ---- Exceptions ----

def read_exceptions(path):
    """(path, rule) → how much is allowed."""
    allowed = {}
    if path.exists():
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            words = line.split()
            if not words or words[0].startswith("#"):
                continue
            if len(words) != 3 or words[1] not in RULES or not words[2].isdigit():
                sys.exit(f"{path}:{number}: write: PATH RULE NUMBER")
            allowed[words[0], words[1]] = int(words[2])
    return allowed


HEADER = """\
# Findings that are older than their rule: path, rule, number. The numbers only fall:
# `./dev check --update` lowers them, and follows files that have moved.
"""


def update(path, allowed, found):
    """Writes down what is found; refuses where the sum of a rule would grow."""
    for rule in RULES:
        before = sum(count for key, count in allowed.items() if key[1] == rule)
        now = sum(count for key, count in found.items() if key[1] == rule)
        if now > before:
            sys.exit(f"{rule}: {now} found, and the exceptions allow {before}: repair the rest first")
    width = max((len(key[0]) for key in found), default=0)
    rows = [f"{key[0]:{width}}  {key[1]:15} {count:4}\n" for key, count in sorted(found.items())]
    path.write_text(HEADER + "".join(rows), encoding="utf-8")


def report(findings, allowed, found):
    """Prints what is not allowed, and a summary. True when there is nothing."""
    wrong = collections.Counter()
    for finding in sorted(findings, key=lambda each: (each.path, each.line)):
        if found[finding.path, finding.rule] > allowed.get((finding.path, finding.rule), 0):
            print(f"{finding.path}:{finding.line}: {finding.message}")
    for (path, rule), limit in sorted(allowed.items()):
        now = found[path, rule]
        if now > limit:
            print(f"{path}:1: {rule}: {now}, and the exceptions allow {limit}")
        elif now < limit:
            wrong[rule] += 1
            print(f"{path}:1: {rule}: {now}, and the exceptions allow {limit} still: "
                  "./dev check --update")
    for (path, rule), now in found.items():
        wrong[rule] += now > allowed.get((path, rule), 0)
    print(f"{'':15} {'found':>6} {'allowed':>8}")
    for rule, meaning in RULES.items():
        sums = [sum(count for key, count in table.items() if key[1] == rule)
                for table in (found, allowed)]
        verdict = f"FAILED in {wrong[rule]}" if wrong[rule] else "ok"
        print(f"{rule:15} {sums[0]:6} {sums[1]:8}  {verdict:13} {meaning}")
    return not wrong.total()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--root", type=pathlib.Path, help="the tree; else the one of this file",
                        default=pathlib.Path(__file__).resolve().parents[2])
    parser.add_argument("--update", action="store_true",
                        help="lowers the exceptions to what is found")
    parser.add_argument("--since", default=SUBJECTS_SINCE, metavar="COMMIT",
                        help="the subjects of later commits are checked (default: %(default)s)")
    options = parser.parse_args()
    root = options.root
    listed = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
                            cwd=root, capture_output=True, text=True, check=True).stdout
    files = []
    for path in sorted(set(listed.split("\0")) - {""}):
        is_read = (pathlib.PurePath(path).suffix in PROSE or path in SCRIPTS
                   or path.endswith("CMakeLists.txt"))
        if is_read and "/testdata/" not in path and (root / path).is_file():
            files.append(File(path, (root / path).read_text(encoding="utf-8")))
    findings = [*check_format(files, root), *check_once(files), *check_generated(listed, root), *check_limits(files),
                *check_elements(files), *check_mutations(files), *check_subjects(root, options.since)]
    for file in files:
        for rule in (check_file_length, check_function_length, check_class_size, check_spdx, check_public,
                     check_contract, check_keep, check_lines, check_environment, check_links, check_phrases,
                     check_one_list, check_time_sums, check_time_texts):
            findings.extend(rule(file, root))
    found = collections.Counter()
    for finding in findings:
        found[finding.path, finding.rule] += finding.weight
    allowed = read_exceptions(root / EXCEPTIONS)
    if options.update:
        update(root / EXCEPTIONS, allowed, found)
    else:
        holds = report(findings, allowed, found)
        print(classes.of_folder(files, "executors/engine/"))
        if not holds:
            sys.exit(1)


main()
