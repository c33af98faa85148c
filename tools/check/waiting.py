"""How tests may wait: with an end, see testing/eventually.hpp and cmake/checks.py.
SPDX-License-Identifier: Apache-2.0
"""
import ast
import pathlib
import re

import cpp_source

PARENTHESES = r"\((?:[^(){};]|\((?:[^(){};]|\((?:[^(){};]|\([^(){};]*\))*\))*\))*\)"
PAUSE = r"(?:std::this_thread::(?:yield|sleep_for|sleep_until)|u?sleep|sched_yield|nanosleep)\([^;{}]*\);"
# Nothing else happens in it. Without a pause, only a comparison waits for others: what is called until
# it returns false does work.
LOOP = re.compile(rf"\b(?:while|for) (?P<until>{PARENTHESES})\s*(?P<body>{PAUSE}|;|\{{\s*(?:{PAUSE})?\s*\}})")
WAITS = re.compile(r"^(?:\(!|[^&]* [!=]= )[^&]*$")
HAS_END = re.compile(r"\bnow\(\)|;.*;")  # a time, or a number of rounds


def is_test(path):
    path = pathlib.PurePath(path)
    return ("_test." in path.name or path.parts[0] == "testing" or "tests" in path.parts
            or {"conformance", "sequences"} & set(path.parts))


def endless(path, text):
    """(line number, what is wrong)"""
    if not is_test(path):
        return
    if path.endswith((".cpp", ".hpp")):
        code = cpp_source.without_comments(text)
        for loop in LOOP.finditer(code):
            waits = "(" in loop["body"] or WAITS.search(loop["until"])
            if waits and not HAS_END.search(loop["until"]):
                yield code.count("\n", 0, loop.start()) + 1, "a test may hang here: use eventually()"
    elif path.endswith(".py"):
        for loop in ast.walk(ast.parse(text, path)):
            if not isinstance(loop, ast.While) or "monotonic" in ast.unparse(loop.test):
                continue
            steps = {ast.unparse(step).split("(")[0] for step in loop.body}
            if steps <= {"pass", "time.sleep"} and ("time.sleep" in steps or re.search("not |!=| is ", ast.unparse(loop.test))):
                yield loop.lineno, "a test may hang here: use checks.eventually()"
