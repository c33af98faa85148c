#!/usr/bin/env python3
"""Tests of what takt_messages.py refuses: each file of testdata/bad yields its .txt, and no header.

usage: takt_messages_test.py IDLC PLUGIN CMAKE [--renew]
SPDX-License-Identifier: Apache-2.0
"""
import os
import pathlib
import subprocess
import sys
import tempfile

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../cmake"))
from checks import check, finish  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent
BAD = HERE / "testdata" / "bad"
idlc, plugin, cmake = sys.argv[1:4]
renew = sys.argv[4:] == ["--renew"]


def make(tree, file, *options):
    command = [HERE / "takt_messages.py", "--package", "pkg", "--tree", tree, *options, file]
    return subprocess.run(command, cwd=BAD, capture_output=True, text=True, check=False,
                          timeout=60)


def test_bad_files(work):
    files = sorted(file for file in BAD.iterdir() if file.suffix != ".txt")
    check(f"there are bad files ({len(files)})", len(files) > 20)
    for file in files:
        tree = work / file.name
        done = make(tree, file.name, "--idlc", idlc, "--plugin", plugin)
        check(f"{file.name}: is refused ({done.returncode})", done.returncode == 1)
        check(f"{file.name}: makes no header", not list(tree.rglob("*.hpp")))
        expected = file.with_name(file.name + ".txt")
        if renew:
            expected.write_text(done.stderr)
        check(f"{file.name}: prints what {expected.name} contains", done.stderr == expected.read_text(),
              f"it prints\n{done.stderr}and not\n{expected.read_text()}")


# idlc ends with 0 when it cannot load its back end; that must not pass for success.
def test_missing_plugin(work):
    good = HERE / "testdata" / "msg" / "Point.msg"
    done = make(work / "plugin", good, "--idlc", idlc, "--plugin", work / "none.so")
    check("a missing plugin", done.returncode == 1 and "cannot load generator" in done.stderr,
          done.returncode, done.stderr)
    done = make(work / "silent", good, "--idlc", "true", "--plugin", plugin)
    check("an idlc that does nothing",
          done.returncode == 1 and "has made nothing of it" in done.stderr,
          done.returncode, done.stderr)


# They held the program up, filled the memory, and left folders outside of the tree.
def test_files_of_others(work):
    folder = work / "msg"
    folder.mkdir()
    os.mkfifo(folder / "Fifo.msg")
    (folder / "Zero.msg").symlink_to("/dev/zero")
    (folder / "Large.msg").write_text("int32 a\n" * (1 << 18))
    (folder / "Latin.msg").write_bytes(b"string a # \xe4\n")
    for name, message in (("Fifo", "is no regular file"), ("Zero", "is no regular file"),
                          ("Large", "is larger than 1 MiB"), ("Latin", "is no UTF-8 text")):
        done = make(work / name, folder / f"{name}.msg", "--idlc", idlc, "--plugin", plugin)
        check(f"{name}: {message}", done.returncode == 1 and message in done.stderr, done.stderr)
    point = HERE / "testdata" / "msg" / "Point.msg"
    done = make(work / "deep" / "tree", point, "--package", "../../outside")
    check("a package is a name", done.returncode == 1 and "cannot be a package" in done.stderr
          and not (work / "outside").exists(), done.stderr)


def configure(work, call):
    source = work / "project"
    source.mkdir(exist_ok=True)
    (source / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.25)\nproject(p LANGUAGES NONE)\n"
        f"include({HERE}/TaktMessages.cmake)\n{call}\n")
    done = subprocess.run([cmake, "-S", source, "-B", source / "build", "--fresh"],
                          capture_output=True, text=True, check=False)
    check(f"{call} is refused", done.returncode != 0)
    return " ".join(done.stderr.split())


def test_cmake(work):
    point = HERE / "testdata" / "msg" / "Point.msg"
    hidden = f"set(CMAKE_IGNORE_PATH {pathlib.Path(idlc).parent} /usr/bin /bin)"
    for call, message in (
            ("takt_add_messages(m)", "is what it takes"),
            ("takt_add_messages(m none.msg)", "there is no file"),
            (f"takt_add_messages(m {point} {point})", "another file of this target"),
            (f"{hidden}\ntakt_add_messages(m {point})", "apt-get install cyclonedds-tools")):
        text = configure(work, call)
        check(f"{call}: '{message}'", message in text, text)


with tempfile.TemporaryDirectory() as folder:
    for test in (test_bad_files, test_missing_plugin, test_files_of_others, test_cmake):
        test(pathlib.Path(folder))
finish()
