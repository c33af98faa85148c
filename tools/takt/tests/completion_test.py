#!/usr/bin/env python3
"""What a shell writes when somebody types a part of a command and presses Tab.

usage: completion_test.py TAKT bash|zsh|fish
"""
# SPDX-License-Identifier: Apache-2.0
import os
import pathlib
import pty
import re
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time

from command import takt
from checks import check, environment, eventually, finish, skip

shell = sys.argv[2]
if shutil.which(shell) is None:
    skip(f"there is no {shell} (apt-get install {shell})")
COMPLETIONS = pathlib.Path(__file__).resolve().parents[1] / "completions"
LIMIT = 60
folder = pathlib.Path(tempfile.mkdtemp())
(folder / "robot.yaml").touch()
(folder / "rotten.txt").touch()
(folder / "rooms").mkdir()
START = {
    "bash": (["bash", "--noprofile", "--norc", "-i"], f"source '{COMPLETIONS}/takt.bash'"),
    "zsh": (["zsh", "-f", "-i"], f"fpath=('{COMPLETIONS}' $fpath); autoload -Uz compinit; compinit -u -D"),
    "fish": (["fish", "--no-config", "-i"], f"source '{COMPLETIONS}/takt.fish'"),
}


class Terminal:
    """A shell, as somebody sees it who types."""

    def __init__(self):
        words, start = START[shell]
        variables = environment | {"PATH": f"{pathlib.Path(takt).parent}:{os.environ['PATH']}", "TERM": "dumb",
                                   "HOME": str(folder), "XDG_CONFIG_HOME": str(folder), "PS1": "> "}
        self.process, self.terminal = pty.fork()
        if self.process == 0:
            os.chdir(folder)
            os.execvpe(words[0], words, variables)
        self.screen = ""
        self.type(start + "; echo is_''ready\n")
        check(f"{shell} starts", self.shows("is_ready"), self.screen)

    def type(self, keys):
        os.write(self.terminal, keys.encode())

    def shows(self, text):
        end = time.monotonic() + LIMIT
        while text not in self.screen and time.monotonic() < end:
            if select.select([self.terminal], [], [], 0.1)[0]:
                self.screen += re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]|\x1b[=>]", "", os.read(self.terminal, 4096).decode("utf-8", "replace"))
        return text in self.screen

    def tab(self, typed, expected):
        self.screen = ""
        self.type(typed + "\t\t")
        check(f"{shell}: {typed!r} and Tab show {expected}", self.shows(expected), self.screen)
        self.type("\x15")  # the line is empty again

    def close(self):
        os.kill(self.process, signal.SIGKILL)
        os.waitpid(self.process, 0)


terminal = Terminal()
terminal.tab("takt compa", "compare ")
terminal.tab("takt component unlo", "unload ")
terminal.tab("takt run --exec", "--executor")
terminal.tab("takt run --executor chain_", "chain_aware")
terminal.tab("takt run --executor=chain_", "chain_aware")
terminal.tab("takt compare --schedulers fifo,least_", "fifo,least_laxity")
terminal.tab("takt run --composition per", "per-node")
terminal.tab("takt component load robot takt::Lifec", "takt::LifecycleWorkload")
terminal.tab("takt list wait", "wait_backends")
terminal.tab("takt check ro", "robot.yaml")
container = subprocess.Popen([takt, "run", "--name", "kitchen_robot"], env=environment, stdout=subprocess.DEVNULL,
                             stderr=subprocess.DEVNULL)


def is_found():
    return "kitchen_robot" in subprocess.run([takt, "complete", "takt", "component", "list", "kit"], env=environment,
                                             text=True, capture_output=True).stdout


check("the container runs", eventually(is_found))
terminal.tab("takt component list kit", "kitchen_robot")
terminal.tab("takt graph kit", "kitchen_robot")
terminal.tab("takt graph ro", "robot.yaml")
container.terminate()
container.wait(LIMIT)
terminal.close()
said = subprocess.run([takt, "complete", "takt", "check", ""], text=True, capture_output=True).stdout
check("of files, the shell shows those of systems", said == ":files yaml yml json\n", said)
shutil.rmtree(folder)
finish()
