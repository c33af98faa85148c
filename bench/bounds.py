"""Latencies beside their bounds: systems × executors, a part of results.py.

Each system runs for a minute under SCHED_FIFO, and `takt analyze` bounds its chains with the model of that run.
SPDX-License-Identifier: Apache-2.0
"""
import json
import os
import pathlib
import re
import subprocess
import tempfile
import time

DURATION = "60s"
SYSTEMS = {"reference_system": "bench/workloads/reference_system.yaml", "nav2": "examples/08_nav2/nav2.yaml",
           "mont_blanc": "bench/workloads/mont_blanc.yaml"}
# The name of the variant → all of its executor; None: the executors that Takt plans from the chains (PiCAS).
VARIANTS = {"chain_aware": "type: chain_aware", "events, fixed_priority": "type: events, scheduler: fixed_priority",
            "single_threaded": "type: single_threaded", "planned": None}
# Of each random system; the same seeds each time.
SIMULATIONS = 300
# Method and threads → the median that it should have.
GOALS = {"all several": 0.35, "snapshots one": 0.45}
THREAD = "{policy: SCHED_FIFO, priority: 80, affinity: [1]}"


def variant_of(text, executor):
    """The file with the chains that it has, or all, and with this executor for everything."""
    parts = re.split(r"^(?=\w)", text, flags=re.MULTILINE)  # a part for each key of the file
    if executor is not None:
        parts = [part for part in parts if not part.startswith(("threads:", "executors:"))]
        parts = [re.sub(r"^( *)- component: .*$", r"\g<0>\n\1  executor: default", part, flags=re.MULTILINE)
                 for part in parts]
        parts.insert(1, f"threads:\n  main_cpu: {THREAD}\nexecutors:\n  default: {{{executor}, threads: [main_cpu]}}\n")
    if not any(part.startswith("chains:") for part in parts):
        parts.insert(1, "chains: auto\n")
    return "".join(parts)


def measure_one(takt, file):
    """The analysis of the file, with the model of a run of it, and how long it took; and the result of the run."""
    model, result = file.with_suffix(".model.yaml"), file.with_suffix(".json")
    trace = file.with_suffix(".trace.json")
    subprocess.run([takt, "run", file, "--duration", DURATION, "--trace", trace, "--json", result],
                   stdout=subprocess.DEVNULL, check=True)
    # Observed and bound are of one run: it needs no margin.
    subprocess.run([takt, "model", trace, "-o", model, "--margin", "0"], stdout=subprocess.DEVNULL, check=True)
    begin = time.monotonic()
    # It may exit with 1: the host has stopped this machine for longer than the bound. The row shows it.
    done = subprocess.run([takt, "analyze", file, "--model", model, "--allow-unbounded", "--json", "-"],
                          stdout=subprocess.PIPE, check=False)
    if done.returncode > 1:
        done.check_returncode()
    analysis = json.loads(done.stdout)
    del analysis["callbacks"], analysis["suggestions"]
    for chain in analysis["chains"]:
        for segment in chain["segments"]:
            del segment["methods"]
    analysis["analysed_in_s"] = round(time.monotonic() - begin, 2)
    return analysis, json.loads(result.read_text(encoding="utf-8"))


def measure_tightness(analysis_test):
    """Of random systems, the longest response simulated ÷ the least bound: method and threads → number, median."""
    done = subprocess.run([analysis_test, "--gtest_filter=RandomSystems.TightnessOfBounds"], stdout=subprocess.PIPE, text=True,
                          env=os.environ | {"TAKT_TIGHTNESS_RUNS": str(SIMULATIONS - 3)}, check=True)
    rows = re.findall(r"^tightness: (\w+) (one|several) (\d+) (\S+)$", done.stdout, flags=re.MULTILINE)
    return {f"{method} {threads}": [int(count), float(median)] for method, threads, count, median in rows}


def measure(takt, root):
    """All analyses, as `takt analyze --json` has them: a document for report.py."""
    analyses = []
    with tempfile.TemporaryDirectory() as folder:
        for system, path in SYSTEMS.items():
            text = (root / path).read_text(encoding="utf-8")
            for variant, executor in VARIANTS.items():
                file = pathlib.Path(folder) / f"{system}.yaml"
                file.write_text(variant_of(text, executor), encoding="utf-8")
                analysis, run = measure_one(takt, file)
                analyses.append({**analysis, "file": path, "model": None, "variant": variant})
    return {"takt": run["takt"], "machine": run["machine"], "analyses": analyses,
            "tightness": measure_tightness(takt.parent / "analysis_test")}


def ms(us):
    return "-" if us is None else f"{us / 1e3:.3f}"


def observed(chain):
    """p99.9 in µs; of fewer than 1,000 instances that would be the maximum, so p99."""
    latency = chain["observed_us"]
    return latency["p999" if latency["instances"] >= 1000 else "p99"]


def shares_of(analyses):
    """Observed latency ÷ bound of each chain that has one, the least first."""
    return sorted(observed(chain) / chain["bound_us"] for analysis in analyses for chain in analysis["chains"]
                  if chain["bound_us"] is not None)


def row_of(analysis):
    chains, shares = analysis["chains"], shares_of([analysis])
    return [f"`{pathlib.Path(analysis['file']).stem}`", analysis["variant"], f"{len(chains)}, {len(shares)}",
            f"{shares[len(shares) // 2]:.2f} ({shares[-1]:.2f})" if shares else "-", ms(max(map(observed, chains))),
            ms(max((chain["bound_us"] for chain in chains if chain["bound_us"]), default=None))]


def what_follows(document):
    """Three sentences for a user."""
    analyses = document["analyses"]
    shares, slowest = shares_of(analyses), max(analysis["analysed_in_s"] for analysis in analyses)
    above = sum(share > 1 for share in shares)
    first = f"{above} observed latencies were above their bounds" if above else "No observed latency was above its bound"
    return (f"{first}: {len(shares)} bounds, of {len({analysis['file'] for analysis in analyses})} systems under "
            f"{len({analysis['variant'] for analysis in analyses})} executors each. Half of the bounds are at most "
            f"{1 / shares[len(shares) // 2]:.1f} times what was observed, so a deadline that `takt analyze` cannot guarantee may be met "
            f"all the same. An analysis took {slowest:.2f} s at most, so that it can run with each change of a system.")


def hot_path_rows(analyses):
    return [[chain["name"], analysis["variant"], ms(chain["observed_us"]["p999"]),
             ms(chain["observed_us"]["max"]), ms(chain["bound_us"]),
             ms(sum(segment["wait_us"] or 0 for segment in chain["segments"]))]
            for analysis in analyses if "reference_system" in analysis["file"] for chain in analysis["chains"]]


def without_bound(analyses):
    reasons = sorted({(pathlib.Path(analysis["file"]).stem, analysis["variant"], chain["name"], chain["reason"])
                      for analysis in analyses for chain in analysis["chains"] if chain["bound_us"] is None})
    return "\n".join(f"- `{system}`, {variant}, {chain}: {reason}" for system, variant, chain, reason in reasons)


def tightness_rows(document):
    before = document.get("tightness_before", {})
    rows = []
    for name, (count, median) in sorted(document["tightness"].items(), key=lambda row: -row[1][0]):
        method, threads = name.split()
        was = before.get(name)
        rows.append([f"`{method}`" if method != "all" else method, threads, count, f"{was[1]:.2f}" if was else "-", f"{median:.2f}",
                     f"{GOALS[name]:.2f}" if name in GOALS else "-"])
    return rows


def section(document, table):
    analyses = document["analyses"]
    parts = [
        f"Each system ran for {DURATION} as one process; one thread of SCHED_FIFO 80 on CPU 1 runs all callbacks, but for "
        "`planned`: there Takt makes executors, threads and CPUs from the chains (PiCAS). `takt analyze` then bounds "
        "each chain with the execution times, arrivals and overheads of that run (`--model`, without a margin: both are of one run). "
        "Observed is p99.9, and p99 where a chain has fewer than 1,000 instances; a maximum shows what the host did, too.",
        table(["system", "executor", "chains, with a bound", "observed ÷ bound: median (most)", "largest observed (ms)",
               "largest bound (ms)"], map(row_of, analyses)),
        "The hot paths of the Autoware reference system. Most of a bound is the wait at the fusion for the other lidar, "
        "whose period is 100 ms; in the run both lidars have the same phase.",
        table(["chain", "executor", "p99.9 (ms)", "max (ms)", "bound (ms)", "of it, waiting at joins"],
              hot_path_rows(analyses))]
    if "tightness" in document:
        parts += [
            "## Random systems\n\n"
            f"The longest response ÷ the least bound, of the callbacks of 3,000 random systems (seeds 1 to 3000 of "
            f"`testing/random_system.hpp`), simulated {SIMULATIONS} times each by `testing/oracle.hpp`, which knows nothing of the "
            "analysis: of the callbacks that a method bounds best, the median. A simulation seldom meets the worst case, so a bound is tighter than its figure. No response was above its bound. "
            "Before: at commit bb582156, where the method `pools` stood for `workload`.",
            table(["method", "threads", "callbacks", "median before", "median", "goal"],
                  tightness_rows(document))]
    missing = without_bound(analyses)
    return "\n\n".join(parts + ([f"Without a bound:\n\n{missing}"] if missing else []))
