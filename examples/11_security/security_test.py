#!/usr/bin/env python3
"""The files of this folder, run: a process with an identity and the permission gets messages, and
no other does. Reports what rejected each of the others.

usage: security_test.py TAKT DOCUMENT
"""
# SPDX-License-Identifier: Apache-2.0
import glob
import json
import os
import re
import shutil
import socket
import subprocess
import sys
import tempfile

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../cmake"))
from checks import check, environment, finish, skip  # noqa: E402

takt, document = map(os.path.abspath, sys.argv[1:])
here = os.path.dirname(os.path.abspath(__file__))
domain = int(environment["ROS_DOMAIN_ID"])


text = open(document).read()
for name in ["keys.sh", "governance.xml", "permissions.xml", "talker.yaml"]:
    check(f"{name} stands in {os.path.basename(document)}",
          open(os.path.join(here, name)).read() in text)
if shutil.which("openssl") is None:
    skip("there is no openssl (apt-get install openssl)")
if len(glob.glob("/usr/lib/*/libddsc*/libdds_security_*.so")) < 3:
    skip("Cyclone's plug-ins for DDS Security are not installed")

temporary = tempfile.TemporaryDirectory()
for file in os.listdir(here):
    shutil.copy(os.path.join(here, file), temporary.name)
os.chdir(temporary.name)


def make_keys(where, *names):
    subprocess.run(["./keys.sh", where, *names], check=True, capture_output=True)


def write(name, base, *changes):
    """Another file: `base` with (pattern, replacement)s."""
    content = open(base).read()
    for pattern, replacement in changes:
        content, count = re.subn(pattern, replacement, content)
        assert count > 0, (name, pattern)
    with open(name, "w") as file:
        file.write(content)


def run(*names, seconds=3):
    """Runs these files at the same time. For each: what its only row received, and what it said."""
    processes = [subprocess.Popen([takt, "run", name + ".yaml", "--duration", f"{seconds}s",
                                   "--json", name + ".json"], env=environment, text=True,
                                  stdout=subprocess.PIPE, stderr=subprocess.PIPE)
                 for name in names]
    results = []
    for name, process in zip(names, processes):
        said = process.communicate(timeout=60)[1]
        row = {"received": 0}
        if process.returncode == 0:
            row = json.load(open(name + ".json"))["runs"][0]["callbacks"][0]
        results.append((row["received"], said, process.returncode))
    return results


def wiretap():
    """What passes over the loopback interface from here on; None without the right to see it."""
    try:
        tap = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(3))
    except PermissionError:
        return None
    tap.setsockopt(socket.SOL_SOCKET, 33, 64 << 20)  # SO_RCVBUFFORCE
    tap.bind(("lo", 0))
    tap.setblocking(False)
    return tap


def shows_type(tap):
    """Whether the type of the topic was in one of the datagrams of our domain. (The topic itself is
    named in the permissions, which are no secret: each shows them to the others.)"""
    ports = range(7400 + 250 * domain, 7400 + 250 * (domain + 1))
    found = False
    while True:
        try:
            frame = tap.recv(65600)
        except BlockingIOError:
            tap.close()
            return found
        is_ours = len(frame) > 42 and int.from_bytes(frame[36:38], "big") in ports
        found |= is_ours and b"msg::dds_::Workload_" in frame


make_keys("keys", "talker", "listener", "eve")
make_keys("other", "talker")

# Two with identities.
tap = wiretap()
(sent, _, _), (received, said, _) = run("talker", "listener")
# Each 10 ms for 3 s, less what the start and the handshake take.
check("two with identities and permissions exchange messages", 100 < sent <= 302 and 50 < received <= sent,
      sent, received, said)
if tap is None:
    print("skipped: what the wire shows; listening needs root")
else:
    check("the wire does not show the type", not shows_type(tap))

# Without an identity: neither receives nor is received.
plain = (r"(?s)dds:.*?container", "dds: {}\ncontainer")
write("spy.yaml", "listener.yaml", plain)
write("mallory.yaml", "talker.yaml", plain)
_, (received, said, _) = run("talker", "spy")
check("'spy' without an identity gets nothing", received == 0, received, said)
_, (received, said, _) = run("mallory", "listener")
check("'mallory' without an identity is received by no process with one", received == 0, received, said)
tap = wiretap()
(sent, _, _), (received, said, _) = run("mallory", "spy")
check("these two hear each other", 50 < received <= sent, sent, received, said)
check("and the wire shows all of it", tap is None or shows_type(tap))

# An identity that somebody else has signed.
write("stranger.yaml", "talker.yaml", ("keys/", "other/"))
_, (received, said, _) = run("stranger", "listener")
check("'stranger' of another authority is refused by the listener",
      received == 0 and "handshake" in said and "/CN=talker" in said, received, said)

# What its own side rejects.
write("eve.yaml", "talker.yaml", ("keys/talker", "keys/eve"))
write("secret.yaml", "talker.yaml", (r"topic: \[imu\]", "topic: [secret]"))
write("forged.yaml", "talker.yaml", ("keys/talker", "other/talker"))
write("unsigned.yaml", "talker.yaml", ("keys/permissions.p7s", "other/permissions.p7s"))
write("elsewhere.xml", "permissions.xml", ("<min>0</min><max>230</max>",
                                           f"<min>{domain + 1}</min><max>{domain + 1}</max>"))
subprocess.run("openssl smime -sign -text -in elsewhere.xml -signer keys/ca.pem"
               " -inkey keys/ca.key -out elsewhere.p7s", shell=True, check=True)
write("elsewhere.yaml", "talker.yaml", ("keys/permissions.p7s", "elsewhere.p7s"))
subprocess.run("openssl ec -in keys/talker.key -aes128 -passout pass:x -out locked.key",
               shell=True, check=True, capture_output=True)
shutil.copy("keys/talker.key", "open.key")
os.chmod("open.key", 0o644)
for name, key in [("locked", "locked.key"), ("open", "open.key"), ("mixed", "keys/eve.key")]:
    write(name + ".yaml", "talker.yaml", ("keys/talker.key", key))
for name, who, reason in [
        ("eve", "which no permission names", "Subject name is invalid"),
        ("secret", "whose permissions forbid the topic",
         "secret.yaml:11: component 'takt::Workload' could not be made: topic '/secret' with type "
         "takt/msg/Workload could not be made: Not Allowed By Security"),
        ("forged", "whose certificate another authority has signed",
         "Certificate not valid: error: certificate signature failure; subject: /CN=talker"),
        ("unsigned", "whose permissions another authority has signed", "certificate verify error"),
        ("elsewhere", "whose permissions are for other domains", "denied by default rule"),
        ("locked", "whose key has a password", "locked.yaml:5: the private key"),
        ("open", "whose key is open to all", "open.yaml:5: the private key"),
        ("mixed", "whose key is another's", "mixed.yaml:5: the private key")]:
    _, said, status = run(name)[0]
    check(f"'{name}', {who}, is refused at its start", status == 2 and reason in said, status, said)
    if "private key" in reason:
        checked = subprocess.run([takt, "check", name + ".yaml"], capture_output=True, text=True)
        check("and by `takt check`", checked.returncode == 2 and reason in checked.stderr,
              checked.returncode, checked.stderr)

# Fragments are encrypted too.
large = (r"size_bytes: \[320\]", "size_bytes: [1000000]")
write("large.yaml", "talker.yaml", large, (r"period_us: \[10000\]", "period_us: [50000]"))
(sent, _, _), (received, said, _) = run("large", "listener")
check("a message of 1 MB passes", 10 < received <= sent, sent, received, said)

finish()
