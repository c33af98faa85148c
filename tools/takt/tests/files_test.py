#!/usr/bin/env python3
"""Whatever lies where a command expects a file: it ends soon, in little memory, and with one error that names it.

usage: files_test.py TAKT COMPONENTS MESSAGES PLUGIN ROUNDS|SECONDSs [SEED]
       COMPONENTS: a library of components; MESSAGES: takt_messages.py; PLUGIN: that for idlc

1. In the place of each file that a command reads, lies a file that it cannot use.
2. In each round, the files of one kind are changed at random, and read by all commands of that kind.
   Round N of a seed is round 0 of the seed that is larger by N, so that one can be repeated alone.
"""
# SPDX-License-Identifier: Apache-2.0
import os
import pathlib
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time

from command import run as run_well, takt
from checks import check, environment, failures, finish
from limits import faults, run
from mutations import changed, definition, special_files

components, messages, plugin = (str(pathlib.Path(path).resolve()) for path in sys.argv[2:5])
budget = sys.argv[5]
seed = int(sys.argv[6]) if len(sys.argv) > 6 else random.randrange(1 << 32)
folder = pathlib.Path(tempfile.mkdtemp())
prefix = folder / "prefix"
environment |= {"AMENT_PREFIX_PATH": str(prefix), "TAKT_COMPONENT_PATH": str(prefix)}

# ---- What reads which kind of file ----

SYSTEM = """realtime: off
threads: {rt: {policy: SCHED_OTHER, affinity: [0]}}
executors: {e: {type: events, scheduler: fixed_priority, threads: [rt], wait: epoll}, f: {type: single_threaded}}
container:
  name: robot
  components:
    - component: takt::Workload
      name: a
      executor: e
      parameters: {publishers: {topic: [x], period_us: [1000], work_us: [10], size_bytes: [100], depth: [3]}}
      callbacks: {x_timer: {priority: 3, deadline: 10ms, execution: 1ms}}
    - {component: takt::Workload, name: b, executor: f, parameters: {relays: {input: [x], output: [z], work_us: [10]}}}
chains: [{name: chain, priority: 1, deadline: 100ms, path: [a/x_timer, b/x]}]
"""
PARTS = """dds: {domain: 7, discovery: lo, shared_memory: off}
memory: {lock: false}
containers:
  - {name: one, restart: {policy: on_failure, delay: 100ms}, components: [{component: takt::Workload}]}
  - {name: two, load: off, components: [&w {component: "takt::Workload", remap: {/a: /b}}, *w]}
"""
RECORDED = SYSTEM.replace("chains:", "".join(
    f"    - {{component: takt::Recorder, name: {name}, parameters: {{file: {name}.mcap, compression: {name}}}}}\n"
    for name in ("none", "lz4", "zstd")) + "chains:")
KEYS = {"identity_ca": "ca.pem", "certificate": "robot.pem", "private_key": "robot.key",
        "governance": "governance.p7s", "permissions": "permissions.p7s"}
PARAMETERS = "/**:\n  ros__parameters: {use_sim_time: false}\n/a:\n  b:\n    ros__parameters: {x: [1, 2], y: {z: 0.5}}\n"
# Without a node that has them, it is waited for: so this file is always of another.
SHORT = ("--duration", "10ms")
READERS = {  # the file is FILE
    "system": [("check", "FILE"), ("plan", "FILE"), ("analyze", "FILE"), ("simulate", "FILE", *SHORT),
               ("run", "FILE", *SHORT), ("compare", "FILE", *SHORT, "--executors", "file"),
               ("bench", "topologies", "FILE", *SHORT, "--repeat", "1")],
    "parts": [("check", "FILE"), ("plan", "FILE")],
    "workload": [("check", "FILE"), ("plan", "FILE"), ("run", "FILE", *SHORT)],
    "model": [("analyze", "system.yaml", "--model", "FILE")],
    "trace": [("model", "FILE", "-o", "out.yaml")],
    "comparison": [("compare", "system.yaml", *SHORT, "--executors", "file", "--repeat", "2", "--against", "FILE")],
    "recording": [("bag", "info", "FILE"), ("bag", "play", "FILE", "--delay", "0s"), ("run", "player.yaml", *SHORT)],
    "parameters": [("param", "load", "/nobody", "FILE", "--timeout", "100ms")],
    "library": [("interface", "show", "std_msgs/msg/String", "--library", "./FILE")],
    "index": [("component", "types"), ("list", "components")],
    "key": [("run", f"{key}.yaml", *SHORT) for key in KEYS],
    "definition": [("interface", "show", "fz/msg/T0"), ("interface", "show", "fz/msg/T0", "--json", "-"), ("topic", "pub", "/t", "fz/msg/T0", "{}", "-w", "0"),
                   ("topic", "echo", "/t", "--type", "fz/msg/T0", "--duration", "100ms")],
}
ENDINGS = {"recording": "mcap", "trace": "json", "comparison": "json", "workload": "json", "library": "so", "definition": "msg"}


def place(kind):
    """Where a file of this kind is looked for."""
    if kind == "definition":
        return prefix / "share/fz/msg/T0.msg"
    if kind == "index":
        return prefix / "share/takt/components/own"
    return folder / f"tried_{kind}.{ENDINGS.get(kind, 'yaml')}"


# ---- One command ----

def tried(what, words, names, is_refused=False, keep=()):
    status, output, errors = run(words, folder, environment)
    wrong = list(faults(status, output, errors, names, is_refused))
    if not wrong:
        return
    kept = tempfile.mkdtemp(prefix="takt_files_")
    for path in keep:
        shutil.copy(path, kept, follow_symlinks=False)
    check(f"{what}: {' '.join(map(str, words[:8]))}", False, f"seed {seed}: {'; '.join(wrong)}; kept: {kept}\n",
          errors[:2000], output[-500:], *(repr(pathlib.Path(path).read_bytes()[:1500]) for path in keep))


def commands(kind, path):
    for words in READERS[kind]:
        yield [takt, *(word.replace("FILE", path.name) for word in words)]
    if kind == "task set":
        yield from ([takt, "rta", method, path.name] for method in methods)


def names_of(kind, path):
    """What an error may name: this, or what else leads to it."""
    others = {"definition": ("fz/msg/T", "/t"), "key": ("`dds: {security",)}  # Cyclone does not say which key
    return (path.name, *others.get(kind, ()))


def translation(files):
    shutil.rmtree(folder / "tree", ignore_errors=True)
    return [messages, "--package", "fz", "--tree", str(folder / "tree"), "--plugin", plugin, *map(str, files)]


# ---- The files to begin with ----

def write_samples():
    """The valid files: by kind, the content of each."""
    samples = {"system": [SYSTEM], "parts": [PARTS, SYSTEM], "parameters": [PARAMETERS],
               "index": ["own::Part;lib/libown.so\n", f"own::Other;{components}\n"]}
    samples = {kind: [text.encode() for text in texts] for kind, texts in samples.items()}
    (folder / "system.yaml").write_text(SYSTEM)
    (folder / "recorded.yaml").write_text(RECORDED)
    (folder / "player.yaml").write_text(
        "container: {components: [{component: takt::Player, parameters: {file: tried_recording.mcap}}]}\n")
    here = {name: str(folder / name) for name in ("recorded.yaml", "trace.json", "model.yaml")}
    (prefix / "share/takt/components").mkdir(parents=True)
    os.chdir(folder)
    run_well("run", here["recorded.yaml"], "--duration", "50ms", "--trace", here["trace.json"])
    run_well("model", here["trace.json"], "-o", here["model.yaml"])
    samples["recording"] = [(folder / f"{name}.mcap").read_bytes() for name in ("none", "lz4", "zstd")]
    run_well("compare", "system.yaml", *SHORT, "--executors", "file", "--repeat", "2", "--save", "saved")
    samples["comparison"] = [(folder / "saved.compared.json").read_bytes()]
    samples["trace"] = [(folder / "trace.json").read_bytes()]
    samples["model"] = [(folder / "model.yaml").read_bytes()]
    write_keys(samples)
    samples["workload"] = [WORKLOAD.encode()]
    samples["task set"] = []
    for method in methods:
        example = re.search(r"<<END\n(.*)\nEND\n", run_well("rta", method, "--help").stdout, re.S)
        samples["task set"].append(example[1].encode())
    for package in ("msg", "srv", "action"):
        (prefix / "share/fz" / package).mkdir(parents=True)
    return samples


def write_keys(samples):
    """Systems of which one key each is the file that is tried."""
    if not shutil.which("openssl"):
        del READERS["key"]
        return
    subprocess.run([pathlib.Path(__file__).parents[3] / "examples/11_security/keys.sh", folder, "robot"], check=True,
                   capture_output=True)
    samples["key"] = [(folder / file).read_bytes() for file in KEYS.values()]
    for tried_key in KEYS:
        files = ", ".join(f"{key}: {place('key').name if key == tried_key else file}" for key, file in KEYS.items())
        (folder / f"{tried_key}.yaml").write_text(
            f"dds: {{shared_memory: off, security: {{{files}}}}}\ncontainer: {{components: [{{component: takt::Workload}}]}}\n")


WORKLOAD = """{"nodes": [
 {"node_name": "a", "publishers": [{"topic_name": "x", "msg_type": "stamped10b", "period_ms": 1, "msg_pass_by": "shared_ptr"}]},
 {"node_name": "b", "subscribers": [{"topic_name": "x", "msg_type": "stamped10b"}],
  "servers": [{"service_name": "s", "srv_type": "stamped10b"}], "clients": [{"service_name": "s", "srv_type": "stamped10b", "period_ms": 2}]}]}
"""
READERS["task set"] = []
methods = re.findall(r"^  ([a-z_]+)  +[A-Z]", run_well("rta").stdout, re.M)


# ---- Both tests ----

def try_special_files(chance, most):
    """By so many commands of each kind."""
    (folder / "special").mkdir()
    before = len(failures)
    specials = special_files(folder / "special")
    for special in specials:
        for kind in READERS:
            path = place(kind)
            path.symlink_to(special)
            every = [words for words in commands(kind, path) if "echo" not in words]  # it says first that it waits
            for words in chance.sample(every, min(len(every), most)):
                # A missing file is not an entry of the index, and an empty definition is one without fields.
                is_refused = kind != "index" and (special.name, kind) != ("empty", "definition")
                tried(f"{special.name[:9]} as {kind}", words, names_of(kind, path), is_refused)
            if kind == "definition":
                tried(f"{special.name[:9]} as {kind}", translation([path]), names_of(kind, path), special.name != "empty")
            path.unlink()
    check(f"{len(specials)} special files in the place of {len(READERS)} kinds", len(failures) == before)


def try_changed_files(samples, round_seed):
    chance = random.Random(round_seed)
    kind = chance.choice(list(READERS))
    path = place(kind)
    if kind == "library":
        content = pathlib.Path(components).read_bytes()
        path.write_bytes(changed(chance, [content[:4096]]) + content[4096:chance.choice((4096, 10000, len(content)))])
    elif kind == "definition":
        return try_definitions(chance, round_seed)
    else:
        path.write_bytes(changed(chance, samples[kind]))
    every = list(commands(kind, path))
    for words in chance.sample(every, min(len(every), 4)):
        # There is no such node for parameters.
        tried(f"round {round_seed}, a changed {kind}", words, (*names_of(kind, path), "/nobody"), keep=[path])
    path.unlink()


def try_definitions(chance, round_seed):
    types = [f"T{i}" for i in range(chance.choice((1, 2, 5, 40)))]
    files = []
    for name in types:
        kind, parts = chance.choice((("msg", 1), ("msg", 1), ("msg", 1), ("srv", 2), ("action", 3))) if name != "T0" else ("msg", 1)
        files.append(prefix / "share/fz" / kind / f"{name}.{kind}")
        text = definition(chance, types, parts).encode()
        files[-1].write_bytes(text if chance.random() < 0.8 else changed(chance, [text + b"\n"]))
    tried(f"round {round_seed}, definitions", translation(files), ("fz/",), keep=files)
    for file in files:
        words = [takt, "interface", "show", f"fz/{file.suffix[1:]}/{file.stem}", *chance.choice(((), ("--json", "-")))]
        if file.suffix != ".msg" and chance.random() < 0.3:
            tried(f"round {round_seed}, definitions", words, ("fz/",), keep=files)
    for words in commands("definition", files[0]):
        if "show" in words or chance.random() < 0.2:  # the others join a domain
            tried(f"round {round_seed}, definitions", words, names_of("definition", files[0]), keep=files)
    for file in files:
        file.unlink()


samples = write_samples()
begin = time.monotonic()
is_long = budget.endswith("s")
try_special_files(random.Random(seed), 100 if is_long else 2)
print(f"special files: {time.monotonic() - begin:.1f} s")
begin, before, rounds = time.monotonic(), len(failures), 0
while (time.monotonic() - begin < float(budget[:-1])) if is_long else rounds < int(budget):
    try_changed_files(samples, seed + rounds)
    rounds += 1
check(f"seed {seed}: {rounds} rounds of changed files in {time.monotonic() - begin:.1f} s", len(failures) == before)
shutil.rmtree(folder)
finish()
