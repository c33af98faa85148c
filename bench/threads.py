"""Workers, hand-over between threads, nodes, and messages between processes: a part of results.py.

SPDX-License-Identifier: Apache-2.0
"""
import json
import os
import re
import statistics
import subprocess

import wire

WIRE_ROUNDS = 3
REPETITIONS = 9


def google_benchmark(binaries, program, *options):
    """The rows of a Google Benchmark program, repetitions apart."""
    done = subprocess.run([binaries / program, "--benchmark_format=json", *options], stdout=subprocess.PIPE,
                          stderr=subprocess.DEVNULL, check=True)
    return [row for row in json.loads(done.stdout)["benchmarks"] if row["run_type"] == "iteration"]


def words_of(row):
    """events/chain/work_us:10/workers:2/iterations:20 → [events, chain, 10, 2]"""
    parts = [part for part in row["run_name"].split("/") if not part.startswith(("iterations:", "real_time", "manual_time"))]
    return [part.rpartition(":")[2] for part in parts]


def spread(values):
    return {"median": round(statistics.median(values), 2), "min": round(min(values), 2), "max": round(max(values), 2)}


def measure_scaling(binaries):
    workers = "[24]" if len(os.sched_getaffinity(0)) >= 4 else "2"
    rows = google_benchmark(binaries, "scaling_benchmark", f"--benchmark_filter=workers:{workers}/")
    result = []
    for row in rows:
        executor, shape, work, count = words_of(row)
        ratios = {name: {"median": round(row[name], 3), "min": round(row[name + "_low"], 3), "max": round(row[name + "_high"], 3)}
                  for name in ("gain", "gain_apart", "of_apart", "cpu")}
        ratios["line_ns"] = {"median": row["line_ns"], "min": row["line_p25_ns"], "max": row["line_p75_ns"]}
        result.append({"name": executor, "shape": shape, "work_us": int(work), "workers": int(count),
                       "alone_ns": round(row["alone_ns"], 1), "least_share": round(row["least_share"], 3), "metrics": ratios})
    return result


def measure_hand_over(binaries):
    result = []
    for row in google_benchmark(binaries, "hand_over_benchmark"):
        _, executor, rate = words_of(row)
        names = [key.removesuffix("_p25_ns") for key in row if key.endswith("_p25_ns")]
        result.append({"name": executor, "hz": int(rate), "metrics": {
            name: {"median": row[f"{name}_ns"], "min": row[f"{name}_p25_ns"], "max": row[f"{name}_p75_ns"]} for name in names}})
    return result


def measure_transfer(binaries):
    values = {}
    for row in google_benchmark(binaries, "transfer_benchmark", f"--benchmark_repetitions={REPETITIONS}"):
        executor = words_of(row)[1]
        for stream in (key.removesuffix("_of_bare") for key in row if key.endswith("_of_bare")):
            values.setdefault(f"{executor}/{stream}", []).append(row[f"{stream}_ns"])
    return [{"name": name, "metrics": {"ns": spread(numbers)}} for name, numbers in values.items()]


def measure_nodes(binaries):
    figures = ("create_ms", "spin_ms", "end_ms", "node_kB", "statistics_kB", "objects_kB", "ratio")
    values = {}
    for row in google_benchmark(binaries, "nodes_benchmark", f"--benchmark_repetitions={REPETITIONS}",
                                "--benchmark_enable_random_interleaving=true"):
        _, kind, count = words_of(row)
        of_row = values.setdefault((kind, int(count)), {figure: [] for figure in figures})
        for figure in figures:
            of_row[figure].append(row[figure])
    return [{"name": kind, "nodes": count, "metrics": {figure: spread(of_row[figure]) for figure in figures}}
            for (kind, count), of_row in values.items()]


def measure_round_trips(_):
    return wire.measure("round trip", WIRE_ROUNDS)


def measure_streams(_):
    return wire.measure("stream", WIRE_ROUNDS)


PIECES = {"scaling": measure_scaling, "hand_over": measure_hand_over, "transfer": measure_transfer, "nodes": measure_nodes,
          "round_trips": measure_round_trips, "streams": measure_streams}


def measure(binaries, pieces):
    """Of each piece its rows, and the load average before and after."""
    result = {}
    for name in pieces:
        before = os.getloadavg()[0]
        rows = PIECES[name](binaries)
        result[name] = {"load_before": before, "load_after": os.getloadavg()[0], "rows": rows}
    return result


# ---- The page ----

def number(value):
    return f"{value:.2f}" if value < 100 else f"{value:,.0f}"


def shown(value):
    return f"{number(value['median'])} ({number(value['min'])} – {number(value['max'])})"


def cells(row, *figures):
    return [shown(row["metrics"][figure]) for figure in figures]


def scaling_section(rows, table):
    return (
        "## More workers\n\nEight callbacks, statistics `count`: they trigger themselves (`independent`; `reentrant`: in such groups; "
        "`one_group`: in one exclusive group), or each the next (`chain`). *Gain* is callbacks in the same time, against one worker. "
        "*Separate* are as many executors with one worker each on the same CPUs. Medians of 20 rounds of 50 ms that alternate, and 95 % "
        "intervals of the ratios.\n\n" +
        table(["executor", "callbacks", "work (µs)", "workers", "gain", "gain of separate executors", "CPU time a callback, against one worker",
               "least share of a worker"],
              [[f"`{row['name']}`", row["shape"], row["work_us"], row["workers"], *cells(row, "gain", "gain_apart", "cpu"),
                f"{row['least_share']:.2f}"] for row in rows], keys=4))


def hand_over_section(rows, table):
    names = [name for name in ("cache_line", "futex", "always", "spin_50us", "asleep") if name in rows[0]["metrics"]]
    return (
        "## From a thread to a callback on another CPU\n\nFrom `publish` to the callback in ns; statistics `count`. `futex` and "
        "`cache_line` are bare; the others wait asleep, with `spin: 50us` and with `spin: always`. Medians of 30 rounds of 300 "
        "messages that alternate, and their quartiles.\n\n" +
        table(["executor", "messages/s", *(f"`{name}`" for name in names)],
              [[f"`{row['name']}`", f"{row['hz']:,}", *cells(row, *names)] for row in rows]))


def transfer_section(rows, table):
    bare = next(row for row in rows if "bare" in row["name"])["metrics"]["ns"]["median"]
    return (
        "## As many messages as a thread can send to another\n\nWith back-pressure, so nothing is lost; statistics `count`. "
        f"`bare` in a name is a pool and a ring alone. Medians and ranges of {REPETITIONS} repetitions.\n\n" +
        table(["row", "ns a message", "against the bare one"],
              [[f"`{row['name']}`", *cells(row, "ns"), f"{row['metrics']['ns']['median'] / bare:.2f}"] for row in rows]))


def nodes_section(rows, table):
    kinds = {"bare": "without DDS", "parameter_services": "parameter services, without DDS",
             "ros2": "parameter services, graph and rosout, on DDS"}
    columns = {"create_ms": "create (ms)", "spin_ms": "start (ms)", "end_ms": "end (ms)", "node_kB": "memory a node (kB)",
               "statistics_kB": "of it statistics (kB)", "objects_kB": "of it its objects (kB)"}
    # Measured before 0070, statistics are among the objects.
    columns = {figure: title for figure, title in columns.items() if figure in rows[0]["metrics"]}
    return (
        "## Many nodes\n\nEach with a publisher, a subscription, a timer and a parameter, under `events`. *Start* is from `spin` to "
        f"spinning. Medians and ranges of {REPETITIONS} runs, each in a process of its own. A process has at most 8,100 ends on DDS, "
        "and a node with all of ROS 2's services 14 of them.\n\n" +
        table(["nodes", "with", *columns.values()],
              [[f"{row['nodes']:,}", kinds[row["name"]], *cells(row, *columns)]
               for row in sorted(rows, key=lambda row: (list(kinds).index(row["name"]), row["nodes"]))], keys=2))


def round_trips_section(rows, table):
    return (
        "## There and back between processes, beside ddsperf\n\nOver UDP on the loopback interface, each process on a CPU of its "
        "own, SCHED_OTHER. Takt's round trip has the hop from Cyclone's receiving thread to the executor's, in both processes. CPU "
        f"time and voluntary context switches are of both. Medians and ranges of {WIRE_ROUNDS} rounds, which alternate. "
        "[What Cyclone's settings bring](../explanation/decisions/0032_settings_of_cyclone_are_measured.md).\n\n" +
        wire.table_of("round trip", rows, table))


def streams_section(rows, table):
    return (
        "## As many messages as a process can send to another\n\nLikewise. ddsperf gathers small messages in datagrams, and Cyclone "
        "slows it down; Takt sends each at once, and this program waits when 500 are on their way.\n\n" +
        wire.table_of("stream", rows, table))


SECTIONS = {"scaling": scaling_section, "hand_over": hand_over_section, "transfer": transfer_section, "nodes": nodes_section,
            "round_trips": round_trips_section, "streams": streams_section}


def what_follows(pieces):
    """Three sentences for a user, where the data has their figures."""
    def figure(piece, metric, **wanted):
        rows = [row for row in pieces.get(piece, {}).get("rows", []) if all(row.get(key) == value for key, value in wanted.items())]
        return rows[0]["metrics"].get(metric, {}).get("median") if rows else None
    sentences = []
    gains = [figure("scaling", "gain", name="events", shape=shape, work_us=work, workers=2)
             for shape, work in (("independent", 10), ("independent", 0), ("chain", 10))]
    if None not in gains:
        sentences.append(f"A second worker helps callbacks that are independent and work: {gains[0]:.2f} times as many with 10 µs of "
                         f"work, {gains[1]:.2f} with none, and of a chain with 10 µs {gains[2]:.2f}.")
    wakes = [figure("hand_over", metric, name="events", hz=10_000) for metric in ("asleep", "futex", "always")]
    if None not in wakes:
        sentences.append(f"A thread that sleeps gets a message after {wakes[0] / 1000:.0f} µs, nearly all of which is the kernel's "
                         f"({wakes[1] / 1000:.0f} µs); one that spins gets it after {wakes[2] / 1000:.1f} µs, and takes a CPU for that.")
    memory = [figure("nodes", "node_kB", name=name) for name in ("bare", "ros2")]
    if None not in memory:
        sentences.append(f"A node takes {memory[0]:.0f} kB, and {memory[1]:.0f} kB with all that ROS 2 asks of it.")
    return " ".join(sentences) or "Only some parts are measured."


def section(document, table):
    parts = []
    for name, of_piece in SECTIONS.items():
        if name in document["pieces"]:
            piece = document["pieces"][name]
            heading, rest = re.split(r"\n\n", of_piece(piece["rows"], table), maxsplit=1)
            parts += [heading, f"Load average {piece['load_before']:.1f} before, {piece['load_after']:.1f} after. {rest}"]
    return "\n\n".join(parts)


# ---- Figures ----

def experiment(name, title, x_label, labels, rows):
    return {"name": name, "title": title, "x_label": x_label, "metrics": list(labels), "labels": labels, "rows": rows,
            "statistics": "count", "deviations": []}


def experiments(pieces):
    """For report.py."""
    result = []
    if "scaling" in pieces:
        rows = [{"series": f"{row['name']}, {row['shape']}, {row['workers']} workers", "x": row["work_us"], "metrics": row["metrics"]}
                for row in pieces["scaling"]["rows"]]
        result.append({**experiment("scaling", "Workers against one", "work (µs)",
                                    {"gain": "callbacks in the same time, against one worker"}, rows),
                       "repeat": 20, "duration": "50ms"})
    if "round_trips" in pieces:
        rows = [{"series": row["name"], "x": row["bytes"],
                 "metrics": {name: spread(values) for name, values in row["metrics"].items()}}
                for row in pieces["round_trips"]["rows"]]
        result.append({**experiment("round trip", "Between processes, over UDP", "message size (B)",
                                    {"p50_us": "round trip, p50 (µs)", "p99_us": "round trip, p99 (µs)", "cpu_us": "CPU time (µs)"}, rows),
                       "repeat": WIRE_ROUNDS, "duration": "2s"})
    return result
