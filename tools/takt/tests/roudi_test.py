#!/usr/bin/env python3
"""RouDi as takt run starts it: several runs share one, it ends with the last, and its files go with
it however that ends.

usage: roudi_test.py TAKT WITNESS_LIBRARY
"""
# SPDX-License-Identifier: Apache-2.0
import fcntl
import glob
import json
import os
import signal
import subprocess
import sys
import tempfile
import time

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../cmake"))
from checks import (check, environment, eventually, finish, roudi_of, roudi_runs,  # noqa: E402
                    skip_without_shared_memory)

SYSTEM = """
dds: {shared_memory: require, domain: DOMAIN}
containers:
  - name: sender
    components:
      - component: takt::Workload
        name: publisher
        parameters: {publishers.topic: [/data], publishers.period_us: [5000], publishers.fixed_bytes: [1000]}
  - name: receiver
    components:
      - component: takt::Workload
        name: subscriber
        parameters: {subscriptions.topic: [/data], subscriptions.fixed_bytes: [1000]}
      - {component: Witness, library: LIBRARY}
"""

takt, library = (os.path.abspath(path) for path in sys.argv[1:])
skip_without_shared_memory()
folder = tempfile.TemporaryDirectory()
environment["WITNESS"] = folder.name
domain = int(environment["ROS_DOMAIN_ID"])


def system(number):
    path = os.path.join(folder.name, f"{number}.yaml")
    with open(path, "w") as file:
        file.write(SYSTEM.replace("DOMAIN", str((domain + number) % 230))
                   .replace("LIBRARY", library))
    return path


def start(number, *options):
    return subprocess.Popen([takt, "run", system(number), *options], env=environment,
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


# Another user could make the lock file first and hold it: `require` waited for ever.
if os.geteuid() == 0:
    lock = "/tmp/.takt_roudi_0.start"
    if os.path.exists(lock):
        os.remove(lock)
    with open(lock, "w") as file:
        os.chown(lock, 65534, 65534)
        fcntl.flock(file, fcntl.LOCK_EX)
        run = start(0, "--duration", "1s")
        said = run.communicate(timeout=60)[0]
        check("a lock file of another user is an error", run.returncode == 1
              and f"{lock} is not ours: it belongs to user 65534" in said, run.returncode, said)
    os.remove(lock)

# One of our own that hangs held others up for 20 s. It has no keeper, which would start RouDi.
with open("/tmp/.takt_roudi_%d.start" % os.geteuid(), "w") as file:
    fcntl.flock(file, fcntl.LOCK_EX)
    run = start(0, "--duration", "1s")
    said = run.communicate(timeout=60)[0]
    check("a process of our own that hangs with the lock is one, too", run.returncode == 1
          and "another run holds the lock" in said, run.returncode, said)

# Serves until the first question, and ends instead of an answer.
MORTAL_ROUDI = """#!/usr/bin/env python3
import fcntl, socket
open("/proc/self/comm", "w").write("iox-roudi")
lock = open("/tmp/iox-unique-roudi.lock", "w")
fcntl.flock(lock, fcntl.LOCK_EX)
open("/dev/shm/iceoryx_mgmt", "w")
server = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
server.bind("/tmp/roudi")
print("RouDi is ready for clients", flush=True)
server.recv(4096)
"""


def left_behind():
    files = [file for pattern in ("/tmp/*roudi*", "/tmp/iceoryx_rt_*", "/dev/shm/iceoryx*")
             for file in glob.glob(pattern)]
    return files + (["iox-roudi"] if roudi_runs() else [])


# They removed each other's files, and each ended the RouDi that the others had. The folder is that of a keeper that was
# killed, and stayed.
os.mkdir(f"/tmp/takt_roudi_{os.getpid()}")
results = [os.path.join(folder.name, f"{number}.json") for number in range(4)]
runs = [start(number, "--duration", f"{1 + number}s", "--json", result)
        for number, result in enumerate(results)]
said = [run.communicate(timeout=200)[0] for run in runs]
check("four runs at once share a RouDi", all(run.returncode == 0 for run in runs), *said)
transports = [topic["transport"] for result in results if os.path.exists(result)
        for topic in json.load(open(result))["runs"][0]["topics"]]
check("and all of their messages go by shared memory", transports == 8 * ["shared memory"], transports)
check("it ends with the last", not left_behind(), left_behind())

first = start(0)
eventually(roudi_runs)
second = start(1, "--duration", "1s")  # finds a RouDi that serves, or none
first.send_signal(signal.SIGINT)
first.communicate(timeout=100)
said = second.communicate(timeout=100)[0]
check("who has started it may end first", second.returncode == 0, said)
check("and it ends with the other", not left_behind(), left_behind())

# At any moment: they are spread over what a start takes.
for ending, step in ((signal.SIGTERM, 0.03), (signal.SIGHUP, 0.1), (signal.SIGKILL, 0.1)):
    for moment in range(12 if ending == signal.SIGTERM else 4):
        run = start(0)
        time.sleep(moment * step)
        run.send_signal(ending)
        run.communicate(timeout=100)
        gone = eventually(lambda: not left_behind())
        check(f"{ending.name} {moment * step:.2f} s after the start leaves nothing behind", gone,
              left_behind())

# Its clients wait for its answer when they end: not for ever.
ticks = os.path.join(folder.name, "witness.ticks")
os.remove(ticks)  # of earlier runs
run = start(0)
eventually(lambda: os.path.exists(ticks))  # it runs
os.kill(roudi_of(run.pid)[0], signal.SIGSTOP)
run.send_signal(signal.SIGINT)
said = run.communicate(timeout=100)[0]
check("a run ends though RouDi is stopped", run.returncode == 0, run.returncode, said)
check("whose processes say that they do not wait", said.count("ends without a goodbye") == 2, said)
check("it leaves nothing behind", eventually(lambda: not left_behind()), left_behind())

# The self-test ended with nothing where another RouDi has no room for its messages.
configuration = os.path.join(folder.name, "roudi.toml")
with open(configuration, "w") as file:
    file.write("[general]\nversion = 1\n[[segment]]\n[[segment.mempool]]\nsize = 128\ncount = 100\n")
foreign = subprocess.Popen(["iox-roudi", "-m", "off", "-c", configuration], stdout=subprocess.PIPE, text=True)
check("another RouDi starts", any("ready for clients" in line for line in foreign.stdout))
selftest = subprocess.run([takt, "selftest", "--executors", "events", "--transports", "intra,shm", "--json", "-"],
                          env=environment, stdout=subprocess.PIPE, text=True, timeout=200)
foreign.terminate()
foreign.wait(timeout=100)
found = json.loads(selftest.stdout)
check("the self-test shows what it has found before a run fails", selftest.returncode == 1
      and {finding["transport"] for finding in found["findings"]} == {"", "intra"}
      and any("events, shm: " in note for note in found["notes"]), selftest.returncode, found)
check("and another's RouDi leaves nothing behind", eventually(lambda: not left_behind()), left_behind())

# The keeper's question to it was left behind, a file.
path = os.path.join(folder.name, "iox-roudi")
with open(path, "w") as file:
    file.write(MORTAL_ROUDI)
os.chmod(path, 0o755)
environment["PATH"] = folder.name + ":" + environment["PATH"]
run = start(0)
said = run.communicate(timeout=100)[0]
check("a RouDi that dies while it is asked is an error",
      run.returncode == 1 and "RouDi does not start" in said, run.returncode, said)
check("and leaves nothing behind", not left_behind(), left_behind())
finish()
