#!/usr/bin/python3
"""Compares two results of one Google Benchmark program: compare.py OLD.json NEW.json

Both with repetitions. Where a benchmark reports counters, these are its result, and its time means nothing:
then the counters are compared, else the time. A row is more, or less, when the medians differ by more than 5 %
and the ranges of the repetitions do not overlap; otherwise the difference is within the spread.
SPDX-License-Identifier: Apache-2.0
"""
import json
import statistics
import sys

# What Google Benchmark writes of every run; all other numbers are counters.
OWN = {"family_index", "per_family_instance_index", "repetitions", "repetition_index", "threads", "iterations",
       "real_time", "cpu_time"}


def results_of(row):
    """What the row is about: name of the quantity → value."""
    counters = {key: value for key, value in row.items()
                if key not in OWN and isinstance(value, (int, float)) and not isinstance(value, bool)}
    if counters:
        return counters
    key = "real_time" if "/real_time" in row["name"] else "cpu_time"
    return {f"{key}, {row['time_unit']}": row[key]}


def read(path):
    """Benchmark and quantity → the values of the repetitions."""
    try:
        with open(path, encoding="utf-8") as file:
            benchmarks = json.load(file)["benchmarks"]
    except (OSError, ValueError, KeyError) as error:
        sys.exit(f"{path}: no result of a Google Benchmark program: {error}")
    result = {}
    for row in benchmarks:
        if row.get("run_type") == "iteration" and not row.get("error_occurred"):
            for quantity, value in results_of(row).items():
                result.setdefault((row["run_name"], quantity), []).append(value)
    return result


def spread(numbers):
    return f"{min(numbers):.4g}–{max(numbers):.4g}"


def verdict_of(before, after):
    """The change in percent, and what it means."""
    middle = statistics.median(before)
    if middle == 0:
        return "", "was 0"
    change = statistics.median(after) / middle - 1
    apart = max(after) < min(before) or min(after) > max(before)
    verdict = "within the spread"
    if apart and abs(change) > 0.05:
        verdict = "more" if change > 0 else "less"
    return f"{100 * change:+6.1f}%", verdict


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    old, new = read(sys.argv[1]), read(sys.argv[2])
    width = max((len(name) for name, _ in {**old, **new}), default=0)
    quantities = max((len(quantity) for _, quantity in {**old, **new}), default=0)
    print(f"{'':{width}}  {'compared':{quantities}}  {'old':>10} {'spread':>17}  {'new':>10} {'spread':>17}  "
          f"{'change':>7}")
    for name, quantity in [*new, *(key for key in old if key not in new)]:
        before, after = old.get((name, quantity)), new.get((name, quantity))
        change, verdict = verdict_of(before, after) if before and after else ("", "new" if after else "gone")
        row = [f"{statistics.median(values):10.4g} {spread(values):>17}" if values else f"{'':>28}"
               for values in (before, after)]
        print(f"{name:{width}}  {quantity:{quantities}}  {'  '.join(row)}  {change:>7}  {verdict}")


main()
