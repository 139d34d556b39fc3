"""A campaign that is run by the command line in a process of its own, to be killed."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

CAMPAIGN = """
schema = "seatrial-campaign/1"
ships = ["kvlcc2_l7"]
runs = {runs}
chunk = {chunk}
[manoeuvre]
kind = "zigzag"
rudder = 20.0
heading = 10.0
duration = {duration}
dt = 0.25
method = "euler"
[inputs]
"ship.hull.N_r" = {{ normal = [1.0, 0.1], factor = true }}
"ship.hull.Y_v" = {{ uniform = [0.9, 1.1], factor = true }}
"policy.delta" = {{ uniform = [18, 22], unit = "deg" }}
"""


def started(file: Path, folder: Path, *options: str) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "seatrial", "campaign", str(file), "-o", str(folder), "--json", *options]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)


def finished(file: Path, folder: Path, *options: str) -> None:
    process = started(file, folder, *options)
    _, said = process.communicate()
    assert process.returncode == 0, said.decode()
