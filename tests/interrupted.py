"""Studies that tests interrupt: trials of a small tanker, a study of them, and the command line as a process."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from seatrial.data.trialfile import write_trial
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.sensors import Sensors
from seatrial.ships.files import load
from seatrial.simulate.run import approach, simulate

STUDY = """schema = "seatrial-study/1"
ship = "kvlcc2_l7"
[data]
root = "trials"
train = ["*"]
[free]
"hull.*" = { ratio = 0.5 }
[estimator]
"""
TRAJECTORY = """type = "shooting:Trajectory"
window = 20.0
every = 2
starts = 2
tolerance = 1e-10
"""
MOMENTARY = ("date", "seconds", "command", "real-time factor, one ship", "time per step", "seal")
"""Keys of a result that differ between two runs of the same work in two folders; a seal is over dates too."""
CLOCK = "times as fast as the clock"
"""What a text says that has a measured time in it."""


def write_trials(folder: Path, duration: float, turns: Sequence[float], zigzags: Sequence[float]) -> None:
    """Noisy turning circles and zigzags [deg] as trial files t0, t1, ... in a folder."""
    ship, rng = load("kvlcc2_l7"), np.random.default_rng(5)
    n_P, noise = approach(ship)[1], Sensors(noise={"u": 0.01, "v_m": 0.01, "r": 0.002, "psi": 0.005})
    policies = [Turning(n_P, math.radians(a)) for a in turns]
    policies += [Zigzag(n_P, math.radians(a), math.radians(a)) for a in zigzags]
    folder.mkdir()
    for k, policy in enumerate(policies):
        run = noise.read(simulate(ship, policy, duration=duration, dt=0.1, name=f"t{k}"), rng)
        write_trial(run, folder / f"t{k}.csv")


def seatrial(*arguments: str | Path) -> subprocess.Popen[str]:
    """The command line in a process of its own."""
    command = [sys.executable, "-m", "seatrial", *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=os.environ, text=True)


def lasting(out: Path) -> dict[str, object]:
    """What must be alike in two runs of the same work: numbers, models and weights, without dates and durations."""
    found: dict[str, object] = {}
    for path in sorted(p for p in out.rglob("*") if p.is_file()):
        name = path.relative_to(out).as_posix()
        if path.suffix == ".json":
            found[name] = _timeless(json.loads(path.read_text()))
        elif path.suffix == ".toml":
            found[name] = [line for line in path.read_text().splitlines() if not line.startswith("date = ")]
        elif path.suffix == ".npz":
            with np.load(path) as arrays:
                found[name] = {key: _bytes(arrays[key]) for key in sorted(arrays)}
        elif path.suffix in (".csv", ".yaml", ".parquet") and path.name != "history.csv":
            found[name] = path.read_bytes()
        elif path.name != "history.csv":  # its rows end with the seconds
            found[name] = path.suffix
    return found


def _bytes(array: np.ndarray) -> object:
    """A document in an archive carries the seconds that the run took, as a JSON file does."""
    text = str(array) if array.dtype.kind == "U" and array.ndim == 0 else ""
    return _timeless(json.loads(text)) if text.startswith("{") else array.tobytes()


def _timeless(value: object) -> object:
    if isinstance(value, dict):
        return {k: _timeless([row[:-1] for row in v] if k == "history" else v)
                for k, v in value.items() if k not in MOMENTARY}  # fmt: skip
    if isinstance(value, list):
        return [_timeless(one) for one in value]
    return CLOCK if isinstance(value, str) and CLOCK in value else value
