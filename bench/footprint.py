"""Memory of processes and nodes, and what an idle process costs: a part of results.py.

Everything runs in a network of its own, so that nothing else is on the DDS domain.
SPDX-License-Identifier: Apache-2.0
"""
import contextlib
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

PROGRAMS = ("takt", "footprint_nodes", "footprint_cyclone")
SETTLED_S = 4  # discovery is over, and what was taken for the start is given back
IDLE_S = 20
# What Takt says to Cyclone, as far as it changes its memory.
CYCLONE = ("<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo' multicast='false'/></Interfaces>"
           "<AllowMulticast>false</AllowMulticast><MaxMessageSize>65500B</MaxMessageSize><FragmentSize>65000B</FragmentSize>"
           "</General><Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>119</MaxAutoParticipantIndex>"
           "<Peers><Peer address='127.0.0.1'/></Peers><LeaseDuration>3s</LeaseDuration></Discovery><Internal>"
           "<SocketReceiveBufferSize min='default' max='10MB'/></Internal></Domain></CycloneDDS>")


def empty_nodes(count):
    return ("container:\n  name: footprint\n  components:\n" +
            "".join(f"    - {{component: takt::Workload, name: node_{number}}}\n" for number in range(count)))


def children_of(pid):
    found = [pid]
    for task in pathlib.Path(f"/proc/{pid}/task").iterdir():
        for child in (task / "children").read_text(encoding="ascii").split():
            found += children_of(int(child))
    return found


def pss_kb(pid):
    for line in pathlib.Path(f"/proc/{pid}/smaps_rollup").read_text(encoding="ascii").splitlines():
        if line.startswith("Pss:"):
            return int(line.split()[1])
    return 0


def wakes_of(pids):
    """Thread → how often it has given up the CPU by itself: it wakes as often."""
    wakes = {}
    for pid in pids:
        for task in pathlib.Path(f"/proc/{pid}/task").iterdir():
            status = dict(line.split(":\t", 1) for line in (task / "status").read_text(encoding="ascii").splitlines() if ":\t" in line)
            wakes[pid, task.name, status["Name"]] = int(status["voluntary_ctxt_switches"])
    return wakes


def cpu_ns(pids):
    return sum(int((task / "schedstat").read_text(encoding="ascii").split()[0])
               for pid in pids for task in pathlib.Path(f"/proc/{pid}/task").iterdir())


def datagrams_sent():
    names, values = [line.split() for line in pathlib.Path("/proc/net/snmp").read_text(encoding="ascii").splitlines()
                     if line.startswith("Udp:")]
    return int(values[names.index("OutDatagrams")])


def copy_of_libraries(programs, folder):
    """Pages of a library that other processes have, too, count as a part: so these have files of their own."""
    folder.mkdir()
    for program in programs:
        listed = subprocess.run(["ldd", program], stdout=subprocess.PIPE, text=True, check=True).stdout
        for line in listed.splitlines():
            if " => /" in line:
                shutil.copy(line.split()[2], folder)
    os.environ["LD_LIBRARY_PATH"] = str(folder)


@contextlib.contextmanager
def running(commands, environment):
    """All processes of the commands."""
    started = [subprocess.Popen([str(word) for word in command], env={**os.environ, **environment},
                                stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) for command in commands]
    try:
        time.sleep(SETTLED_S)
        yield [pid for process in started for pid in children_of(process.pid)]
    finally:
        for process in started:
            process.terminate()
        for process in started:
            process.wait()


def memory_of(commands, environment):
    with running(commands, environment) as pids:
        return round(sum(map(pss_kb, pids)) / 1024, 2)


def idle_of(commands, environment):
    """Of all processes together, a second."""
    with running(commands, environment) as pids:
        before, cpu, sent, begin = wakes_of(pids), cpu_ns(pids), datagrams_sent(), time.monotonic()
        time.sleep(IDLE_S)
        length = time.monotonic() - begin
        after, sent, cpu = wakes_of(pids), datagrams_sent() - sent, cpu_ns(pids) - cpu
        threads = {}
        for key, count in after.items():
            threads[key[2]] = threads.get(key[2], 0) + count - before.get(key, 0)
        return {"wakes": round(sum(threads.values()) / length, 2), "datagrams": round(sent / length, 1),
                "cpu_percent": round(100 * cpu / 1e9 / length, 3),
                "threads": {name: round(count / length, 2) for name, count in sorted(threads.items()) if count}}


def rows(binaries, folder, reference):
    """Name → (commands, environment)."""
    takt, nodes, cyclone = (binaries / name for name in PROGRAMS)
    alone = {"CYCLONEDDS_URI": CYCLONE}

    def container(count, composition="single"):
        path = folder / f"{count}.yaml"
        path.write_text(empty_nodes(count), encoding="utf-8")
        return [[takt, "run", path, "--composition", composition, "--transport", "dds", "--duration", "1h"]], {}

    result = {f"layer, {count} nodes that pass texts on": ([[nodes, "ring", count]], {}) for count in (2, 20, 100)}
    result |= {f"layer, {count} empty nodes": ([[nodes, "empty", count]], {}) for count in (1, 20, 40)}
    result["layer, 20 processes of an empty node"] = [[nodes, "empty", 1]] * 20, {}
    result |= {f"container, {count} empty nodes": container(count) for count in (1, 20, 40)}
    result["20 containers of an empty node"] = container(20, "per-node")
    if reference:
        result["reference system"] = ([reference.split()], {})
    result |= {f"Cyclone alone, {count} empty nodes": ([[cyclone, count]], alone) for count in (1, 20, 40, 100)}
    result["Cyclone alone, 20 processes of an empty node"] = ([[cyclone, 1]] * 20, alone)
    return result


def idle_rows(binaries):
    node = [binaries / "footprint_nodes", "empty", 1]
    return {"an empty node of the layer": [node], "20 empty nodes of the layer, a process each": [node] * 20,
            "Cyclone alone": [[binaries / "footprint_cyclone", 1]]}


# ---- The page ----

def what_follows(document):
    """A few sentences for a user."""
    memory, before = document["memory_mb"], document["before"]["memory_mb"]

    def each(rows, kind, what):
        return 1000 * (rows[f"{kind}, 40 {what}"] - rows[f"{kind}, 20 {what}"]) / 20

    layer, layer_before, alone = (each(rows, kind, "empty nodes") for rows, kind in (
        (memory, "layer"), (before, "layer"), (memory, "Cyclone alone")))
    idle, idle_before = (rows["idle"]["an empty node of the layer"] for rows in (document, document["before"]))
    return (f"A further empty node of a program for rclcpp takes {layer:.0f} kB, where it took {layer_before:.0f}; the sixteen "
            f"endpoints that it has in ROS 2 take {alone:.0f} kB in Cyclone DDS alone. A further component that answers nobody takes "
            f"{each(memory, 'container', 'empty nodes'):.0f} kB. An idle process wakes {idle['wakes']:.1f} times a second where it woke "
            f"{idle_before['wakes']:.0f} times.")


def section(document, table):
    now, before = document, document["before"]
    rows = [[name, before["memory_mb"].get(name, "–"), mb] for name, mb in now["memory_mb"].items()]
    idle = [[name, *(f"{before['idle'][name][key]:.{digits}f} → {row[key]:.{digits}f}" if name in before["idle"] else f"{row[key]:.{digits}f}"
                     for key, digits in (("wakes", 1), ("datagrams", 0), ("cpu_percent", 2)))] for name, row in now["idle"].items()]
    return ("## Memory\n\nPSS in MB, of all processes of a row, four seconds after their start. Nobody else uses "
            "their libraries: all of these count.\n\n" +
            table(["row", "before", "now"], rows) +
            "\n\nA node of the layer is one of a program for rclcpp, with its parameter services, `/rosout` and `/parameter_events`: "
            "sixteen endpoints. `Cyclone alone` has as many endpoints and no Takt.\n\n## Idle\n\nOf all processes of a row, a second; CPU in % "
            "of one.\n\n" +
            table(["row", "wake-ups", "datagrams sent", "CPU"], idle) +
            "\n\n[What wakes a process](../reference/limits.md#what-wakes-an-idle-process).")


def measured(binaries, reference, wanted=()):
    with tempfile.TemporaryDirectory() as folder:
        copy_of_libraries([binaries / name for name in PROGRAMS] + reference.split()[:1], pathlib.Path(folder) / "lib")
        document = {"memory_mb": {}, "idle": {}}
        for name, (commands, environment) in rows(binaries, pathlib.Path(folder), reference).items():
            if not wanted or any(word in name for word in wanted):
                document["memory_mb"][name] = memory_of(commands, environment)
                print(f"{document['memory_mb'][name]:8.2f} MB  {name}", file=sys.stderr)
        for name, commands in idle_rows(binaries).items():
            if not wanted or any(word in "idle " + name for word in wanted):
                document["idle"][name] = idle_of(commands, {"CYCLONEDDS_URI": CYCLONE} if name.startswith("Cyclone") else {})
                print(document["idle"][name], name, file=sys.stderr)
    return document


# Two interfaces, as a machine with a network has them.
NETWORK = ("ip link set lo up && ip link add cable type veth peer name other && ip address add 10.9.0.1/24 dev cable && "
           'ip link set cable up && ip link set other up && exec "$@"')


def measure(binaries):
    """As root. FOOTPRINT_REFERENCE: a command that runs the reference system, see reference_system.md."""
    script = pathlib.Path(__file__).resolve()
    done = subprocess.run(["unshare", "-n", "sh", "-c", NETWORK, "sh", sys.executable, script, binaries,
                           os.environ.get("FOOTPRINT_REFERENCE", "")], stdout=subprocess.PIPE, check=True)
    return json.loads(done.stdout)


if __name__ == "__main__":
    print(json.dumps(measured(pathlib.Path(sys.argv[1]).resolve(), sys.argv[2], sys.argv[3:]), indent=1))
