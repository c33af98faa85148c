"""Files that nobody means well with, for files_test.py: changed at random, of types at random, or no
regular files at all.

SPDX-License-Identifier: Apache-2.0
"""
import os
import pathlib
import re
import socket
import struct

NUMBERS = ["0", "-1", "1", "255", "65536", "1000000", "2147483647", "4294967296", "9223372036854775807",
           "18446744073709551616", "1" + "0" * 40, "1e308", "1e999", "-1e-300", "nan", "inf", "0x7f", "0.1"]
TOKENS = [b"{", b"}", b"[", b"]", b"[" * 500, b"{a: " * 500, b": ", b"- ", b"\n", b"\r", b"\t", b"\"", b"'", b"#", b",",
          b"&a ", b"*a", b"<<: *a\n", b"!!binary ", b"%YAML 9\n", b"---\n", b"...", b"\\u0000", b"\\ud800", b"~", b"null",
          b"true", b"\0", b"\x1b]0;owned\x07", b"\x80", b"\xff\xfe", b"\xef\xbb\xbf", b"\xe2\x80\xa8", b"%s%n", b"../",
          b"/dev/zero", b"/proc/self/mem", b"a" * 5000]
SIZES = [0, 1, 0x7f, 0xff, 0xffff, 0x7fffffff, 0xffffffff, 1 << 40, (1 << 63) - 1, (1 << 64) - 1]
PRIMITIVES = ["bool", "byte", "char", "int8", "uint8", "int32", "uint64", "float32", "float64", "string", "wstring",
              "string<=3", "wstring<=99999999999999999999", "std_msgs/Header", "Header", "time", "fz/Nowhere"]


def changed(random, samples):
    """One of the samples, after a few changes."""
    data = random.choice(samples)
    for _ in range(random.choice((1, 1, 2, 4, 12))):
        data = changed_once(random, data, samples)
    return data


def changed_once(random, data, samples):
    at = random.randrange(len(data) + 1)
    until = min(len(data), at + random.choice((1, 4, 30, 300)))
    change = random.randrange(9)
    if change == 0:
        return data[:at] + random.randbytes(until - at) + data[until:]
    if change == 1:
        return data[:at] + data[until:]
    if change == 2:
        return data[:until] + data[at:until] * random.choice((1, 1, 3, 300)) + data[until:]
    if change == 3:
        return data[:at] + random.choice(TOKENS) + data[at:]
    if change == 4:
        return data[:at]
    if change == 5:
        return data[:at] + struct.pack("<Q", random.choice(SIZES)) + data[at + 8:]
    if change == 6:
        other = random.choice(samples)
        return data[:at] + other[random.randrange(len(other)):]
    numbers = list(re.finditer(rb"\d+", data[:100_000]))
    if change == 7 and numbers:
        number = random.choice(numbers)
        return data[:number.start()] + random.choice(NUMBERS).encode() + data[number.end():]
    lines = data.split(b"\n")
    random.shuffle(lines[at % len(lines):])
    one, other = random.randrange(len(lines)), random.randrange(len(lines))
    lines[one], lines[other] = lines[other], lines[one]
    return b"\n".join(lines)


def definition(random, types, parts):
    """An interface of fields of these types, itself among them perhaps."""
    def field(number):
        array = random.choice(("", "", "[]", "[3]", "[<=3]", f"[{random.choice(NUMBERS)}]", "[60000]"))
        base = random.choice(types if random.random() < 0.6 else PRIMITIVES)
        value = random.choice(("", "", "", " 1", " [1, 2, 3]", f" {random.choice(NUMBERS)}", " 'a\\", f"={random.choice(NUMBERS)}"))
        name = random.choice((f"f{number}", f"f{number}", "f0", "class", "F", "data"))
        return f"{base}{array} {name}{value}\n"
    return "---\n".join("".join(map(field, range(random.choice((0, 1, 2, 5))))) for _ in range(parts))


def special_files(folder):
    """Name and path of a file that cannot be used."""
    folder = pathlib.Path(folder)
    os.mkfifo(folder / "fifo")
    (folder / "folder").mkdir()
    (folder / "loop").symlink_to("loop")
    (folder / "dangling").symlink_to("nowhere")
    (folder / "empty").touch()
    (folder / "forbidden").write_text("a: 1\n")
    (folder / "forbidden").chmod(0)
    (folder / "binary").write_bytes(bytes(range(256)) * 256)
    with open(folder / "sparse", "w") as sparse:
        sparse.truncate(10 << 30)
    socket.socket(socket.AF_UNIX).bind(str(folder / "socket"))
    for device in ("zero", "null", "random", "tty"):
        (folder / device).symlink_to(f"/dev/{device}")
    (folder / "memory").symlink_to("/proc/self/mem")
    (folder / "below").symlink_to("empty/below")
    (folder / ("n" * 255)).symlink_to("nowhere")
    return sorted(folder.iterdir())
