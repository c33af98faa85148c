"""Runs the command that a test looks at, which is the first word of the test's command line.

SPDX-License-Identifier: Apache-2.0
"""
import json
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "cmake"))
from checks import check, environment

takt = str(pathlib.Path(sys.argv[1]).resolve())


def run(*arguments, status=0):
    done = subprocess.run([takt, *arguments], env=environment, text=True, capture_output=True,
                          timeout=60)
    check(f"takt {' '.join(arguments)[:70]}: status {status}", done.returncode == status,
          done.returncode, done.stdout, done.stderr)
    return done


def as_json(*arguments, status=0):
    said = run(*arguments, "--json", "-", status=status).stdout
    return json.loads(said) if said else None


def seen(holds, *arguments):
    """The rows when they hold, or after ten looks: a busy machine discovers late."""
    for _ in range(10):
        rows = json.loads(subprocess.run([takt, *arguments, "--json", "-"], env=environment,
                                         text=True, capture_output=True).stdout or "[]")
        if holds(rows):
            break
    return rows
