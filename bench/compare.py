#!/usr/bin/python3
"""Compares two results of one Google Benchmark program: compare.py OLD.json NEW.json

Both with repetitions. A row is slower, or faster, when the medians differ by more than 5 % and the
ranges of the repetitions do not overlap; otherwise the difference is within the spread.
SPDX-License-Identifier: Apache-2.0
"""
import json
import statistics
import sys


def times(path):
    """name → the times of its repetitions, and the unit."""
    try:
        with open(path, encoding="utf-8") as file:
            benchmarks = json.load(file)["benchmarks"]
    except (OSError, ValueError, KeyError) as error:
        sys.exit(f"{path}: no result of a Google Benchmark program: {error}")
    result = {}
    for row in benchmarks:
        if row.get("run_type") == "iteration" and not row.get("error_occurred"):
            key = "real_time" if "/real_time" in row["name"] else "cpu_time"
            result.setdefault(row["run_name"], []).append((row[key], row["time_unit"]))
    return result


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    old, new = times(sys.argv[1]), times(sys.argv[2])
    width = max((len(name) for name in new), default=0)
    print(f"{'':{width}}  {'old':>10} {'spread':>17}  {'new':>10} {'spread':>17}  {'change':>7}")
    for name, values in new.items():
        after = [value for value, _ in values]
        unit = values[0][1]

        def spread(numbers):
            return f"{min(numbers):.4g}–{max(numbers):.4g}"
        if name not in old:
            print(f"{name:{width}}  {'':>10} {'':>17}  {statistics.median(after):10.4g} "
                  f"{spread(after):>17}  {'':>7}  new, {unit}")
            continue
        before = [value for value, _ in old[name]]
        change = statistics.median(after) / statistics.median(before) - 1
        apart = max(after) < min(before) or min(after) > max(before)
        verdict = "within the spread"
        if apart and abs(change) > 0.05:
            verdict = "slower" if change > 0 else "faster"
        print(f"{name:{width}}  {statistics.median(before):10.4g} {spread(before):>17}  "
              f"{statistics.median(after):10.4g} {spread(after):>17}  {100 * change:+6.1f}%  "
              f"{verdict}, {unit}")


main()
