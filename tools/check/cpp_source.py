"""Finds functions and classes in C++ that clang-format has laid out.

No parser: a brace with a space before it opens a body, one without opens a list of values.
SPDX-License-Identifier: Apache-2.0
"""
import dataclasses
import re

# What may hold braces without being code. A quote between digits is no quote.
NO_CODE = re.compile(r"""//[^\n]* | /\*.*?\*/
                       | R"([^(\s]*)\(.*?\)\1" | "(?:\\.|[^"\\\n])*"
                       | '(?:\\[^'\n]+|[^'\\\n])'
                       | ^[ \t]*\#(?:[^\n]*\\\n)*[^\n]*""", re.DOTALL | re.MULTILINE | re.VERBOSE)
# What stands before the first word of a declaration: also macros without a semicolon.
BEFORE = re.compile(r"(?:\s|(?:public|private|protected):|[A-Z][A-Z_]+\((?:[^()]|\([^()]*\))*\)\s*\n)*")
TEMPLATE = re.compile(r"template\s*<(?:[^<>]|<(?:[^<>]|<[^<>]*>)*>)*>\s*"
                      r"(?:requires\b[^{(]*?(?=\b(?:class|struct)\b))?")
SCOPE = re.compile(r"""(?:inline\s+)?(?P<kind>namespace|class|struct|union|enum(?:\s+(?:class|struct))?|extern\s*$)
                       (?:\s+(?:\[\[[^\]]*\]\]|alignas\([^)]*\)|[A-Z][A-Z_]{2,}(?=\s+\w)))*
                       \s*(?P<name>[\w:<>]*)""", re.VERBOSE)


@dataclasses.dataclass
class Scope:
    """What a brace has opened."""
    kind: str  # "namespace", "class", "struct", "function", "values", ...
    name: str
    begin: int  # where its declaration begins
    head: int  # where the declaration begins that goes on after "values"
    parentheses: int  # how many were open before it


def without_comments(text):
    """The code, with spaces for all that is none: places and lines stay the same."""
    return NO_CODE.sub(lambda found: re.sub(r"[^\n]", " ", found[0]), text)


def function_name(declaration):
    test = re.match(r"[A-Z_]+\([^)]*\)", declaration)
    if test:
        return " ".join(test[0].split())
    return re.search(r"([\w:~]*[^\w\s(]*)\s*\(", declaration)[1].lstrip(":")


def opened(code, head, brace, outer):
    """The scope of the brace, whose declaration begins at `head`."""
    begin = BEFORE.match(code, head, brace).end()
    declaration = TEMPLATE.sub("", code[begin:brace].replace("->", "  "))
    scope = SCOPE.match(declaration)
    kind, name = "block", ""
    if outer not in ("", "namespace", "class", "struct", "union", "extern"):
        pass
    elif scope:
        kind, name = scope["kind"].strip(), scope["name"]
    elif "(" in declaration:
        kind = "function"
        name = function_name(declaration)
    return Scope(kind, name, begin, brace + 1, 0)


def outline(text):
    """Yields (kind, name, first line, last line, names of the scopes around) of what has a body."""
    code = without_comments(text)
    scopes = []
    head = parentheses = 0
    for found in re.finditer(r"[(){};]", code):
        at, sign = found.start(), found[0]
        if sign in "()":
            parentheses += 1 if sign == "(" else -1
        elif sign == ";":
            if parentheses == 0:
                head = at + 1
        elif sign == "{":
            outer = scopes[-1].kind if scopes else ""
            if parentheses > 0 or not code[at - 1].isspace():
                scope = Scope("values", "", at, head, parentheses)
            else:
                scope = opened(code, head, at, outer)
                head = at + 1
            scopes.append(scope)
            parentheses = 0
        elif scopes:
            scope = scopes.pop()
            parentheses = scope.parentheses
            head = scope.head if scope.kind == "values" else at + 1
            if scope.kind not in ("values", "block"):
                yield (scope.kind, scope.name, code.count("\n", 0, scope.begin) + 1,
                       code.count("\n", 0, at) + 1, [(each.kind, each.name) for each in scopes])


def comment_above(lines, line):
    """The // lines right above a line (from 1), as one text."""
    first = line - 1
    while first > 0 and lines[first - 1].lstrip().startswith("//"):
        first -= 1
    return "\n".join(lines[first:line - 1])
