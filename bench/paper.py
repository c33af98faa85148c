"""The claims of "Impact of ROS 2 Node Composition in Robotic Systems", beside what is measured here.

paper_figures.json has the paper's figures: ROS 2 Humble on a Raspberry Pi 4B, means of 10 runs.
SPDX-License-Identifier: Apache-2.0
"""
import json
import pathlib

FIGURES = pathlib.Path(__file__).resolve().parent / "paper_figures.json"


def here(data, name, series, metric, x=None):
    """A median, or None."""
    for row in data.get(name, {}).get("rows", []):
        if row["series"] == series and "metrics" in row and (x is None or row["x"] == x) and metric in row["metrics"]:
            return row["metrics"][metric]["median"]
    return None


def there(table, x_key, x, series):
    return table[series][table[x_key].index(x)]


def claims_of(paper, data):
    """Each claim, the pair of figures of the paper, the pair of ours, their unit, and whether the first is to be
    less than the second, more, or the same."""
    memory, latency = paper["ram_pss_mb_vs_nodes"], paper["pub_sub_50hz"]
    goodput, containers, nav2 = paper["goodput_mb_s"], paper["containers_500kb_50hz_500us_work"], paper["nav2"]["arm"]

    def of_latency(key, first, second):
        return ((there({**latency[key], "x": latency["size_kb"]}, "x", first[1], first[0]),
                 there({**latency[key], "x": latency["size_kb"]}, "x", second[1], second[0])))

    def of_containers(key, first, second):
        return containers[key][first][-1], containers[key][second][-1]

    def both(name, metric, *places):
        return [here(data, name, series, metric, x) for series, x in places]

    def in_ms(values):
        return [value / 1000 if value is not None else None for value in values]
    yield ("20 nodes need less memory in one process than in one each",
           (there(memory, "nodes", 20, "dynamic"), there(memory, "nodes", 20, "multi_process")),
           both("memory", "pss_mb", ("dynamic", 20), ("multi_process", 20)), "MB", "less")
    pair = ("dynamic", 1000), ("multi_process", 1000)
    yield ("1 MB arrives earlier within a process than in another", of_latency("latency_ms", *pair),
           in_ms(both("latency", "latency_us", *pair)), "ms", "less")
    yield "1 MB at 50 Hz takes less CPU time within a process", of_latency("cpu_pct", *pair), both(
        "latency", "cpu_percent", *pair), "%", "less"
    pair = ("ipc", 1), ("ipc", 5000)
    yield ("by pointer, 5 MB arrive as early as 1 KB", of_latency("latency_ms", *pair), in_ms(both("latency", "latency_us", *pair)),
           "ms", "same")
    pair = ("multi_process_loaned", 1), ("multi_process_loaned", 1000)
    yield ("loaned to another process, 1 MB arrives as early as 1 KB", of_latency("latency_ms", *pair),
           in_ms(both("latency", "latency_us", *pair)), "ms", "same")
    yield ("by pointer, more of 5 MB arrives than in another process",
           (there(goodput, "size_kb", 5000, "ipc"), there(goodput, "size_kb", 5000, "multi_process")),
           both("goodput", "goodput_mb_s", ("ipc", 5000), ("multi_process", 5000)), "MB/s", "more")
    pair = ("isolated", 10), ("single_threaded", 10)
    yield ("10 subscribers with work: `isolated` delivers earlier than `single_threaded`",
           of_containers("latency_ms", "isolated", "single_threaded"), in_ms(both("executors", "latency_us", *pair)), "ms", "less")
    yield ("… and takes more CPU time", of_containers("cpu_pct", "isolated", "single_threaded"),
           both("executors", "cpu_percent", *pair), "%", "more")
    pair = ("dynamic, isolated", None), ("multi_process", None)
    for what, key, metric, unit in (("memory", "pss_mb", "pss_mb", "MB"), ("CPU time", "cpu_pct", "cpu_percent", "%")):
        yield (f"Nav2 needs less {what} in one process than in one for each node",
               (nav2["dynamic_isolated"][key][0], nav2["multi_process"][key][0]), both("nav2", metric, *pair), unit, "less")
    pair = ("dynamic, isolated", None), ("dynamic, multi_threaded", None)
    yield ("Nav2 takes less CPU time under `isolated` than under `multi_threaded`",
           (nav2["dynamic_isolated"]["cpu_pct"][0], nav2["dynamic_multi_threaded"]["cpu_pct"][0]),
           both("nav2", "cpu_percent", *pair), "%", "less")


def verdict(first, second, relation):
    if first is None or second is None or second == 0:
        return "not measured"
    ratio = first / second if relation != "more" else second / first
    if relation == "same":
        return "yes" if 0.8 <= ratio <= 1.25 else "no"
    return "yes" if ratio < 0.9 else "hardly" if ratio <= 1 else "no"


def pair_of(first, second, unit):
    if first is None or second is None:
        return "-"
    return f"{first:.3g} against {second:.3g} {unit}" if max(first, second) < 1000 else f"{first:.0f} against {second:.0f} {unit}"


def claims(data):
    """Rows: what the paper says, what it saw, what is seen here, whether it holds here."""
    paper = json.loads(FIGURES.read_text(encoding="utf-8"))
    return [[claim, pair_of(*saw, unit), pair_of(*ours, unit), verdict(*ours, relation)]
            for claim, saw, ours, unit, relation in claims_of(paper, data)]
