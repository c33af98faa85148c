#!/usr/bin/env python3
"""Makes C++ headers from interface files, for takt_add_messages of CMake.

usage: takt_messages.py --package NAME --tree FOLDER [--idlc PROGRAM --plugin LIBRARY]
                        [-I FOLDER]... [--print-headers] [--register FILE] FILE...

1. Each FILE is put into the tree as TREE/NAME/msg/Scan.idl: an .idl as it is, and ROS 2's .msg,
   .srv and .action in IDL's words, the same as rosidl's. Those of other trees, which are among the
   folders after -I, are linked into it: idlc 0.10.2 crashes on many folders, and so needs one only.
2. idlc with our plugin makes C++ of each, beside it: TREE/NAME/msg/scan.hpp. So an include of an
   IDL file is one of the header beside that file.
3. With --register, a C++ file that registers all types of these headers.

SPDX-License-Identifier: Apache-2.0
"""
import argparse
import ast
import json
import os
import pathlib
import re
import subprocess
import sys

MARK = ".takt_messages"  # lies in each tree
SHIPPED = pathlib.PurePath("takt/messages")  # the tree of ROS 2's packages, below Takt's headers
KINDS = ("msg", "srv", "action")
SECTIONS = {"msg": ("",), "srv": ("_Request", "_Response"),
            "action": ("_Goal", "_Result", "_Feedback")}
TYPES = {"bool": "boolean", "byte": "octet", "char": "uint8", "float32": "float",
         "float64": "double", "string": "string", "wstring": "string",
         **{name: name for bits in (8, 16, 32, 64) for name in (f"int{bits}", f"uint{bits}")}}
STRINGS = ("string", "wstring")
# What idlc 0.10 answers with no more than "syntax error".
UNKNOWN_TO_IDLC = {
    "map": "use a sequence of structs with a key and a value",
    "wstring": "use string, in UTF-8",
    "wchar": "use uint16",
    "any": "use sequence<octet>",
    "fixed": "use int64, and say its unit in the name",
    "interface": "leave it out: messages are structs",
    "valuetype": "leave it out: messages are structs",
}
# takt_idl.c knows them. They may be defined once only.
ANNOTATIONS = """#ifndef TAKT_ANNOTATIONS
#define TAKT_ANNOTATIONS
@annotation takt_default_list { string value; };
@annotation takt_wide { };
#endif
"""


MOST_BYTES = 1 << 20  # of an interface file


class Wrong(Exception):
    """What is wrong, where, what to do."""


def read_interface(file):
    """A FIFO would hold us up, and /dev/zero never ends."""
    if not file.is_file():
        raise Wrong(f"{file}: is no regular file")
    with open(file, encoding="utf-8") as opened:
        text = opened.read(MOST_BYTES + 1)
    if len(text) > MOST_BYTES:
        raise Wrong(f"{file}: is larger than 1 MiB")
    return text


def printable(text):
    """What a file says must not steer the terminal."""
    return "".join(c if c.isprintable() or c == "\n" else repr(c)[1:-1] for c in text)


def snake_case(name):
    """As ROS 2 names its headers: LaserScan is laser_scan, and IMUData is imu_data."""
    name = re.sub(r"(.)([A-Z][a-z]+)", r"\1_\2", name)
    return re.sub(r"([a-z0-9])([A-Z])", r"\1_\2", name).lower()


def place(package, file):
    """Where an interface file lies in a tree: robot_msgs/msg/Scan.idl."""
    kind = file.suffix[1:]
    if kind == "idl":
        kind = file.parent.name if file.parent.name in KINDS else ""
    elif kind not in KINDS:
        raise Wrong(f"{file}: is no interface file; those end in .idl, .msg, .srv or .action")
    return pathlib.PurePath(package, kind, file.stem + ".idl")


def header_of(idl):
    return idl.with_name(snake_case(idl.stem) + ".hpp")


def guard_of(path):
    return re.sub(r"\W", "_", str(path)).upper() + "_"


def write(path, text):
    """Touches nothing that is so already, as all that includes it would be compiled again."""
    if path.exists() and path.read_text() == text:
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


# ---- ROS 2's interface files, in IDL's words ----

class RosInterface:
    """Translates one file. Each line of IDL names the line that it comes from."""

    FIELD = re.compile(r"(\S+)\s+([A-Za-z]\w*)\s*(?:(=)\s*)?(.*)")
    TYPE = re.compile(r"(?:([a-z]\w*)/)?([A-Za-z]\w*)(?:<=(\d+))?(\[(<=)?(\d*)\])?")

    def __init__(self, package, file, tree):
        self.package, self.file, self.tree = package, file, tree
        self.kind = file.suffix[1:]
        self.line = 1
        self.includes = []

    def wrong(self, what):
        return Wrong(f"{self.file}:{self.line}: {what}")

    def translate(self):
        if not re.fullmatch(r"[a-z][a-z0-9_]*", self.package):
            raise self.wrong(f"'{self.package}' cannot be a package of ROS 2, which is lower case; "
                             "give another with PACKAGE")
        if not re.fullmatch(r"[A-Z][A-Za-z0-9]*", self.file.stem):
            raise self.wrong(f"'{self.file.stem}' cannot be a type of ROS 2; its file has a name "
                             "like LaserScan, of letters and digits")
        endings = SECTIONS[self.kind]
        sections = [([], [])]  # constants and fields
        for self.line, text in enumerate(read_interface(self.file).splitlines(), 1):
            text = self.without_comment(text).strip()
            if text == "---":
                sections.append(([], []))
            elif text:
                is_constant, words = self.declaration(text)
                sections[-1][0 if is_constant else 1].append(f"// line {self.line}\n{words}")
        if len(sections) != len(endings):
            raise self.wrong(f"the number of parts is {len(sections)}, and that of a .{self.kind} "
                             f"file {len(endings)}; lines of '---' are between them")
        idl = [f'#include "{path}"' for path in sorted(set(self.includes))]
        idl.append(f"module {self.package} {{ module {self.kind} {{")
        for ending, (constants, fields) in zip(endings, sections):
            name = self.file.stem + ending
            if constants:
                idl += [f"module {name}_Constants {{", *constants, "};"]
            fields = fields or ["uint8 structure_needs_at_least_one_member;"]
            idl += [f"struct {name} {{", *fields, "};"]
        return "\n".join(idl + ["}; };"])

    @staticmethod
    def without_comment(text):
        quote = ""
        for i, character in enumerate(text):
            if character == "#" and not quote:
                return text[:i]
            if character in "'\"" and quote in ("", character) and text[i - 1:i] != "\\":
                quote = "" if quote else character
        return text

    def declaration(self, text):
        match = self.FIELD.fullmatch(text)
        if match is None:
            raise self.wrong(f"'{text}' is no field; write TYPE NAME, TYPE NAME DEFAULT or "
                             "TYPE NAME=VALUE")
        type_text, name, is_constant, value = match.groups()
        match = self.TYPE.fullmatch(type_text)
        if match is None:
            raise self.wrong(f"'{type_text}' is no type")
        package, base, string_bound, array, is_bounded, size = match.groups()
        if string_bound and base not in STRINGS:
            raise self.wrong(f"'{type_text}': only strings and sequences have a bound")
        if is_constant and (array or package or base not in TYPES or base == "wstring"):
            raise self.wrong(f"'{type_text}' cannot be the type of a constant")
        idl = self.idl_type(package, base) + (f"<{string_bound}>" if string_bound else "")
        if is_constant:
            return True, f"const {idl.split('<')[0]} _{name} = {self.idl_value(base, value)};"

        default = ""
        if value and base not in TYPES:
            raise self.wrong(f"'{name}' is of type {base}, which cannot have a default value")
        values = [] if not value else self.values(base, value) if array else [self.one(base, value)]
        for one in values if string_bound else []:
            if len(one.encode()) > int(string_bound):
                raise self.wrong(f"{json.dumps(one)} does not fit into {base}<={string_bound}")
        if value and not array and (base == "wstring" or values[0] == -2**63):
            default = f"@takt_default_list({json.dumps(self.cpp_value(base, values[0]))}) "
        elif value and not array:
            default = f"@default({self.idl_value(base, value)}) "
        elif value:
            if len(values) > int(size or len(values)) or (
                    size and not is_bounded and len(values) != int(size)):
                raise self.wrong(f"{len(values)} values do not fit into {type_text}")
            listed = "{" + ", ".join(self.cpp_value(base, one) for one in values) + "}"
            default = f"@takt_default_list({json.dumps(listed)}) "
        if base == "wstring" and not package:
            default += "@takt_wide "
        # An underscore before an identifier says that it is no word of IDL; it is no part of it.
        if not array:
            return False, f"{default}{idl} _{name};"
        if size and not is_bounded:
            return False, f"{default}{idl} _{name}[{size}];"
        return False, f"{default}sequence<{idl}{', ' + size if size else ' '}> _{name};"

    def idl_type(self, package, base):
        if package is None and base in TYPES:
            return TYPES[base]
        if base in UNKNOWN_TO_IDLC:
            raise self.wrong(f"Takt's messages have no {base}; {UNKNOWN_TO_IDLC[base]}")
        package = package or self.package
        path = f"{package}/msg/{base}.idl"
        if not (self.tree / path).exists():
            raise self.wrong(f"{package}/{base} is not known; add its file to this target, or name "
                             "the target that has it after LIBRARIES")
        if pathlib.PurePath(path) != place(self.package, self.file):
            self.includes.append(path)
        return f"{package}::msg::{base}"

    def one(self, base, text):
        """The value in Python's terms."""
        try:
            if base == "bool":
                return {"true": True, "1": True, "false": False, "0": False}[text.lower()]
            if base in STRINGS:
                return ast.literal_eval(text) if text[:1] in ("'", '"') else text
            return float(text) if base.startswith("float") else int(text, 0)
        except (ValueError, KeyError, SyntaxError):
            raise self.wrong(f"'{text}' is no {base}") from None

    def values(self, base, text):
        if not (text.startswith("[") and text.endswith("]")):
            raise self.wrong(f"'{text}' is no list; write [VALUE, VALUE]")
        words = re.findall(r"""\s*("(?:\\.|[^"])*"|'(?:\\.|[^'])*'|[^,]+)\s*(?:,|$)""",
                           text[1:-1].strip())
        return [self.one(base, word.strip()) for word in words]

    def idl_value(self, base, text):
        value = self.one(base, text)
        if base == "bool":
            return str(value).upper()
        return json.dumps(value, ensure_ascii=False) if base == "string" else repr(value)

    @staticmethod
    def cpp_value(base, value):
        if base in ("bool", "string"):
            return json.dumps(value, ensure_ascii=False)
        if base == "wstring":
            return 'u"' + "".join(c if " " <= c <= "~" and c not in '"\\' else f"\\U{ord(c):08x}" for c in value) + '"'
        if value == -2**63:
            return "INT64_MIN"  # as -9223372036854775808 is a minus before a number too large
        return repr(value) + ("u" if TYPES[base].startswith("u") else "")


# ---- Both steps ----

def link_others(options, ours):
    for root in options.includes + [root / SHIPPED for root in options.includes]:
        if root == options.tree or not (root / MARK).exists():
            continue
        for idl in root.rglob("*.idl"):
            link = options.tree / idl.relative_to(root)
            if link in ours or link.exists():
                continue
            link.unlink(missing_ok=True)
            link.parent.mkdir(parents=True, exist_ok=True)
            link.symlink_to(idl.resolve())


def stage(options, file, idl):
    """Step 1."""
    if file.suffix == ".idl":
        text = "// line 1\n" + read_interface(file)
    else:
        text = ANNOTATIONS + RosInterface(options.package, file, options.tree).translate()
    guard = guard_of(idl.relative_to(options.tree))
    write(idl, f"#ifndef {guard}\n#define {guard}\n{text}\n#endif\n")


def explain(messages, file, idl):
    """idlc's messages, with the user's file and line in place of ours."""
    ours = idl.read_text().splitlines()
    result = []
    for message in messages.splitlines():
        match = re.match(re.escape(str(idl)) + r":(\d+):(?:\d+:)? (?:error: )?(.*)", message)
        if "@verbatim" in message:
            continue  # a comment, of which idlc says that it leaves it out
        if match is None:
            if not re.match(r"Failed to compile|\d+ errors? in preprocessor|    #include", message):
                result.append(message)
            continue
        number, what = int(match[1]), match[2]
        line = number  # of the user's file, from the last remark of where we are there
        for above in range(min(number, len(ours)), 0, -1):
            if remark := re.fullmatch(r"// line (\d+)", ours[above - 1]):
                line = int(remark[1]) + number - above - 1
                break
        if what == "syntax error":
            words = re.findall(r"\w+", ours[number - 1]) if number <= len(ours) else []
            for word in [word for word in words if word in UNKNOWN_TO_IDLC][:1]:
                what = f"Takt's messages have no {word}; {UNKNOWN_TO_IDLC[word]}"
        if "include file" in what:
            what += "; add it to this target, or name the target that has it after LIBRARIES"
        result.append(f"{file}:{line}: {what}")
    return "\n".join(result)


def compile_idl(options, file, idl):
    """Step 2."""
    header = header_of(idl)
    body = idl.with_suffix(".body")
    body.unlink(missing_ok=True)
    command = [options.idlc, "-l", str(options.plugin), "-f", "case-sensitive", "-W",
               "no-implicit-extensibility", "-I", str(options.tree), "-H", str(body), str(idl)]
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          check=False)
    messages = explain(done.stdout, file, idl)
    # idlc may end with 0 though it could not load the plugin.
    if done.returncode != 0 or not body.exists():
        header.unlink(missing_ok=True)
        raise Wrong(messages or f"{file}: {options.idlc} has made nothing of it, and says nothing; "
                    f"try: {' '.join(command)}")
    if messages:
        print(printable(messages), file=sys.stderr)
    text = re.sub(r'(?m)^#include "(.*)"$',
                  lambda match: f'#include "{include(options, file, pathlib.Path(match[1]))}"',
                  body.read_text())
    body.unlink()
    guard = guard_of(header.relative_to(options.tree))
    write(header, f"// Made from {file.name} by takt_add_messages; it will be made again.\n"
          f"#ifndef {guard}\n#define {guard}\n\n{refusal(options, idl)}"
          f"#include <memory>\n#include <string>\n#include <utility>\n\n"
          f'#include "takt/messages/message_type.hpp"\n{text}\n#endif  // {guard}\n')
    guard = guard_of(header.with_suffix(".h").relative_to(options.tree))
    write(header.with_suffix(".h"), f"// Made from {file.name} by takt_add_messages; it will be made again.\n"
          f"// Programs in C++ also include ROS 2's header in C.\n#ifndef {guard}\n#define {guard}\n\n"
          f'#ifndef __cplusplus\n#error "Takt has no messages in C: compile this file as C++"\n#endif\n\n'
          f'#include "{header.name}"\n\n#endif  // {guard}\n')


def refusal(options, idl):
    """Of ROS 2's own header of the same type."""
    package, kind, *_ = idl.relative_to(options.tree).parts
    if kind not in KINDS:
        return ""
    name = snake_case(idl.stem)
    header = f"{package}/{kind}/{name}.hpp"
    theirs = "__".join((package, kind, "detail", name, "struct_hpp_")).upper()
    return (f"#ifdef {theirs}\n#error \"ROS 2's {header} has been included before Takt's; both define "
            f"the same types: include only one of them in a file\"\n#endif\n\n")


def include(options, file, idl):
    if idl.is_relative_to(options.tree):
        inside = idl.relative_to(options.tree)
        root = idl.resolve().parents[len(inside.parts) - 1]
        is_shipped = root.parts[-len(SHIPPED.parts):] == SHIPPED.parts
        return (SHIPPED if is_shipped else pathlib.PurePath()) / header_of(inside)
    raise Wrong(f"{file}: includes {idl}, of which there is no header; add it to this target, or "
                "name the target that has it after LIBRARIES")


def registration(headers):
    """Step 3."""
    types = []
    for header in headers:
        scope = ""
        for line in header.read_text().splitlines():
            if match := re.fullmatch(r"namespace (\S+) {", line):
                scope = match[1]
            elif match := re.fullmatch(r"using (\w+) = \1_<std::allocator<void>>;", line):
                types.append(f"::{scope}::{match[1]}" if scope else f"::{match[1]}")
            elif line.startswith("}  // namespace"):
                scope = ""
    includes = "".join(f'#include "{header}"\n' for header in headers)
    registered = f"\nTAKT_REGISTER_MESSAGES({', '.join(types)})\n" if types else ""
    return (f"// Made by takt_add_messages; it will be made again.\n{includes}"
            f'#include "takt/messages/message_types.hpp"\n{registered}')


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--package", required=True)
    parser.add_argument("--tree", type=pathlib.Path, required=True)
    parser.add_argument("--idlc", default="idlc")
    parser.add_argument("--plugin", type=pathlib.Path)
    parser.add_argument("-I", dest="includes", action="append", type=pathlib.Path, default=[])
    parser.add_argument("--print-headers", action="store_true")
    parser.add_argument("--register", type=pathlib.Path)
    parser.add_argument("files", type=pathlib.Path, nargs="+")
    options = parser.parse_args()
    options.tree = pathlib.Path(os.path.abspath(options.tree))
    if not re.fullmatch(r"\w[\w.+-]*", options.package):
        print(f"'{options.package}' cannot be a package: it is one name, of letters, digits and '_'", file=sys.stderr)
        return 1
    wrong = []

    def each(step, work):
        for item in work:
            try:
                step(*item)
            except Wrong as error:
                wrong.append(str(error))
            except OSError as error:
                wrong.append(f"{error.filename or item[0]}: {error.strerror}")
            except UnicodeDecodeError:
                wrong.append(f"{item[0]}: is no UTF-8 text")

    work = []
    each(lambda file: work.append((file, options.tree / place(options.package, file))),
         [(file,) for file in options.files])
    twice = {idl for _, idl in work if [other for _, other in work].count(idl) > 1}
    wrong.extend(f"{file}: another file of this target is {idl.relative_to(options.tree)} too; "
                 "rename one" for file, idl in work if idl in twice)
    if options.print_headers and not wrong:
        print(";".join(str(header_of(idl).relative_to(options.tree)) for _, idl in work), end="")
        return 0
    if not wrong:
        for _, idl in work:  # so that those that come first know of all
            idl.parent.mkdir(parents=True, exist_ok=True)
            idl.touch(exist_ok=True)
        write(options.tree / MARK, "")
        link_others(options, {idl for _, idl in work})
        each(lambda file, idl: stage(options, file, idl), work)
    if not wrong:
        each(lambda file, idl: compile_idl(options, file, idl), work)
    if options.register and not wrong:
        write(options.register, registration([header_of(idl) for _, idl in work]))
    if wrong:
        print(printable("\n".join(wrong)), file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
