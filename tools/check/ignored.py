#!/usr/bin/python3
"""Does a test see it when the model passes over a key of the file? Of each key that containers/model/coverage.cpp calls
used or not covered: ignored.py containers_test [NAME...], such as "a topic: lifespan". --fixed: twenty of them.

What is no key of the file has a mutation of its own, "ignored: QoS: lifespan" (mutations.py); ./dev check compares.

SPDX-License-Identifier: Apache-2.0
"""
import os
import re
import subprocess
import sys

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../..")
TABLE = "containers/model/coverage.cpp"
TESTS = "Assumptions.*:Guarantee.*:SystemModel.*:Traps.*:CodeTraps.*:Keys.*:CpuTraps.AChain*"
# What only an iRobot workload has: its keys become parameters of takt::Workload, whose tests see them.
WORKLOAD = {"a node", "a publisher", "a subscriber", "a client", "a server"}
# Neither a key of the file nor a figure of a model, which the tests can pass over.
OTHERS = {"QoS", "publisher options", "trigger options", "thread attributes", "callback parameters", "an executor type",
          "a scheduler type", "a kind of entity", "a reserved thread", "change"}
# Not tried: that needs keys of openssl. What is not covered is looked up in one way, see AnExecutorOfALibraryIsNotCovered.
UNTRIED = {"dds: security", "a wait back end: library", "the file: wait_backends"}
# Compared by the command, or when it is read, before there is a model.
OF_COMMAND = {"a measured model: total_duration", "a measured model: file", "a measured model: machine", "a measured model: executors",
              "a measured model: components", "a measured model: settings"}
FIXED = ["the file: accept", "the file: realtime", "memory: lock", "a thread: policy", "a thread: priority", "dds: discovery",
         "a topic: reliability", "a topic: lifespan", "a topic: delay", "an executor: let", "an executor: early_wake",
         "a callback: execution", "a callback: waits", "a callback: overrun", "a component: remap", "the lifecycle: bring_up",
         "a machine: speed", "a machine: rt_runtime", "overheads: dispatch", "a chain: from"]


def entries(text):
    """Of the table: (of, fact, how it counts, why)."""
    found = re.findall(r'\{"([^"]+)", "([^"]+)", (kUsed|kIrrelevant|kNotCovered),\s*((?:"(?:[^"\\]|\\.)*"\s*)+)(?:,\s*kFree\s*)?\}', text)
    return [(of, fact, how, "".join(re.findall(r'"((?:[^"\\]|\\.)*)"', why))) for of, fact, how, why in found]


def keys(text):
    return [f"{of}: {fact}" for of, fact, how, _ in entries(text)
            if how != "kIrrelevant" and of not in OTHERS | WORKLOAD | {"security"} and f"{of}: {fact}" not in UNTRIED and f"{of}: {fact}" not in OF_COMMAND]


def without_mutation(text, names):
    """What is no key, counts, and has no mutation by its name. "see …": another entry has it."""
    return [f"{of}: {fact}" for of, fact, how, why in entries(text)
            if (of in OTHERS or f"{of}: {fact}" in OF_COMMAND) and how != "kIrrelevant" and not why.startswith("see ")
            and f"ignored: {of}: {fact}" not in names]


def is_seen(program, name):
    words = [program, f"--gtest_filter={TESTS}", "--gtest_brief=1", "--gtest_fail_fast"]
    return subprocess.run(words, env=dict(os.environ, TAKT_IGNORED=name), stdout=subprocess.DEVNULL,
                          stderr=subprocess.DEVNULL, timeout=300).returncode != 0


def main():
    program, *names = sys.argv[1:]
    with open(os.path.join(ROOT, TABLE), encoding="utf-8") as file:
        all_keys = keys(file.read())
    if names == ["--fixed"]:
        names = FIXED
    unknown = [name for name in names if name not in all_keys]
    if unknown:
        sys.exit(f"no key {unknown} counts; there are: {', '.join(all_keys)}")
    if is_seen(program, ""):
        sys.exit("the tests fail, though nothing is ignored")
    missed = []
    for name in names or all_keys:
        if not is_seen(program, name):
            print(f"MISSED {name}: no test sees that it is ignored", flush=True)
            missed.append(name)
    print(f"{len(names or all_keys) - len(missed)} of {len(names or all_keys)} are seen")
    sys.exit(1 if missed else 0)


if __name__ == "__main__":
    main()
