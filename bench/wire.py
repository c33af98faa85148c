#!/usr/bin/python3
"""Takt beside ddsperf, between two processes over UDP, on the loopback interface: a part of results.py.

Each pair of processes runs for some seconds; all alternate. From outside, the CPU time and the voluntary
context switches of both processes are read from /proc, for Takt and for ddsperf in the same way.
usage: wire.py [ROUNDS]   prints the tables
SPDX-License-Identifier: Apache-2.0
"""
import json
import os
import pathlib
import re
import shutil
import statistics
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]
PAIR = ROOT / "build/release/bin/wire_pair"
DOMAIN = "97"
ROUND_TRIP_BYTES = [16, 1_000, 16_000, 256_000, 1_000_000, 8_000_000]
STREAM_BYTES = [16, 100, 1_000]
LOOPBACK = ('<CycloneDDS><Domain id="any"><General><Interfaces><NetworkInterface name="lo" multicast="false"/>'
            "</Interfaces><AllowMulticast>false</AllowMulticast>{}</General><Discovery><ParticipantIndex>auto"
            '</ParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers></Discovery>{}</Domain></CycloneDDS>')
# As in transport/dds/domain_configuration.cpp.
AS_TAKT = LOOPBACK.format("<MaxMessageSize>65500B</MaxMessageSize><FragmentSize>65000B</FragmentSize>",
                          '<Internal><SocketReceiveBufferSize min="default" max="10MB"/><Watermarks><WhcHigh>16MB'
                          "</WhcHigh></Watermarks></Internal>")
BY_DEFAULT = LOOPBACK.format("", "")
# The row → Cyclone's settings, and the words of both processes; None: of wire_pair.
ROUND_TRIPS = {"ddsperf, on the receiving thread": (BY_DEFAULT, "listener"),
               "ddsperf, on a thread that waits": (BY_DEFAULT, "waitset"),
               "the same, Cyclone set as by Takt": (AS_TAKT, "waitset"),
               "Takt, in a callback": (None, None)}
STREAMS = {"ddsperf, which batches": (BY_DEFAULT, "listener"), "Takt": (None, None)}


def used(process):
    """CPU time in s, and voluntary context switches, of all its threads."""
    cpu = switches = 0
    for task in pathlib.Path(f"/proc/{process.pid}/task").iterdir():
        cpu += int((task / "schedstat").read_text().split()[0]) / 1e9
        switches += int(re.search(r"^voluntary_ctxt_switches:\s*(\d+)", (task / "status").read_text(), re.MULTILINE)[1])
    return cpu, switches


def ddsperf_figures(text):
    """Of the last second that it prints. It halves round trips."""
    ping = re.findall(r"50% ([\d.]+)us .* 99% ([\d.]+)us .* cnt (\d+)", text)
    if ping:
        return {"p50_us": 2 * float(ping[-1][0]), "p99_us": 2 * float(ping[-1][1]), "per_s": float(ping[-1][2])}
    data = re.findall(r"total \d+ lost (\d+) .* rate ([\d.]+) kS/s", text)
    return {"per_s": 1e3 * float(data[-1][1]), "lost": int(data[-1][0])}


def measure_pair(settings, answers, asks):
    """What the second process prints, and what both used for one message, or one round trip."""
    environment = {**os.environ, "ROS_DOMAIN_ID": DOMAIN, "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    for name in ("CYCLONEDDS_URI", "ROS_STATIC_PEERS", "ROS_LOCALHOST_ONLY"):
        environment.pop(name, None)
    if settings is not None:
        environment["CYCLONEDDS_URI"] = settings
    cpus = sorted(os.sched_getaffinity(0))
    first = subprocess.Popen(["taskset", "-c", str(cpus[-1]), *answers], stdout=subprocess.DEVNULL, env=environment)
    try:
        time.sleep(0.1)
        second = subprocess.Popen(["taskset", "-c", str(cpus[0]), *asks], stdout=subprocess.PIPE, text=True, env=environment)
        time.sleep(1.3)  # both know each other, and ddsperf has begun
        begin, before = time.monotonic(), [used(first), used(second)]
        time.sleep(0.6)
        elapsed, after = time.monotonic() - begin, [used(first), used(second)]
        text = second.communicate(timeout=30)[0]
    finally:
        first.kill()
        first.wait()
    figures = json.loads(text) if settings is None else ddsperf_figures(text)
    cpu, switches = (sum(now[i] - then[i] for now, then in zip(after, before)) for i in (0, 1))
    return {**figures, "cpu_us": 1e6 * cpu / elapsed / figures["per_s"], "switches": switches / elapsed / figures["per_s"]}


def round_trip(who, size):
    settings, mode = ROUND_TRIPS[who]
    if settings is None:
        return measure_pair(None, [PAIR, "pong", str(size)], [PAIR, "ping", str(size), "seconds=2"])
    ddsperf = ["ddsperf", "-i", DOMAIN]
    return measure_pair(settings, [*ddsperf, "pong", mode], [*ddsperf, "-D", "2.1", "ping", "size", str(size), mode])


def stream(who, size):
    settings, mode = STREAMS[who]
    if settings is None:
        return measure_pair(None, [PAIR, "pub", str(size)], [PAIR, "sub", str(size), "seconds=2"])
    ddsperf = ["ddsperf", "-i", DOMAIN]
    return measure_pair(settings, [*ddsperf, "pub", "size", str(size)], [*ddsperf, "-D", "2.1", "-1", "sub", mode])


# Kind → one measurement, its variants, and its sizes.
KINDS = {"round trip": (round_trip, ROUND_TRIPS, ROUND_TRIP_BYTES), "stream": (stream, STREAMS, STREAM_BYTES)}


def measure(kind, rounds):
    """Rows: who, size, and of each figure the values of the rounds."""
    if shutil.which("ddsperf") is None:
        sys.exit("ddsperf is not installed: apt-get install cyclonedds-tools")
    one, variants, sizes = KINDS[kind]
    rows = []
    for size in sizes:
        of_size = [{"name": name, "bytes": size, "metrics": {}} for name in variants]
        for _ in range(rounds):
            for row in of_size:
                for figure, value in one(row["name"], size).items():
                    row["metrics"].setdefault(figure, []).append(round(value, 3))
        rows += of_size
    return rows


def shown(values):
    def number(value):
        return f"{value:.1f}" if value < 100 else f"{value:,.0f}"

    return f"{number(statistics.median(values))} ({number(min(values))} – {number(max(values))})"


COLUMNS = {"round trip": {"p50_us": "p50 (µs)", "p99_us": "p99 (µs)", "cpu_us": "CPU time (µs)",
                          "switches": "context switches"},
           "stream": {"per_s": "messages/s", "lost": "lost", "cpu_us": "CPU time of a message (µs)",
                      "switches": "context switches"}}


def table_of(kind, rows, table):
    columns = COLUMNS[kind]
    return table(["bytes", kind, *columns.values()],
                 [[f"{row['bytes']:,}", row["name"], *(shown(row["metrics"][figure]) for figure in columns)] for row in rows])


def main():
    def table(header, rows):
        return "\n".join(" | ".join(line) for line in [header, *rows])

    for kind in KINDS:
        print(table_of(kind, measure(kind, int(sys.argv[1]) if sys.argv[1:] else 3), table), end="\n\n")


if __name__ == "__main__":
    main()
