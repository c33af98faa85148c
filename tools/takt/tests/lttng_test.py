#!/usr/bin/env python3
"""What LTTng records of Takt: ROS 2's tracepoints and CARET's, by their names and fields, as many as a run counts, and
when Takt's own trace says.

usage: lttng_test.py TAKT ROBOT.yaml
"""
# SPDX-License-Identifier: Apache-2.0
import collections
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

from command import takt
from checks import check, environment, finish

# Of ros2_tracing (tracetools 8.4): names, and what each field is.
EVENTS = {
    "rcl_init": "context_handle:address version:text",
    "rcl_node_init": "node_handle:address rmw_handle:address node_name:text namespace:text",
    "rmw_publisher_init": "rmw_publisher_handle:address gid:bytes",
    "rcl_publisher_init": "publisher_handle:address node_handle:address rmw_publisher_handle:address topic_name:text queue_depth:uint64",
    "rclcpp_publish": "message:address",
    "rclcpp_intra_publish": "publisher_handle:address message:address",
    "rcl_publish": "publisher_handle:address message:address",
    "rmw_publish": "rmw_publisher_handle:address message:address timestamp:int64",
    "rmw_subscription_init": "rmw_subscription_handle:address gid:bytes",
    "rcl_subscription_init": "subscription_handle:address node_handle:address rmw_subscription_handle:address topic_name:text queue_depth:uint64",
    "rclcpp_subscription_init": "subscription_handle:address subscription:address",
    "rclcpp_subscription_callback_added": "subscription:address callback:address",
    "rmw_take": "rmw_subscription_handle:address message:address source_timestamp:int64 taken:int32",
    "rcl_take": "message:address",
    "rclcpp_take": "message:address",
    "rcl_service_init": "service_handle:address node_handle:address rmw_service_handle:address service_name:text",
    "rclcpp_service_callback_added": "service_handle:address callback:address",
    "rcl_client_init": "client_handle:address node_handle:address rmw_client_handle:address service_name:text",
    "rcl_timer_init": "timer_handle:address period:int64",
    "rclcpp_timer_callback_added": "timer_handle:address callback:address",
    "rclcpp_timer_link_node": "timer_handle:address node_handle:address",
    "rclcpp_callback_register": "callback:address symbol:text",
    "callback_start": "callback:address is_intra_process:int32",
    "callback_end": "callback:address",
    "rcl_lifecycle_state_machine_init": "node_handle:address state_machine:address",
    "rcl_lifecycle_transition": "state_machine:address start_label:text goal_label:text",
    "rclcpp_construct_ring_buffer": "buffer:address capacity:uint64",
    "rclcpp_buffer_to_ipb": "buffer:address ipb:address",
    "rclcpp_ipb_to_subscription": "ipb:address subscription:address",
    "rclcpp_ring_buffer_enqueue": "buffer:address index:uint64 size:uint64 overwritten:int32",
    "rclcpp_ring_buffer_dequeue": "buffer:address index:uint64 size:uint64",
    "rclcpp_executor_get_next_ready": "",
    "rclcpp_executor_wait_for_work": "timeout:int64",
    "rclcpp_executor_execute": "handle:address",
    # Of caret_trace 0.7.3.
    "ros2_caret:caret_init": "clock_offset:int64 distribution:text",
    "ros2_caret:rmw_implementation": "rmw_impl:text init_timestamp:int64",
    "ros2_caret:construct_executor": "executor_addr:address executor_type_name:text init_timestamp:int64",
    "ros2_caret:add_callback_group": "executor_addr:address callback_group_addr:address group_type_name:text init_timestamp:int64",
    "ros2_caret:callback_group_add_timer": "callback_group_addr:address timer_handle:address init_timestamp:int64",
    "ros2_caret:callback_group_add_subscription": "callback_group_addr:address subscription_handle:address init_timestamp:int64",
    "ros2_caret:callback_group_add_service": "callback_group_addr:address service_handle:address init_timestamp:int64",
    "ros2_caret:callback_group_add_client": "callback_group_addr:address client_handle:address init_timestamp:int64",
    "ros2_caret:dds_write": "message:address",
    "ros2_caret:dds_bind_addr_to_stamp": "addr:address source_stamp:uint64",
}
KINDS = [(r"integer \{ size = 64; .*signed = 0; .*base = 16; \}", "address"), (r"integer \{ size = 32; .*signed = 1;.*\}", "int32"),
         (r"integer \{ size = 64; .*signed = 1;.*\}", "int64"), (r"integer \{ size = 64; .*signed = 0;.*base = 10; \}", "uint64"),
         (r"string", "text"), (r"integer \{ size = 8; .*\}", "bytes")]
for program in ("lttng", "lttng-sessiond", "babeltrace2"):
    if shutil.which(program) is None:
        print(f"skipped: {program} is missing (Debian: lttng-tools, babeltrace2)")
        sys.exit(77)
if not (pathlib.Path(takt).resolve().parents[1] / "lib/takt/libtakt_lttng.so").exists():
    print("skipped: built without liblttng-ust-dev")
    sys.exit(77)

folder = pathlib.Path(tempfile.mkdtemp())
# A busy machine needs longer than the three seconds that a program waits for the daemon.
traced = environment | {"TAKT_LTTNG": "1", "LTTNG_HOME": str(folder), "LTTNG_UST_REGISTER_TIMEOUT": "60000"}


def lttng(*words):
    return subprocess.run(["lttng", "--no-sessiond", *words], env=traced, text=True, capture_output=True, timeout=60)


class Daemon:
    """LTTng's daemon; one that is there is used."""

    def __enter__(self):
        self.process = None
        if lttng("list").returncode != 0:
            self.process = subprocess.Popen(["lttng-sessiond", "--no-kernel", "--quiet"], env=traced)
            end = time.monotonic() + 20
            while lttng("list").returncode != 0 and time.monotonic() < end:
                time.sleep(0.1)
        return self

    def __exit__(self, *_):
        if self.process is not None:
            self.process.terminate()
            self.process.wait(30)


class Session:
    """Records into a folder of its own while it lives."""

    def __init__(self, name):
        self.name, self.path = f"takt_{os.getpid()}_{name}", folder / name

    def __enter__(self):
        for words in (["create", self.name, f"--output={self.path}"], ["enable-event", "-s", self.name, "-u", "ros2*"],
                      ["add-context", "-s", self.name, "-u", "-t", "vpid", "-t", "vtid"], ["start", self.name]):
            done = lttng(*words)
            check(f"lttng {words[0]}", done.returncode == 0, done.stderr)
        return self

    def __exit__(self, *_):
        lttng("destroy", self.name)

    def events(self):
        """(ns of CLOCK_MONOTONIC, name, fields and context)."""
        text = subprocess.run(["babeltrace2", "--clock-cycles", self.path], text=True, capture_output=True, timeout=120).stdout
        for line in text.splitlines():
            found = re.match(r"\[(\d+)\] \(.*?\) \S+ (?:ros2:)?([\w:]+): (.*)$", line)
            fields = dict(re.findall(r'(\w+) = ("(?:[^"\\]|\\.)*"|[^,{}]+?)(?=, \w+ =| \})', found[3]))
            yield int(found[1]), found[2], fields


def fields_of(metadata):
    """Event → its fields, as EVENTS has them, from the description that the trace has of itself."""
    found = {}
    for name, body in re.findall(r'event \{\s*name = "(?:ros2:)?([\w:]+)";.*?fields := struct \{(.*?)\n\t\};\n\};', metadata, re.DOTALL):
        fields = []
        for line in filter(None, map(str.strip, body.splitlines())):
            kind, field = re.match(r"(.*?) _(\w+)(?:\[16\])?;$", line).groups()
            fields.append(f"{field}:{next((word for pattern, word in KINDS if re.fullmatch(pattern, kind)), kind)}")
        found[name] = " ".join(fields)
    return found


class Queues:
    """Of subscriptions: the messages that wait there."""

    def __init__(self):
        self.waiting, self.overwritten, self.strange = collections.defaultdict(list), collections.Counter(), []

    def add(self, event, fields):
        waiting = self.waiting[fields["buffer"]]
        if event.endswith("enqueue"):
            waiting.append(fields["index"])
            self.overwritten[fields["buffer"]] += int(fields["overwritten"])
        elif fields["index"] in waiting:
            waiting.remove(fields["index"])
        else:
            self.strange.append(fields)

    def check(self):
        left = {buffer: len(waiting) for buffer, waiting in self.waiting.items() if len(waiting) > self.overwritten[buffer]}
        check("what is taken out of a queue was put in, and nothing else", self.waiting and not self.strange and not left,
              self.strange[:2], left)


def name_of(fields, key):
    return fields[key].strip('"')


def test_one_process(name, *words):
    files = [folder / f"{name}.run.json", folder / f"{name}.trace.json"]
    with Session(name) as session:
        done = subprocess.run([takt, "run", "--duration", "1s", "--json", files[0], "--trace", files[1], *words],
                              env=traced, text=True, capture_output=True, timeout=60)
        check(f"{name} runs", done.returncode == 0, done.stderr)
    metadata = subprocess.run(["babeltrace2", "-o", "ctf-metadata", session.path / "ust/uid/0/64-bit"], text=True,
                              capture_output=True, timeout=60).stdout or "".join(
        subprocess.run(["babeltrace2", "-o", "ctf-metadata", path.parent], text=True, capture_output=True, timeout=60).stdout
        for path in session.path.rglob("metadata"))
    described = fields_of(metadata)
    check("names and fields are those of ROS 2", described == EVENTS,
          {name: (described.get(name), fields) for name, fields in EVENTS.items() if described.get(name) != fields})
    names, starts, running, wrong = {}, collections.Counter(), {}, []
    nodes, timers, published = set(), set(), collections.Counter()
    groups, placed, begun, ran, handles = {}, set(), {}, collections.defaultdict(list), {}
    queues = Queues()
    for time_ns, event, fields in session.events():
        if event == "rclcpp_callback_register":
            names[fields["callback"]] = name_of(fields, "symbol")
        elif event == "rcl_node_init":
            nodes.add(name_of(fields, "namespace").rstrip("/") + "/" + name_of(fields, "node_name"))
        elif event == "rclcpp_timer_link_node":
            timers.add(fields["timer_handle"])
        elif event == "rclcpp_intra_publish":
            published[fields["publisher_handle"]] += 1
        elif event == "rclcpp_subscription_init":
            handles[fields["subscription"]] = fields["subscription_handle"]
        elif event.startswith("rclcpp_ring_buffer"):
            queues.add(event, fields)
        elif event == "ros2_caret:add_callback_group":
            groups[fields["callback_group_addr"]] = fields["executor_addr"]
        elif event in ("ros2_caret:callback_group_add_timer", "ros2_caret:callback_group_add_subscription"):
            placed.add((fields["callback_group_addr"], fields.get("timer_handle") or fields["subscription_handle"]))
        elif event == "callback_start":
            begun[fields["vtid"]] = time_ns
            starts[fields["callback"]] += 1
            wrong += [fields] if running.setdefault(fields["vtid"], []) and fields["callback"] in running[fields["vtid"]] else []
            running[fields["vtid"]].append(fields["callback"])
        elif event == "callback_end":
            wrong += [fields] if not running.get(fields["vtid"]) or running[fields["vtid"]].pop() != fields["callback"] else []
            ran[int(fields["vtid"])].append((names.get(fields["callback"]), begun[fields["vtid"]], time_ns))
    rows = json.loads(files[0].read_text())["runs"][0]["callbacks"]
    counted = {f"{row['node']}/{row['callback']}": row["received"] for row in rows}
    seen = collections.Counter()
    for callback, count in starts.items():
        seen[names.get(callback)] += count
    check("as many executions as the run counts", {name: seen[name] for name in counted} == counted,
          {name: (seen[name], count) for name, count in counted.items() if seen[name] != count})
    check("each begins and ends on its thread", not wrong and not any(running.values()), wrong[:3])
    queues.check()
    at = {callback: group for group, callback in placed}
    check("each callback that ran is in a group of an executor", all(groups.get(at.get(handles.get(callback, callback))) for callback in starts
          if names[callback] in counted), groups, placed)
    trace = json.loads(files[1].read_text())
    test_times(trace, ran, set(counted))
    test_links(trace)
    check("nodes, timers and publications are there", {row["node"] for row in rows} <= nodes and timers and
          max(published.values()) > 50, nodes, timers, published)


def test_times(trace, ran, counted):
    """An execution of Takt's own trace begins before LTTng's, and ends after it; each is in both."""
    other, ours = trace["otherData"], collections.defaultdict(list)
    check("the trace says its clock", other["clock"] == "monotonic" and other["begin_ns"] > 0, other)
    for event in trace["traceEvents"]:
        if event["ph"] == "X" and event["cat"] != "sched":
            begin = other["begin_ns"] + round(event["ts"] * 1000)
            ours[event["tid"]].append((event["name"], begin, begin + round(event["dur"] * 1000)))
    lttng_s = {thread: [one for one in all_of_it if one[0] in counted] for thread, all_of_it in ran.items()}
    lttng_s = {thread: executions for thread, executions in lttng_s.items() if executions}
    same = {thread: [one[0] for one in sorted(executions, key=lambda one: one[1])] for thread, executions in ours.items()}
    check("both have the same executions", same == {thread: [one[0] for one in executions] for thread, executions in lttng_s.items()},
          {thread: len(executions) for thread, executions in ours.items()}, {thread: len(executions) for thread, executions in lttng_s.items()})
    pairs = [(mine, theirs) for thread in ours for mine, theirs in zip(sorted(ours[thread], key=lambda one: one[1]), lttng_s.get(thread, []))]
    outside = [(mine, theirs) for mine, theirs in pairs if not mine[1] <= theirs[1] <= theirs[2] <= mine[2] + 1]  # rounded
    check("LTTng's is within ours", pairs and not outside, outside[:3])
    for place, what in ((1, "begins"), (2, "ends")):
        apart = sorted(abs(mine[place] - theirs[place]) for mine, theirs in pairs)
        print(f"{what} apart: median {apart[len(apart) // 2]} ns, 99 % {apart[len(apart) * 99 // 100]} ns, longest {apart[-1]} ns, of {len(apart)}")


def test_links(trace):
    """Each message that a callback has taken is one that another has sent; each is taken once."""
    slices = [event for event in trace["traceEvents"] if event["ph"] == "X" and event["cat"] == "subscription"]
    alone = [event for event in slices if "caused_by" not in event["args"]]
    check("no link of a chain is missing", slices and not alone, len(slices), alone[:3])
    taken = collections.Counter((event["name"], event["args"]["sequence"]) for event in slices)
    check("none is there twice", max(taken.values()) == 1, taken.most_common(3))


PAIR = """
dds: {{shared_memory: off}}
containers:
  - {{name: sender, components: [{{component: takt::Workload, name: talker,
     parameters: {{publishers: {{topic: [chatter], period_us: [5000], size_bytes: [64]}}}}}}]}}
  - {{name: receiver, components: [{{component: takt::Workload, name: listener,
     parameters: {{subscriptions: {{topic: [chatter]}}}}}}]}}
threads: {{lttng: {{policy: SCHED_OTHER, affinity: [{cpu}]}}}}
"""


def test_two_processes():
    cpu = min(os.sched_getaffinity(0))
    (folder / "pair.yaml").write_text(PAIR.format(cpu=cpu))
    without_variable = {key: value for key, value in traced.items() if key != "TAKT_LTTNG"}
    affinities = {}
    with Session("two") as session:
        process = subprocess.Popen([takt, "run", folder / "pair.yaml", "--duration", "2s", "--json", folder / "pair.json"],
                                   env=without_variable, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        end = time.monotonic() + 20
        while process.poll() is None and time.monotonic() < end:
            for task in pathlib.Path("/proc").glob("[0-9]*/task/*"):
                try:
                    comm = (task / "comm").read_text().strip()
                    if comm.endswith("-ust") and os.readlink(task.parents[1] / "exe") == takt:
                        affinities[task.name] = os.sched_getaffinity(int(task.name))
                except (OSError, ProcessLookupError):
                    pass
            time.sleep(0.1)
        process.wait(30)
    check("LTTng's threads are those of the file", len(affinities) >= 4 and all(of == {cpu} for of in affinities.values()), affinities)
    sent, taken = [], []
    for _, event, fields in session.events():
        if event == "rmw_publish":
            sent.append(fields["timestamp"])
        elif event == "rmw_take":
            taken.append(fields["source_timestamp"])
    rows = json.loads((folder / "pair.json").read_text())["runs"][0]["callbacks"]
    received = sum(row["received"] for row in rows if row["kind"] == "subscription")
    check("each message is known on both sides by its time", len(taken) == received > 100 and set(taken) <= set(sent),
          len(taken), received, len(sent))


def test_probes():
    """Of a callback that runs a hundred times a second."""
    library = pathlib.Path(takt).parents[1] / "lib/libtakt.so"
    if shutil.which("bpftrace") is None or os.geteuid() != 0 or b"callback_start" not in library.read_bytes():
        print("skipped: no bpftrace, no right to use it, or no probes (Debian: bpftrace, systemtap-sdt-dev)")
        return
    process = subprocess.Popen([takt, "run", sys.argv[2]], env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    script = ("usdt:%s:takt:%s { @[probe, str(arg1)] = count(); }" % (library, name) for name in ("release", "callback_start", "callback_end"))
    done = subprocess.run(["bpftrace", "-e", " ".join(script) + " interval:s:2 { exit(); }"], text=True, capture_output=True, timeout=60)
    process.send_signal(2)
    process.wait(30)
    counts = {(name, callback): int(count) for name, callback, count in re.findall(r"takt:(\w+), (\w+)\]: (\d+)", done.stdout)}
    if not counts:
        print("skipped: bpftrace sees nothing: " + done.stderr[:200])
        return
    check("bpftrace sees each callback by its name", min(counts.get((name, "imu_timer"), 0) for name in
          ("release", "callback_start", "callback_end")) > 20, counts)


def test_without():
    process = subprocess.Popen([takt, "run", sys.argv[2], "--duration", "300ms"], env=environment, stdout=subprocess.DEVNULL,
                               stderr=subprocess.DEVNULL)
    maps = set()
    while process.poll() is None:
        try:
            maps |= set(re.findall(r"lib\w+", pathlib.Path(f"/proc/{process.pid}/maps").read_text()))
        except OSError:
            break  # it has just ended
    check("nobody else loads it", "libtakt" in maps and "libtakt_lttng" not in maps, maps)


with Daemon():
    test_one_process("mont_blanc", pathlib.Path(__file__).resolve().parents[3] / "bench/workloads/mont_blanc.yaml")
    if (program := pathlib.Path(takt).with_name("rclcpp_talk")).exists():
        test_one_process("program", "--", program)
    test_two_processes()
test_without()
test_probes()
shutil.rmtree(folder)
finish()
