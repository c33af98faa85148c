#!/usr/bin/python3
"""Do the tests see what mutations.py lists? Builds a copy of the tree in which an environment variable switches each
mutant on, and fails if a test passes with one that it must see: mutants.py [NAME... | --oracle]

SPDX-License-Identifier: Apache-2.0
"""
import collections
import filecmp
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import time

from mutations import CPU_LIMITS_S, MUTATIONS, ORACLE, plain

ROOT = os.path.abspath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../.."))
COPY = os.path.join(ROOT, "build/mutants")
BIN = os.path.join(COPY, "build/release/bin")
NUMBERS = {name: number for number, name in enumerate(MUTATIONS, 1)}
SWITCH = """#ifndef TAKT_MUTANT
#define TAKT_MUTANT
#include <cstdlib>
namespace takt {
inline bool mutant(int number) {
  static const char* const chosen = std::getenv("TAKT_MUTANT");
  return chosen != nullptr && std::atoi(chosen) == number;
}
}  // namespace takt
#endif
"""


def run(words, **options):
    return subprocess.run(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **options)


def tests_of(name):
    tests = MUTATIONS[name][3]
    return tests if isinstance(tests, list) else [tests]


def has_switch(name):
    return plain(MUTATIONS[name][1]) != MUTATIONS[name][1]


def switched(text, there, mutants):
    """The text with these mutants, as (number, instead), at the mark."""
    before, mark, right, after = re.fullmatch("(.*)([«‹])(.*)[»›](.*)", there, re.DOTALL).groups()
    for number, instead in mutants:
        choice = f"::takt::mutant({number})"
        if mark == "‹":
            right = f"{{ if ({choice}) {{\n{instead}\n}} else {{\n{right}\n}} }}"
        elif instead == "false":  # of whatever is true or not, such as an optional
            right = f"(!{choice} && ({right}))"
        else:
            right = f"({choice} ? ({instead}) : ({right}))"
    if text.count(plain(there)) != 1:
        sys.exit(f"'{plain(there)}' overlaps another mutation; give both one place")
    return text.replace(plain(there), before + right + after)


def with_switches():
    """The files that have switches, with all of them."""
    places = collections.defaultdict(list)
    for name, (path, there, instead, _) in MUTATIONS.items():
        if has_switch(name):
            places[path, there].append((NUMBERS[name], instead))
    files = {}
    for (path, there), mutants in places.items():
        if path not in files:
            with open(os.path.join(ROOT, path), encoding="utf-8") as file:
                files[path] = SWITCH + file.read()
        files[path] = switched(files[path], there, mutants)
    return files


def write(path, text):
    path = os.path.join(COPY, path)
    if os.path.exists(path):
        with open(path, encoding="utf-8") as file:
            if file.read() == text:
                return
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)


def copy_tree():
    """What git knows, as it is now, with switches; what has not changed stays, so that the next time builds little."""
    switches = with_switches()
    for path, text in switches.items():
        write(path, text)
    for name in run(["git", "ls-files"], cwd=ROOT).stdout.split("\n"):
        source, copy = os.path.join(ROOT, name), os.path.join(COPY, name)
        if name in switches or not os.path.isfile(source):
            continue
        if not os.path.exists(copy) or not filecmp.cmp(source, copy, shallow=False):
            os.makedirs(os.path.dirname(copy), exist_ok=True)
            shutil.copy(source, copy)  # with a new time, or what was built of a mutant that was not undone would stay


def build(targets):
    environment = dict(os.environ, CCACHE_BASEDIR=COPY, CCACHE_NOHASHDIR="1",
                       CMAKE_CXX_COMPILER_LAUNCHER="ccache")
    if not os.path.exists(os.path.join(COPY, "build/release/build.ninja")):
        run(["cmake", "--preset", "release"], cwd=COPY, env=environment)
    words = ["cmake", "--build", "--preset", "release", "--target", *targets]
    if subprocess.run(words, cwd=COPY, env=environment, stdout=sys.stderr).returncode != 0:
        sys.exit(f"{' '.join(targets)} do not build")


def passes(test, number=0, limit_s=300):
    words = [word.format(bin=BIN, root=COPY) for word in test[1:]]
    environment = dict(os.environ, TAKT_MUTANT=str(number))
    if test in CPU_LIMITS_S:
        return passes_in_cpu_time(words, CPU_LIMITS_S[test], environment)
    try:
        return run(words, timeout=limit_s, env=environment).returncode == 0
    except subprocess.TimeoutExpired:  # a mutant may hang
        return False


def passes_in_cpu_time(words, cpu_s, environment):
    """However long it waits for a CPU."""
    process = subprocess.Popen(["prlimit", f"--cpu={cpu_s}", *words], stdout=subprocess.DEVNULL,
                               stderr=subprocess.DEVNULL, env=environment)
    used = -1
    while True:
        try:
            return process.wait(60) in (0, -signal.SIGXCPU)  # in its time it has seen nothing
        except subprocess.TimeoutExpired:
            before, used = used, cpu_ticks(process.pid)
        if used == before:  # it hangs
            process.kill()
            process.wait()
            return False


def cpu_ticks(pid):
    with open(f"/proc/{pid}/stat", encoding="utf-8") as file:
        return sum(map(int, file.read().rsplit(")", 1)[1].split()[11:13]))


def used_cpu_s():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def missing(name, limits_s):
    """The tests that do not see it."""
    tests = tests_of(name)
    if has_switch(name):
        return [test for test in tests if passes(test, NUMBERS[name], limits_s[test])]
    path, right, wrong, _ = MUTATIONS[name]
    with open(os.path.join(COPY, path), encoding="utf-8") as file:
        text = file.read()
    try:
        write(path, text.replace(right, wrong))
        build({test[0] for test in tests})
        return [test for test in tests if passes(test)]
    finally:
        write(path, text)


def main():
    names = sys.argv[1:] or list(MUTATIONS)
    if names == ["--oracle"]:
        names = [name for name in MUTATIONS if ORACLE in tests_of(name)]
    unknown = [name for name in names if name not in MUTATIONS]
    if unknown:
        sys.exit(f"no mutation {unknown}; there are: {', '.join(MUTATIONS)}")
    copy_tree()
    tests = {test for name in names for test in tests_of(name)}
    build({test[0] for test in tests})
    limits_s = {}
    for test in sorted(tests):
        begin = time.monotonic()
        if not passes(test):
            sys.exit(f"{' '.join(test[1:])} fails without a mutation")
        limits_s[test] = 30 + 5 * (time.monotonic() - begin)
    missed = []
    for name in sorted(names, key=has_switch):  # what needs a build of its own first: the last one builds it all again
        used_s = used_cpu_s()
        blind = missing(name, limits_s)
        print(f"{'MISSED' if blind else 'seen  '} {name}: {' '.join((blind or tests_of(name))[0][1:])}"
              f" ({used_cpu_s() - used_s:.1f} s of CPU)", flush=True)
        if blind:
            missed.append(name)
    sys.exit(1 if missed else 0)


if __name__ == "__main__":
    main()
