"""Nine numbers of a craft with two fixed thrusters, by least squares of accelerations over a second.  NumPy only.

Surge: the sum of the thrusts, u, u |u|.  Sway: v, u r.  Yaw: the difference of the thrusts, r, r |r|, |u| r.  A thrust
is the square of a throttle with its sign.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
from common import even, inputs, read, rolled, write

SECOND = 1.0
_STEPS = 200


def terms(velocity: np.ndarray, throttles: np.ndarray) -> list[np.ndarray]:
    """Terms of surge, sway and yaw, each shape (rows, numbers)."""
    u, v, r = velocity.T
    port, starboard = (throttles * np.abs(throttles)).T
    own = [port + starboard, u, u * np.abs(u)], [v, u * r], [port - starboard, r, r * np.abs(r), np.abs(u) * r]
    return [np.column_stack(some) for some in own]


def fitted(series: list[tuple[np.ndarray, np.ndarray]], dt: float) -> list[np.ndarray]:
    """The numbers of surge, sway and yaw: changes over a second are the mean of the terms."""
    rows = max(round(SECOND / dt), 1)
    found = []
    for k in range(3):
        left, right = [], []
        for velocity, throttles in series:
            total = np.cumsum(dt * terms(velocity, throttles)[k], axis=0)
            left.append(total[rows:] - total[:-rows])
            right.append(velocity[rows:, k] - velocity[:-rows, k])
        found.append(np.linalg.lstsq(np.concatenate(left), np.concatenate(right), rcond=None)[0])
    return found


def main() -> None:
    """Read the folder that the command line names, fit, and write all answers."""
    home = Path(sys.argv[1])
    said = json.loads((home / "task.json").read_text())
    dt, given = said["horizons"][-1] / _STEPS, said["given"]
    train = [even(read(path), dt, given) for path in sorted((home / "train").glob("*.csv"))]
    series = [(one[0], inputs(*one)) for one in train]
    if any(acting.shape[1] != 2 for _, acting in series):
        sys.exit("nine numbers are of a craft with two throttles and no wind")
    numbers = fitted(series, dt)

    def step(velocity: np.ndarray, acting: np.ndarray) -> np.ndarray:
        now = velocity[:, -1]
        change = [a @ b for a, b in zip(terms(now, acting[:, -1]), numbers, strict=True)]
        return now + dt * np.column_stack(change)

    files = sorted((home / "asked").glob("*.csv"))
    asked = [read(path) for path in files]
    most = 2.0 * np.abs(np.concatenate([velocity for velocity, _ in series])).max(axis=0)
    tracks = rolled(step, asked, dt, given, 1, np.ones(5), most, said["horizons"][-1])
    for path, one, track in zip(files, asked, tracks, strict=True):
        write(home / "predicted" / path.name, one["t"][one["t"] > 0.0], track)


if __name__ == "__main__":
    main()
