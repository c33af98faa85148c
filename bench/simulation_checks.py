"""What must hold of simulations, tried with more systems than `./dev test` has: a part of simulation.py.

SPDX-License-Identifier: Apache-2.0
"""
import datetime
import os
import re
import resource
import subprocess
import sys

SEARCH = "{bin}/simulate_test --gtest_filter=ScenarioSearch."
# Name → what must hold, systems (0: the program knows), program, what its output says.
CHECKS = {
    "bounds": ("observed ≤ simulated in 99 % of chains; neither above the bound", 10000, SEARCH + "Observed*",
               r"^seeds .*?: (of .*)$"),
    "traces": ("the executors, and threads on CPUs, do what the oracle says", 2000, "{bin}/analysis_test --gtest_filter=Oracle.*",
               r"(\d+) executions are the same"),
    "cpus": ("2,000 sets of threads end when the words say in steps; 300 reservations have their supply in each window", 0,
             "{bin}/base_test --gtest_filter=CpuModel.DoesInEvents*:CpuModel.AReservationHasItsSupply*", None),
    "search": ("a search finds 0.95 of the worst of 60 drawn scenarios, in 99 % of chains", 500, SEARCH + "FindsWhatOthersFind",
               r"^(?:seeds .*?: )?(.*chain.*)$"),
    "witnesses": ("a witness misses each time, on one CPU of the host and on all", 100, SEARCH + "AWitnessMissesEachTime",
                  r"^(.*witnesses.*)$"),
    "exact": ("a search reaches 90 % of bounds that are exact, in 80 % of systems", 500, SEARCH + "ComesCloseToExactBounds",
              r"^(of \d+ systems.*)$"),
    "same": ("the same bytes 20 times: taskset, nice, beside a hog; one CPU for a file with eight", 0,
             "{root}/tools/takt/tests/random_test.py {bin}/takt", None),
    "mutants": ("each mutant of the engine is found in 3 minutes of CPU", 0, "{root}/tools/check/mutants.py --oracle", r"^(\S+ .*\d+\.\d s of CPU.*)$"),
}


def used_s():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def found(output, pattern):
    """What the output says: its lines, or how many executions; of mutants how many, and how long the slowest took."""
    lines = re.findall(pattern, output, re.M) if pattern else []
    if lines and all(line.isdigit() for line in lines):
        return f"{sum(map(int, lines)):,} executions are the same"
    seconds = [float(value) for line in lines for value in re.findall(r"\((\d+\.\d) s of CPU\)", line)]
    if not seconds:
        return "; ".join(re.sub(" +", " ", line).strip() for line in lines) or "no difference"
    missed = [line.split(":")[0] for line in lines if line.startswith("MISSED")]
    return (f"{len(lines) - len(missed)} of {len(lines)}, the slowest in {max(seconds):.0f} s" +
            "".join(f"; {line}" for line in missed))


def measure(names, root, commit):
    """Name → row, for those that hold; says of the others what they print."""
    rows = {}
    if not set(names) <= set(CHECKS):
        sys.exit(f"what is checked of simulations is: {', '.join(CHECKS)}")
    for name in names:
        _, systems, command, pattern = CHECKS[name]
        words = command.format(bin=root / "build/release/bin", root=root).split()
        environment = {**os.environ, **({"TAKT_RANDOM_SYSTEMS": str(systems)} if systems else {})}
        before, load = used_s(), os.getloadavg()[0]
        done = subprocess.run(words, stdout=subprocess.PIPE, text=True, env=environment, check=False)
        if done.returncode != 0:
            sys.exit(f"{done.stdout}\n{name}: {words[0]} has ended with {done.returncode}")
        rows[name] = {"name": name, "systems": systems, "found": found(done.stdout, pattern), "cpu_s": used_s() - before,
                      "load": load, "date": str(datetime.date.today()), "commit": commit}
    return rows


def section(rows, table):
    shown = [[CHECKS[name][0], f"{row['systems']:,}" if row["systems"] else "as it says", row["found"], f"{row['cpu_s']:.0f} s",
              f"{row['date']}, {row['commit'][:9]}, load {row['load']:.1f}"] for name, row in rows.items()]
    return ("## What holds\n\nTried with more systems than `./dev test` has, each by `./dev results simulation NAME`: "
            f"{', '.join(f'`{name}`' for name in rows)}, in this order.\n\n" +
            table(["what", "tried", "found", "CPU", "when"], shown))
