"""What papers on executors claim, tried here: a part of results.py.

Each experiment of `takt bench literature` runs under the real kernel and simulated.
SPDX-License-Identifier: Apache-2.0
"""
import json
import os
import subprocess

# For whom: what the experiment's name is the answer to.
ADVICE = {"picas": "One chain matters more than the others, and real-time threads may be used",
          "picas_mt": "The same, but all callbacks share one pool",
          "redagrt": "Chains of different rates share one pool, and nobody has given priorities",
          "events_priority": "Periodic work, of which no release may be skipped, has one thread",
          "edf_dag": "Chains with deadlines of different lengths have one thread",
          "preemptive": "An urgent chain and long callbacks share one CPU",
          "mt_fair": "Callbacks of one group are always ready in a pool",
          "cie": "Each group is to have its own priority, and the cost matters",
          "let_servers": "A chain is to take the same time in each instance, however long",
          "paam": "Chains share a device that serves one request after the other",
          "anytime": "A planner takes longer than the periods beside it"}


def measure(takt, root):
    """All experiments, as `takt bench --json` has them."""
    done = subprocess.run([takt, "bench", "literature", "--duration", "1s", "--json", "-"], stdout=subprocess.PIPE, text=True, check=True,
                          env=os.environ | {"TAKT_COMPONENT_PATH": str(root / "build/release")})
    document = json.loads(done.stdout)
    for experiment in document["experiments"]:
        for row in experiment["rows"]:
            row.pop("latency_buckets_us", None)
    return {key: document[key] for key in ("takt", "machine", "experiments")}


def interval(claim):
    if "ratio" in claim:
        return f"{claim['ratio']:.2f} ({claim['low']:.2f} to {claim['high']:.2f})"
    return "always 0" if claim["verdict"] == "holds" and not claim["more"] else "-"


def claim_rows(document):
    """A row for each claim at each x: here and simulated."""
    rows = {}
    for experiment in document["experiments"]:
        for claim in experiment["claims"]:
            at = f", {claim['x']:g} {experiment['x_label']}" if "x" in claim else ""
            key = (experiment["name"], claim["text"], at)
            rows.setdefault(key, {})[claim["simulated"]] = (experiment, claim)
    for (name, text, at), sides in rows.items():
        experiment, claim = next(iter(sides.values()))
        of = f"{experiment['labels'][claim['metric']]}: `{claim['less']}`" + (f" ÷ `{claim['more']}`" if claim["more"] else "")
        cells = [f"{interval(sides[is_simulated][1])}, {sides[is_simulated][1]['verdict']}" if is_simulated in sides else "-"
                 for is_simulated in (False, True)]
        yield [f"`{name}`", text, of + at, *cells]


def what_follows(document):
    """A line for each need: what helps, by how much."""
    lines = []
    for experiment in document["experiments"]:
        claims = [claim for claim in experiment["claims"] if not claim["simulated"]]
        verdicts = {claim["verdict"] for claim in claims}
        verdict = verdicts.pop() if len(verdicts) == 1 else "holds in part"
        shown = {claim["metric"]: claim for claim in claims if "ratio" in claim}
        ratios = "; ".join(f"{experiment['labels'][metric]} under `{claim['less']}` is {interval(claim)} times that under `{claim['more']}`"
                           for metric, claim in shown.items())
        lines.append(f"- {ADVICE[experiment['name']]}: `takt bench {experiment['name']}` {verdict}{'; ' + ratios if ratios else ''}.")
    return "\n".join(lines)


def section(document, table):
    one = document["experiments"][0]
    parts = [
        "Each experiment repeats what a paper claims, with Takt's executor beside Takt's version of what the paper compared it with. The figure is "
        f"the ratio of both with its 95 % interval, of {one['repeat']} runs of {one['duration'].replace('s', ' s')} each that took turns. `holds`: it lies below 1; `refuted`: above; `open`: neither. "
        "Simulated, the phases of all timers are drawn, 20 scenarios for each run; here all timers start together. "
        "[The catalogue](../reference/catalogue.md) has the executors.",
        table(["experiment", "the paper says", "figure", "here", "simulated"], claim_rows(document))]
    for experiment in document["experiments"]:
        deviations = "".join(f" {deviation}" for deviation in experiment["deviations"])
        parts.append(f"**`{experiment['name']}`**, {experiment['title']}.{deviations}")
    return "\n\n".join(parts)
