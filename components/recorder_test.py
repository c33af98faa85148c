#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Records a system at full rate, plays the recording, and compares; and what recording costs.

usage: recorder_test.py TAKT SECONDS

The system publishes what iRobot's mont_blanc does (irobot-ros/ros2-performance), five times as
often: 1,500 messages a second, 60 MB/s. The files are read here by a reader of our own.
"""
import json
import os
import pathlib
import re
import shutil
import statistics
import struct
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "cmake"))
from checks import check, environment, finish, rounds, skip

takt, seconds = os.path.abspath(sys.argv[1]), float(sys.argv[2])
FASTER = 5
# topic, bytes, period in ms
TOPICS = [("amazon", 36, 10), ("ganges", 16, 10), ("nile", 16, 10), ("danube", 8, 10),
          ("tigris", 16, 10), ("parana", 12, 10), ("columbia", 256000, 200), ("colorado", 16, 200),
          ("salween", 48, 100), ("godavari", 5000, 200), ("loire", 1000, 200), ("yamuna", 16, 100),
          ("chenab", 1024, 25), ("missouri", 10000, 100), ("tagus", 250000, 25),
          ("brazos", 25000, 100), ("mekong", 100, 500), ("congo", 16, 100), ("lena", 50, 100),
          ("ohio", 100, 200), ("volga", 8, 500), ("murray", 100, 500), ("arkansas", 16, 100)]
if os.cpu_count() < 2:
    skip("one CPU: the recorder would be in the way of what it records")
folder = pathlib.Path(tempfile.mkdtemp())


def system(*extra, talks=True):
    components = []
    for topic, size, period in TOPICS if talks else []:
        components.append(
            f"{{component: takt::Workload, name: n_{topic}, executor: work, parameters: {{"
            f"publishers: {{topic: [{topic}], size_bytes: [{size}], "
            f"period_us: [{period * 1000 // FASTER}]}}}}}}")
        components.append(
            f"{{component: takt::Workload, name: s_{topic}, executor: work, parameters: {{"
            f"subscriptions: {{topic: [{topic}]}}}}}}")
    components += extra  # last: so the recorder finds all topics before the first message
    return ("threads:\n  work: {policy: SCHED_FIFO, priority: 50, affinity: [0]}\n"
            "  disk: {nice: 5, affinity: [1]}\n"
            "executors:\n  work: {type: events, threads: [work]}\n"
            "  disk: {type: events, threads: [disk]}\n"
            "container:\n  name: system\n  components:\n" +
            "".join(f"    - {component}\n" for component in components))


def recorder(file):
    return (f"{{component: takt::Recorder, name: recorder, executor: disk, parameters: "
            f"{{file: {file}, buffers: 16, buffer_bytes: 2097152, depth: 1000, "
            f"discover_ms: 500}}}}")


def run(text, duration, status=0):
    file = folder / "system.yaml"
    file.write_text(text)
    done = subprocess.run([takt, "run", str(file), "--duration", f"{duration}s", "--json",
                           str(folder / "out.json")], env=environment, text=True,
                          capture_output=True, timeout=duration + 60)
    check(f"takt run for {duration:.1f} s ends with {status}", done.returncode == status,
          done.returncode, done.stderr)
    return json.loads((folder / "out.json").read_text())["runs"][0], done.stderr


def messages(file):
    """Topic → its messages' bytes, in order."""
    data = file.read_bytes()
    magic = b"\x89MCAP0\r\n"
    check(f"{file.name} begins and ends as an MCAP file",
          data.startswith(magic) and data.endswith(magic))
    channels, result = {}, {}

    def records(begin, end):
        while begin + 9 <= end:
            opcode, size = data[begin], struct.unpack_from("<Q", data, begin + 1)[0]
            begin += 9
            if opcode == 4:  # channel: id, schema, topic
                number, _, length = struct.unpack_from("<HHI", data, begin)
                channels[number] = data[begin + 8:begin + 8 + length].decode()
            elif opcode == 5:
                number = struct.unpack_from("<H", data, begin)[0]
                result.setdefault(channels[number], []).append(data[begin + 22:begin + size])
            elif opcode == 6:  # chunk
                compression = struct.unpack_from("<I", data, begin + 28)[0]
                records(begin + 32 + compression + 8, begin + size)
            begin += size

    records(len(magic), len(data))
    return result


def p99(result):
    return [row["latency_us"]["p99"] for row in result["callbacks"] if row["node"] != "/recorder"]


# What it costs: rounds with and without, alternated; of all callbacks and rounds together.
with_recorder, without = [], []
for _ in range(rounds(8)):
    without += p99(run(system(), 1)[0])
    with_recorder += p99(run(system(recorder(folder / "cost.mcap")), 1)[0])
recording, bare = statistics.median(with_recorder), statistics.median(without)
check(f"p99 of callbacks with the recorder: {recording:.0f} us, without: {bare:.0f} us, "
      f"{recording / bare:.2f} times", recording <= 1.5 * bare)

# Recorded, played, recorded again: equal.
result, output = run(system(recorder(folder / "first.mcap")), seconds)
sent = {f"/{topic}": row["received"] for topic, _, _ in TOPICS for row in result["callbacks"]
        if row["node"] == f"/n_{topic}" and row["kind"] == "timer"}
first = messages(folder / "first.mcap")
counts = {topic: len(list_) for topic, list_ in first.items()}
check(f"{sum(counts.values())} messages are recorded, all that were sent", counts == sent,
      {topic: (counts.get(topic), sent[topic]) for topic in sent if counts.get(topic) != sent[topic]},
      output)
player = (f"{{component: takt::Player, name: player, executor: work, parameters: "
          f"{{file: {folder / 'first.mcap'}, rate: 2.0, start_delay_ms: 1000}}}}")
_, output = run(system(recorder(folder / "second.mcap"), player, talks=False), seconds / 2 + 2)
second = messages(folder / "second.mcap")
check("played and recorded again, they are equal, byte for byte", first == second,
      {topic: (len(first[topic]), len(second.get(topic, []))) for topic in first}, output)

# A disk that fills up.
disk = folder / "disk"
disk.mkdir()
if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=20m", "tmpfs", str(disk)],
                  capture_output=True).returncode == 0:
    try:
        result, output = run(system(recorder(disk / "full.mcap")), 3, status=1)
        check("the run says why it has not gone well",
              "messages were not recorded: No space left on device" in output, output)
        check("a full disk is reported once", output.count("recording stopped") == 1, output)
        dropped = re.search(r"(\d+) messages? of \d+ topics?, (\d+) dropped", output)
        kept = sum(len(list_) for list_ in messages(disk / "full.mcap").values())
        check("the log says what is in the file, and what is not",
              dropped and int(dropped[1]) == kept and int(dropped[2]) > 0, output)
        check("nothing else is lost", all(row["lost"] in (0, None) and row["dropped"] in (0, None)
                                          for row in result["callbacks"]
                                          if row["kind"] == "subscription"))
    finally:
        subprocess.run(["umount", str(disk)])
else:
    print("skipped: a full disk (mount is not permitted)")
shutil.rmtree(folder)
finish()
