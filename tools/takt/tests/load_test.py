#!/usr/bin/env python3
"""What a running container loads when anybody asks: what the component index and its file name, what
its owner allows besides, and nothing else. A request that is refused leaves the container as it was.

usage: load_test.py TAKT LIBRARY CLASS: a library of components that registers the class
"""
# SPDX-License-Identifier: Apache-2.0
import os
import shutil
import signal
import subprocess
import sys
import tempfile

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../cmake"))
from checks import check, environment, eventually, finish  # noqa: E402

takt, library = map(os.path.abspath, sys.argv[1:3])
name = sys.argv[3]
temporary = tempfile.TemporaryDirectory()
folder = os.path.realpath(temporary.name)
index = "prefix/share/ament_index/resource_index/rclcpp_components"
for part in (index, "prefix/lib", "ours/below", "theirs"):
    os.makedirs(os.path.join(folder, part))


def place(*parts):
    return os.path.join(folder, *parts)


known, ours, below, theirs = (shutil.copy(library, place(part, "libguest.so"))
                              for part in ("prefix/lib", "ours", "ours/below", "theirs"))
with open(place(index, "guests"), "w") as file:
    file.write(f"{name};lib/libguest.so\n")
environment["AMENT_PREFIX_PATH"] = place("prefix")
os.symlink(theirs, place("ours", "libdisguised.so"))
os.symlink(ours, place("theirs", "libhonest.so"))
os.symlink(place("ours"), place("link"))


def run(*command):
    return subprocess.run([takt, *command], env=environment, capture_output=True, text=True,
                          timeout=120)


class Container:
    """It runs in its block, and must have gone on until then."""

    def __init__(self, *options):
        self.what = " ".join(options).replace(folder + "/", "")
        self.process = subprocess.Popen([takt, "run", *options], env=environment,
                                        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                                        text=True)

    def __enter__(self):
        eventually(lambda: self.process.poll() is not None or run("component", "list", "robot").returncode == 0)
        return self

    def __exit__(self, *_):
        listed = run("component", "list", "robot")
        check(f"{self.what}: it goes on", listed.returncode == 0 and "robot" in listed.stdout,
              listed.stdout, listed.stderr)
        self.process.send_signal(signal.SIGINT)
        said = self.process.communicate(timeout=60)[1]
        check(f"{self.what}: it ends well", self.process.returncode == 0, said)

    def load(self, *words):
        return run("component", "load", "robot", *words)

    def maps(self, file):
        return file in open(f"/proc/{self.process.pid}/maps").read()

    def loads(self, path):
        done = self.load(name, "--library", path)
        check(f"{self.what}: {path.replace(folder + '/', '')} is loaded", done.returncode == 0,
              done.stderr)
        if done.returncode == 0:
            run("component", "unload", "robot", done.stdout.split()[0])

    def refuses(self, path, *reasons):
        done = self.load(name, "--library", path)
        check(f"{self.what}: {path.replace(folder + '/', '')} is refused",
              done.returncode == 1 and all(reason in done.stderr for reason in reasons),
              done.returncode, done.stderr)
        check("and nothing of it is in memory", not self.maps(os.path.realpath(path)))


not_named = (f"library '{theirs}' may not be loaded: neither the component index nor the "
             "container's file names it", f"`load: {{libraries: [{place('theirs')}]}}`",
             f"`takt run --name NAME --load {place('theirs')}`")

if os.geteuid() == 0:
    with Container("--name", "robot") as container:
        container.refuses(known, "this container runs as root", "`load: index`",
                          "`takt run --name NAME --load index`")
        done = container.load("takt::Workload")
        check("root's loads nothing at all", done.returncode == 1 and "as root" in done.stderr,
              done.stderr)

with Container("--name", "robot", "--load", "index") as container:
    container.refuses(theirs, *not_named)
    container.refuses(place("ours", "libdisguised.so"), *not_named)
    container.refuses("libm.so.6", "may not be loaded")
    container.refuses(place("nothing.so"), "may not be loaded")
    container.loads(known)
    done = container.load(name)
    check("a class of ROS 2's index needs no library", done.returncode == 0, done.stderr)

with Container("--name", "robot", "--load", place("link")) as container:
    container.refuses(theirs, *not_named)
    container.refuses(place("ours", "libdisguised.so"), *not_named)
    container.refuses(place("ours", "..", "theirs", "libguest.so"), *not_named)
    container.refuses(place("ours", "no.so"), f"there is no library '{place('ours', 'no.so')}'")
    container.loads(place("theirs", "libhonest.so"))

with Container("--name", "robot", "--load", place("ours"), "--load", place("theirs")) as container:
    container.loads(below)

with Container("--name", "robot", "--load", "off") as container:
    container.refuses(known, "loads no components on request", "`load: index`",
                      "`takt run --name NAME --load index`")
    done = container.load("takt::Workload")
    check("nor a class of takt", done.returncode == 1 and "on request" in done.stderr, done.stderr)

with Container("--name", "robot", "--load", "any") as container:
    container.loads(theirs)

# A recorder in root's container wrote what anybody published over root's scripts.
script = place("start.sh")
with open(script, "w") as file:
    file.write("echo start the robot")
os.makedirs(place("recordings"), 0o700)
for options in (("--load", "index"), ("--recordings", place("recordings"))):
    with Container("--name", "robot", *options) as container:
        for component in ("takt::Recorder", "takt::Player", "takt::tools::Stamps"):
            done = container.load(component, "-p", f"file:={script}")
            check(f"no file of the owner's is open to {component}", done.returncode == 1,
                  done.stdout, done.stderr)
        done = container.load("takt::Recorder", "-p", "file:=new.mcap")
        check("a new one where the owner says", done.returncode == (1 if "--load" in options else 0)
              and ("--load" not in options or "`load: {recordings: DIR}`" in done.stderr),
              done.stdout, done.stderr)
check("the script is as it was", open(script).read() == "echo start the robot")
check("the recording is there, and the owner's only",
      os.stat(place("recordings", "new.mcap")).st_mode & 0o777 == 0o600)

with open(place("robot.yaml"), "w") as file:
    file.write(f"""
dds: {{}}
container:
  name: robot
  load: index
  components:
    - {{component: {name}, library: ./theirs/libhonest.so, name: first}}
""")
with Container(place("robot.yaml")) as container:
    container.refuses(theirs, *not_named)
    container.loads(ours)

for options, reason in [
        (("--name", "robot", "--load", place("nowhere")), f"there is no folder '{place('nowhere')}'"),
        (("--name", "robot", "--load", "any", "--load", place("ours")), "cannot be combined"),
        (("--name", "robot", "--recordings", place("nowhere")),
         f"there is no folder '{place('nowhere')}'"),
        (("--name", "robot", "--recordings", "/tmp"), "every user of this machine can change"),
        ((place("robot.yaml"), "--load", "any"), "--load is for --name only")]:
    done = run("run", *options)
    check(f"{' '.join(options)} is refused".replace(folder + "/", ""),
          done.returncode == 2 and reason in done.stderr, done.returncode, done.stderr)
finish()
