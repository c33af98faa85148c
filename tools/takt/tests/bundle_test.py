#!/usr/bin/env python3
"""A comparison that another machine repeats, and bundles that nobody should open: bundle_test.py TAKT SCHEDULERS COMPONENTS

SCHEDULERS and COMPONENTS are libraries of tests. The archives of a stranger are written by Python.
SPDX-License-Identifier: Apache-2.0
"""
import csv
import ctypes
import hashlib
import io
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../cmake"))
from checks import check, environment, finish, proves  # noqa: E402

takt, schedulers, components = map(os.path.abspath, sys.argv[1:4])
folder = pathlib.Path(tempfile.mkdtemp())
(folder / "here").mkdir()
(folder / "there").mkdir()


def run(*words, cwd="here", status=0):
    done = subprocess.run([takt, *map(str, words)], cwd=folder / cwd, env=environment, stdin=subprocess.DEVNULL, text=True,
                          capture_output=True, timeout=300)
    check(f"takt {' '.join(map(str, words))}: status {status}", done.returncode == status, done.returncode, done.stdout[-2000:], done.stderr)
    return done.stdout, done.stderr


# ---- There and back ----
ROBOT = """
schedulers: {{good: {{library: {library}}}}}
executors: {{control: {{type: events, scheduler: good}}}}
container:
  components:
    - {{component: takt::Workload, name: bumper, executor: control, parameters: {{publishers: {{topic: [contact], period_us: [10000], work_us: [1000]}}}}}}
    - {{component: takt::Workload, name: motor, executor: control, parameters_file: parts/motor.yaml}}
    - {{component: takt::Workload, name: camera, executor: control, parameters: {{publishers: {{topic: [image], period_us: [33000], work_us: [5000]}}}}}}
"""
(folder / "here/parts").mkdir()
shutil.copy(schedulers, folder / "here/parts/libmine.so")
(folder / "here/robot.yaml").write_text(ROBOT.format(library="parts/libmine.so"))
(folder / "here/parts/motor.yaml").write_text("motor: {ros__parameters: {subscriptions: {topic: [contact], work_us: [2000]}}}\n")
(folder / "here/own.yaml").write_text("executors: {all: {type: events, scheduler: edf}}\n"
                                      "container: {components: [{component: takt::Workload, name: nobody}]}\n")
COMPARE = ("compare", "robot.yaml", "--executors", "file,single_threaded", "--as", "./own.yaml", "--simulate", "--duration", "1s", "--repeat", "6")
run(*COMPARE, "--bundle", "robot.tar.zst")
bundle = folder / "here/robot.tar.zst"
check("it is compressed", bundle.read_bytes()[:4] == b"\x28\xb5\x2f\xfd", bundle.read_bytes()[:8])
before = bundle.read_bytes()
_, errors = run(*COMPARE, "--bundle", "robot.tar.zst", status=2)
check("one that is there stays", "--force" in errors and bundle.read_bytes() == before, errors)
run(*COMPARE, "--bundle", "robot.tar.zst", "--force")
check("the same comparison is the same bundle, but for the load", abs(len(bundle.read_bytes()) - len(before)) < 200)

shown, _ = run("bundle", bundle, cwd="there")
there = folder / "there/robot"
check("its files are there", sorted(str(path.relative_to(there)) for path in there.rglob("*") if path.is_file()) ==
      ["before.compared.json", "bundle.json", "own.yaml", "parts/libmine.so", "parts/motor.yaml", "robot.yaml", "run"], list(there.rglob("*")))
script = (there / "run").read_text()
check("it shows its script, and runs nothing", script in shown and "nothing was run" in shown and "ratios" not in shown, shown)
check("it says which Takt made it", re.search(r"^made by Takt (\d+\.\d+\.\d+); this is \1$", shown, re.M), shown)
check("with the words of the comparison", "compare robot.yaml --executors file,single_threaded --as own.yaml --duration 1s --repeat 6 "
      "--simulate --against before" in script, script)
manifest = json.loads((there / "bundle.json").read_text())["files"]
check("its manifest has their hashes", manifest["robot.yaml"]["sha256"] == hashlib.sha256((there / "robot.yaml").read_bytes()).hexdigest(),
      manifest)
_, errors = run("bundle", bundle, cwd="there", status=2)
check("a folder that is there stays", "robot: the folder cannot be made" in errors and "--into" in errors, errors)

shutil.move(folder / "here/parts", folder / "gone")  # as on another machine
again, _ = run("bundle", bundle, "--into", "again", "--run", *(["--as-root"] if os.geteuid() == 0 else []), cwd="there")
check("it is repeated, with its library", again.count("no real difference from") == 3 and "(before)" in again, again)
shutil.move(folder / "gone", folder / "here/parts")
if os.geteuid() == 0:
    _, errors = run("bundle", bundle, "--into", "third", "--run", cwd="there", status=2)
    check("as root only if asked", "--as-root" in errors and not (folder / "there/third").exists(), errors)
_, errors = run("bundle", bundle, "--as-root", cwd="there", status=2)
check("which is for running", "--run" in errors, errors)

# Components of the index come with it, too.
(folder / "prefix/share/takt/components").mkdir(parents=True)
(folder / "prefix/lib").mkdir()
shutil.copy(components, folder / "prefix/lib/libparts.so")
(folder / "prefix/share/takt/components/parts").write_text("guests::Good;lib/libparts.so\n")
(folder / "here/indexed.yaml").write_text("container: {components: [{component: guests::Good, name: good}]}\n")
environment["TAKT_COMPONENT_PATH"] = str(folder / "prefix")
run("compare", "indexed.yaml", "--executors", "events", "--simulate", "--duration", "100ms", "--bundle", "indexed.tar.zst")
del environment["TAKT_COMPONENT_PATH"]
run("bundle", folder / "here/indexed.tar.zst", cwd="there")
check("with an index", (folder / "there/indexed/share/takt/components/bundle").read_text() == "guests::Good;lib/libparts.so\n")
check("and the library", (folder / "there/indexed/lib/libparts.so").read_bytes() == pathlib.Path(components).read_bytes())

# Names need not be English.
shutil.copy(folder / "here/own.yaml", folder / "here/räder.yaml")
run("compare", "räder.yaml", "--executors", "events", "--simulate", "--duration", "100ms", "--bundle", "über.tar.zst")
run("bundle", folder / "here/über.tar.zst", cwd="there")
check("whatever the locale is", (folder / "there/über/räder.yaml").exists())
run("simulate", "robot.yaml", "--scheduler", "good", "--duration", "100ms")  # which the file itself brings

# ---- What cannot be bundled ----
(folder / "here/far.yaml").write_text(ROBOT.format(library=schedulers))
_, errors = run("compare", "far.yaml", "--executors", "file", "--simulate", "--duration", "100ms", "--bundle", "far.tar.zst", status=2)
check("a library that is elsewhere", "leads out of the file's folder" in errors and "far.yaml" in errors, errors)
(folder / "here/other").mkdir()
(folder / "here/other/own.yaml").write_text((folder / "here/own.yaml").read_text())
_, errors = run("compare", "own.yaml", "other/own.yaml", "--executors", "events", "--bundle", "two.tar.zst", status=2)
check("two files of one name", "would have the name 'own.yaml'" in errors, errors)
shutil.copy(folder / "here/own.yaml", folder / "here/run")
_, errors = run("compare", "./run", "--executors", "events", "--bundle", "two.tar.zst", status=2)
check("the name of the script", "which has one of its own" in errors, errors)
(folder / "here/link.yaml").symlink_to("parts/motor.yaml")
(folder / "here/linked.yaml").write_text(ROBOT.format(library="parts/libmine.so").replace("parts/motor.yaml", "link.yaml"))
_, errors = run("compare", "linked.yaml", "--executors", "file", "--bundle", "linked.tar.zst", status=2)
check("a link", "link.yaml" in errors and "in the bundle alone, the file is not valid" in errors, errors)
_, errors = run("compare", "own.yaml", "--bundle", "own.zip", status=2)
check("another kind of archive", "end it with .tar.zst" in errors, errors)
_, errors = run("compare", "--executors", "events", "--bundle", "program.tar.zst", "--", "true", status=2)
check("a program", "--bundle is for containers" in errors, errors)


# A container would carry what libarchive links: 1.4 MB.
check("the command links no libarchive", b"libarchive.so" not in pathlib.Path(takt).read_bytes())


# ---- Its figure ----
if subprocess.run(["/usr/bin/python3", "-I", "-c", "import matplotlib"], capture_output=True).returncode == 0:
    run(*COMPARE, "--figure", "figure.pdf")
    check("a PDF", (folder / "here/figure.pdf").read_bytes().startswith(b"%PDF-"))
    points = list(csv.DictReader(io.StringIO((folder / "here/figure.csv").read_text())))
    check("of each row, up to its slowest", [point["row"] for point in points if point["share_not_above"] == "1"] ==
          ["file", "single_threaded", "./own.yaml"], points)
    _, errors = run(*COMPARE, "--figure", "figure.pdf", status=2)
    check("what is there stays", "--force" in errors, errors)
    (folder / "here/figure.pdf").unlink()
    _, errors = run(*COMPARE, "--figure", "figure.pdf", status=2)
    check("its data, too", "figure.csv" in errors and "--force" in errors, errors)
else:
    _, errors = run(*COMPARE, "--figure", "figure.pdf", status=2)
    check("it says what is missing", "python3-matplotlib" in errors, errors)
_, errors = run(*COMPARE, "--figure", "another.png", status=2)
check("of one format", "end it with .pdf" in errors, errors)


# ---- Bundles of strangers ----
def archive(change=lambda tar: None, files=(("x/run", b"#!/bin/sh\n"),), manifest=None):
    """An archive of these files with a fitting manifest, and what `change` adds."""
    text = io.BytesIO()
    with tarfile.open(fileobj=text, mode="w") as tar:
        listed = {name.split("/", 1)[1]: {"bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()} for name, content in files}
        document = json.dumps({"files": listed if manifest is None else manifest}).encode()
        for name, content in [*files, ("x/bundle.json", document)]:
            info = tarfile.TarInfo(name)
            info.size = len(content)
            tar.addfile(info, io.BytesIO(content))
        change(tar)
    return text.getvalue()


def entry(name, kind=tarfile.REGTYPE, target=""):
    def add(tar):
        info = tarfile.TarInfo(name)
        info.type, info.linkname = kind, target
        tar.addfile(info)
    return add


def bomb():
    """300 MiB of zeros in 10 kB."""
    def big(tar):
        info = tarfile.TarInfo("x/big")
        info.size = 300 << 20
        tar.addfile(info, open("/dev/zero", "rb"))
    zstd, content = ctypes.CDLL("libzstd.so.1"), archive(big)
    zstd.ZSTD_compress.restype = ctypes.c_size_t
    room = ctypes.create_string_buffer(1 << 20)
    size = zstd.ZSTD_compress(room, ctypes.c_size_t(1 << 20), content, ctypes.c_size_t(len(content)), 1)
    return room.raw[:size]


SAID = proves("command_line.md", "Links, devices, names that lead out of its folder, more than 1,000 files or 256 MiB")
HOSTILE = {
    "a path that leads out": (archive(entry("x/../../out")), "is no name of a file"),
    "an absolute path": (archive(entry("/tmp/out")), "is no name of a file"),
    "a name that steers the terminal": (archive(entry("x/\x1b[2J")), r"is no name of a file"),
    "a file that is a folder, too": (archive(entry("x/run/more")), "is a file and a folder"),
    "another folder": (archive(entry("y/out")), "outside of its folder"),
    "a symbolic link": (archive(entry("x/link", tarfile.SYMTYPE, "/etc/passwd")), "no links, folders or devices"),
    "a hard link": (archive(entry("x/link", tarfile.LNKTYPE, "x/run")), "no links, folders or devices"),
    "a device": (archive(entry("x/zero", tarfile.CHRTYPE)), "no links, folders or devices"),
    "a FIFO": (archive(entry("x/pipe", tarfile.FIFOTYPE)), "no links, folders or devices"),
    "one name twice": (archive(entry("x/run")), "'run' twice"),
    "a file beside the manifest": (archive(entry("x/more")), "not those that its bundle.json lists"),
    "another content": (archive(manifest={"run": {"bytes": 10, "sha256": "0" * 64}}), "not those that its bundle.json lists"),
    "a manifest of another kind": (archive(manifest=[1]), "not those that its bundle.json lists"),
    "no script": (archive(files=[("x/a", b"")]), "it lacks"),
    "too many files": (archive(files=[(f"x/{i}", b"") for i in range(1001)]), "more than 1000 files"),
    "more bytes than any": (bomb(), "more than 256 MiB"),
    "a part of it": (bundle.read_bytes()[:-50], "damaged"),
    "nothing": (b"", "no bundle"),
    "something else": (b"#!/bin/sh\ntouch out\n" * 100, "no bundle"),
}
for number, (name, (content, expected)) in enumerate(HOSTILE.items()):
    (folder / f"here/{number}.tar.zst").write_bytes(content)
    _, errors = run("bundle", f"{number}.tar.zst", status=2)
    check(f"{SAID}: {name}", expected in errors and "nothing was written" in errors, errors)
    check("and nothing is written", not (folder / f"here/{number}").exists() and not (folder / "out").exists())

shutil.rmtree(folder)
finish()
