#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""takt bag: what is recorded between processes is in the file, as the MCAP specification has it, and is played.

usage: bag_test.py TAKT PEERS_LIBRARY
"""
import collections
import json
import pathlib
import re
import signal
import struct
import subprocess
import sys
import tempfile
import time
import zlib

from command import as_json, run, seen, takt
from checks import check, environment, finish

folder = pathlib.Path(tempfile.mkdtemp())
library = pathlib.Path(sys.argv[2]).resolve()
SYSTEM = f"""
dds: {{domain: {environment["ROS_DOMAIN_ID"]}, shared_memory: off}}
executors: {{one: {{type: events}}}}
container:
  name: robot
  components:
    - {{component: peers::Spider, library: {library}, name: spider, executor: one}}
    - {{component: takt::Workload, name: lidar, executor: one,
       parameters: {{publishers: {{topic: [scan], period_us: [10000], size_bytes: [320]}}}}}}
"""

RECORDER = f"""
dds: {{domain: {environment["ROS_DOMAIN_ID"]}, shared_memory: off}}
executors: {{disk: {{type: events}}}}
container:
  name: black_box
  components:
    - {{component: takt::Recorder, name: recorder, executor: disk,
       parameters: {{file: {folder}/container.mcap, topics: [/scan, /out]}}}}
"""


class System:
    def __enter__(self):
        (folder / "system.yaml").write_text(SYSTEM)
        self.process = subprocess.Popen([takt, "run", str(folder / "system.yaml")], env=environment,
                                        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        seen(lambda rows: {"/spider", "/lidar"} <= {row["node"] for row in rows}, "node", "list")
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGINT)
        self.process.wait(20)


def records(data, begin, end):
    while begin < end:
        size = struct.unpack_from("<Q", data, begin + 1)[0]
        yield begin, data[begin], data[begin + 9:begin + 9 + size]
        begin += 9 + size


def text(content, at):
    size = struct.unpack_from("<I", content, at)[0]
    return content[at + 4:at + 4 + size], at + 4 + size


def rules(data):
    """By the specification, without Takt's reader: checksums, indexes, statistics, definitions."""
    yield "the file begins and ends as MCAP does", (data[:8] == data[-8:] == b"\x89MCAP0\r\n")
    found = collections.defaultdict(list)
    for begin, opcode, content in records(data, 8, len(data) - 8):
        found[opcode].append((begin, content))
    data_end, end_record = found[0x0f][0]
    yield "checksum of the data", (struct.unpack("<I", end_record)[0] == zlib.crc32(data[:data_end]))
    summary, offsets, crc = struct.unpack("<QQI", found[0x02][0][1])
    yield "checksum of the summary", (crc == zlib.crc32(data[summary:-12]) and summary < offsets)
    counted = 0
    for begin, chunk in found[0x06]:
        size, crc = struct.unpack_from("<QI", chunk, 16)
        name, at = text(chunk, 28)
        content = chunk[at + 8:]
        yield ("an uncompressed chunk with its checksum",
               name == b"" and len(content) == size and crc == zlib.crc32(content))
        index = next(entry for _, entry in found[0x08]
                     if struct.unpack_from("<Q", entry, 16)[0] == begin)
        places, _ = text(index, 32)
        for at in range(0, len(places), 10):
            channel, place = struct.unpack_from("<HQ", places, at)
            entries = data[place + 9:place + 9 + struct.unpack_from("<Q", data, place + 1)[0]]
            for entry in range(6, len(entries), 16):
                time_ns, offset = struct.unpack_from("<QQ", entries, entry)
                is_right = (data[place] == 7 and content[offset] == 5 and
                            struct.unpack_from("<H", content, offset + 9)[0] == channel and
                            struct.unpack_from("<Q", content, offset + 15)[0] == time_ns)
                if not is_right:
                    yield "each entry of an index leads to its message", False
                counted += 1
    total = struct.unpack_from("<Q", found[0x0b][0][1])[0]
    yield f"all {total} messages are in the indexes", (counted == total > 0)
    for _, schema in found[0x03]:
        name, at = text(schema, 2)
        encoding, at = text(schema, at)
        if name == b"peer_msgs/msg/Leg":
            yield "the definition of a type of others", (encoding == b"ros2msg" and
                  b"wstring note\n" in schema and b"MSG: peer_msgs/Joint" in schema)
    yield "the publishers' QoS", (all(b"offered_qos_profiles" in channel for _, channel in found[0x04]))


PRIMITIVES = {"bool": "?", "byte": "B", "char": "B", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I",
              "int64": "q", "uint64": "Q", "float32": "f", "float64": "d"}


def definitions(schema):
    """Type → fields (type, array, name), as Foxglove reads `ros2msg`: https://mcap.dev/spec/registry#ros2msg"""
    parts, found = re.split(r"^={80}\n", schema, flags=re.MULTILINE), {}
    for i, part in enumerate(parts):
        lines = part.splitlines()
        name = re.fullmatch(r"MSG: (\w+/\w+)", lines.pop(0))[1] if i else ""
        found[name] = [re.fullmatch(r"([\w/]+?)(<=\d+)?(\[(?:<=)?\d*\])? (\w+)(?: .+)?", line).group(1, 3, 4)
                       for line in lines if line and not line.startswith("#") and "=" not in line.split(" ", 1)[1]]
    return found


class Cdr:
    """Reads a message by its schema, as Foxglove does."""

    def __init__(self, schema, data):
        self.types, self.data, self.at = definitions(schema), data[4:], 0
        self.order = {0: ">", 1: "<"}[data[1]]

    def number(self, kind):
        size = struct.calcsize(kind)
        self.at += -self.at % size
        value = struct.unpack_from(self.order + kind, self.data, self.at)[0]
        self.at += size
        return value

    def value(self, kind):
        if kind in PRIMITIVES:
            return self.number(PRIMITIVES[kind])
        if kind == "string":
            size = self.number("I")
            self.at += size
            return self.data[self.at - size:self.at - 1].decode()
        return {name: [self.value(of) for _ in range(int(array[1:-1]) if array[1:-1].isdigit() else self.number("I"))] if array
                else self.value(of) for of, array, name in self.types[kind]}


def test_diagnostics(file):
    data, schemas, topics, read = file.read_bytes(), {}, {}, []
    for _, opcode, content in records(data, 8, len(data) - 8):
        if opcode == 0x03:
            name, at = text(content, 2)
            encoding, at = text(content, at)
            schemas[struct.unpack_from("<H", content)[0]] = (name.decode(), encoding, text(content, at)[0].decode())
        elif opcode == 0x04:
            topic, at = text(content, 4)
            topics[struct.unpack_from("<H", content)[0]] = (topic.decode(), text(content, at)[0], struct.unpack_from("<H", content, 2)[0])
    for chunk in (content for _, opcode, content in records(data, 8, len(data) - 8) if opcode == 0x06):
        inner = chunk[text(chunk, 28)[1] + 8:]
        for _, code, message in records(inner, 0, len(inner)):
            channel = struct.unpack_from("<H", message)[0]
            if code == 0x05 and topics[channel][0] == "/diagnostics":
                cdr = Cdr(schemas[topics[channel][2]][2], message[22:])
                read.append(cdr.value(""))
                check("a message is as long as its schema says", 0 <= len(cdr.data) - cdr.at < 4, len(cdr.data), cdr.at)
    check("each channel is encoded as Foxglove wants", topics and all(encoding == b"cdr" and schemas[schema][1] == b"ros2msg"
          for _, encoding, schema in topics.values()), topics, {name: encoding for name, encoding, _ in schemas.values()})
    names = {status["name"]: {each["key"] for each in status["values"]} for message in read for status in message["status"]}
    check("diagnostics have named fields", "robot: container" in names and any("latency" in key for keys in names.values() for key in keys), names)


def check_format(file):
    data = file.read_bytes()
    for what, holds in rules(data):
        check(what, holds)
    # What others refuse is refused here.
    begins = {opcode: begin for begin, opcode, _ in records(data, 8, len(data) - 8)}
    for what, place in {"magic": len(data) - 3, "checksum": begins[0x0f] + 9, "byte in a chunk": begins[0x06] + 60,
                        "place of the summary": begins[0x02] + 9}.items():
        damaged = bytearray(data)
        damaged[place] ^= 1
        check(f"a file with another {what} is refused", not all(holds for _, holds in rules(bytes(damaged))))


def test_recordings():
    with System():
        for compression in ("none", "lz4", "zstd"):
            file = folder / f"{compression}.mcap"
            done = as_json("bag", "record", "/scan", "/out", "-o", str(file), "--compression",
                           compression, "--duration", "2.5s")
            check("what was recorded", done["topics"] == 2 and done["dropped"] == 0, done)
            info = as_json("bag", "info", str(file))
            check("what is in the file", info["messages"] == done["messages"] and info["is_complete"]
                  and info["compressions"] == ([] if compression == "none" else [compression]), info)
            counts = {row["topic"]: row["count"] for row in info["topics"]}
            # 100 and 50 a second, from their discovery on
            check("all messages of it", 50 < counts["/scan"] < 260 and
                  0.7 < counts["/scan"] / (2 * counts["/out"]) < 1.4, counts)
        check("compression helps", info["size_bytes"] < (folder / "none.mcap").stat().st_size / 4, info)
        everything = subprocess.Popen([takt, "bag", "record", "--all", "--compression", "none", "-o", str(folder / "all.mcap")],
                                      env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                      text=True)
        time.sleep(3.5)  # until there are diagnostics
        for _ in range(2):  # as `timeout -s INT` does: the second one cut the file off
            everything.send_signal(signal.SIGINT)
            time.sleep(0.002)
        out, error = everything.communicate(timeout=30)
        check("Ctrl-C ends it", everything.returncode == 0 and " messages of " in out, out, error)
        check("and the file is complete", as_json("bag", "info", str(folder / "all.mcap"))["is_complete"])
    test_diagnostics(folder / "all.mcap")
    check_format(folder / "none.mcap")
    text = run("bag", "info", str(folder / "zstd.mcap")).stdout
    check("as ros2 bag shows it", "Storage id:        mcap\n" in text and
          "Topic: /out | Type: peer_msgs/msg/Leg | Count: " in text, text)


# It had no definitions of types that it got from other processes.
def test_a_containers_recorder_asks_for_definitions():
    (folder / "recorder.yaml").write_text(RECORDER)
    with System():
        run("run", str(folder / "recorder.yaml"), "--duration", "2s")
    info = as_json("bag", "info", str(folder / "container.mcap"))
    check("both have definitions", [row["has_definition"] for row in info["topics"]] == [True, True], info)
    counts = {row["topic"]: row["count"] for row in info["topics"]}
    check("no message is lost meanwhile", 50 < counts["/scan"] < 260 and
          0.7 < counts["/scan"] / (2 * counts["/out"]) < 1.4, counts)
    check_format(folder / "container.mcap")


def test_playing():
    count = {row["topic"]: row["count"]
             for row in as_json("bag", "info", str(folder / "zstd.mcap"))["topics"]}["/out"]
    echo = subprocess.Popen([takt, "topic", "echo", "/out", "--type", "peer_msgs/msg/Leg", "--raw", "-n",
                             str(count)], env=environment, text=True, stdout=subprocess.PIPE,
                            stderr=subprocess.PIPE)
    echo.stderr.readline()  # it says that there is no publisher yet
    played = as_json("bag", "play", str(folder / "zstd.mcap"), "--topics", "/out", "--rate", "4", "-d", "2s")
    lines = echo.communicate(timeout=60)[0].splitlines()
    check("every message is played", played["messages"] == count == len(lines), played, count, len(lines))
    check("byte for byte", "00010000050000006c65667400" in lines[0], lines[0])
    loop = subprocess.Popen([takt, "bag", "play", str(folder / "lz4.mcap"), "-r", "100", "--loop", "--clock",
                             "--start-offset", "1s", "--json", "-"], env=environment, text=True,
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    time.sleep(2)
    loop.send_signal(signal.SIGINT)
    out, error = loop.communicate(timeout=30)
    once = as_json("bag", "info", str(folder / "lz4.mcap"))["messages"]
    check("a loop begins again", json.loads(out)["messages"] > once, out, error)


def test_what_is_wrong():
    (folder / "text").write_text("no recording")
    recording = str(folder / "zstd.mcap")
    for words, message in {("info", str(folder / "text")): "not an MCAP file",
                           ("info", "/nowhere"): "cannot be read",
                           ("play", recording, "--topics", "/ou"): "did you mean '/out'",
                           ("record",): "name topics, or record all with --all",
                           ("record", "-a", "-o", "/nowhere/x.mcap"): "cannot be written"}.items():
        wrong = run("bag", *words, status=2)
        check(message, message in wrong.stderr, wrong.stderr)
    cut = folder / "cut.mcap"
    cut.write_bytes((folder / "none.mcap").read_bytes()[:60_000])
    check("a file that was cut off", not as_json("bag", "info", str(cut))["is_complete"])


test_recordings()
test_a_containers_recorder_asks_for_definitions()
test_playing()
test_what_is_wrong()
finish()
