"""Eleven numbers of a craft with two fixed thrusters, by least squares of tracks and headings of ten seconds.

The nine of `nine_numbers`, where the search starts, and what turns and unequal sides add: the sum of the thrusts in
yaw, and v r in surge.  Residuals are those of places (1 m) and headings (.2 rad) of windows that start in the
velocities as read.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
from common import Table, even, inputs, read, rolled, write
from nine_numbers import fitted, terms
from scipy.optimize import least_squares

_STEPS, _SECONDS, _EVERY, _MOST = 200, 10.0, 2.5, 10.0
_SIZE = np.array([1.0, 1.0, 0.2])


def change(velocity: np.ndarray, throttles: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    """Accelerations, shape (lanes, 3); `numbers` has a column for each lane, or one for all, shape (11, lanes)."""
    surge, sway, yaw = terms(velocity, throttles)
    surge = np.column_stack([surge, velocity[:, 1] * velocity[:, 2]])
    yaw = np.column_stack([yaw, (throttles * np.abs(throttles)).sum(axis=1)])
    own = numbers[:4], numbers[4:6], numbers[6:]
    return np.column_stack([(a * b.T).sum(axis=1) for a, b in zip((surge, sway, yaw), own, strict=True)])


def track(velocity: np.ndarray, throttles: np.ndarray, psi: np.ndarray, numbers: np.ndarray, dt: float) -> np.ndarray:
    """Places from the start and headings after each step, shape (steps, lanes, 3)."""
    now, place, out = velocity, np.column_stack([0.0 * psi, 0.0 * psi, psi]), []
    for acting in throttles:
        new = np.clip(now + dt * change(now, acting, numbers), -_MOST, _MOST)
        mean = 0.5 * (now + new)
        at = place[:, 2] + 0.5 * dt * mean[:, 2]
        north = mean[:, 0] * np.cos(at) - mean[:, 1] * np.sin(at)
        place = place + dt * np.column_stack([north, mean[:, 0] * np.sin(at) + mean[:, 1] * np.cos(at), mean[:, 2]])
        now = new
        out.append(place)
    return np.array(out)


def learnt(train: list[tuple[np.ndarray, Table, np.ndarray]], places: list[np.ndarray], dt: float) -> np.ndarray:
    """The numbers, shape (11,)."""
    first = fitted([(one[0], inputs(*one)) for one in train], dt)
    start = np.concatenate([first[0], [0.0], first[1], first[2], [0.0]])
    rows, apart = round(_SECONDS / dt), round(_EVERY / dt)
    cut = [(k, a) for k, one in enumerate(train) for a in range(0, len(one[0]) - rows - 1, apart)]
    velocity, psi = (np.array([train[k][c][a] for k, a in cut]) for c in (0, 2))
    acting = np.array([inputs(*train[k])[a : a + rows] for k, a in cut]).transpose(1, 0, 2)
    whole = [np.column_stack([place, one[2]]) for place, one in zip(places, train, strict=True)]
    true = np.array([whole[k][a + 1 : a + rows + 1] for k, a in cut]).transpose(1, 0, 2)
    begun = np.array([[*places[k][a], 0.0] for k, a in cut])

    def residuals(numbers: np.ndarray) -> np.ndarray:
        off = track(velocity, acting, psi, numbers[:, None], dt) + begun - true
        return np.ravel(off[4::5] / _SIZE)

    def slopes(numbers: np.ndarray) -> np.ndarray:
        step = 1e-4 * np.maximum(np.abs(numbers), 0.1)
        some = numbers[:, None] + np.diag(step)
        lanes = np.repeat(some, len(psi), axis=1)
        many = track(np.tile(velocity, (11, 1)), np.tile(acting, (1, 11, 1)), np.tile(psi, 11), lanes, dt)[4::5]
        off = many.reshape(len(many), 11, len(psi), 3) + (begun - true[4::5])[:, None]
        rest = (off / _SIZE).transpose(1, 0, 2, 3).reshape(11, -1)
        return ((rest - residuals(numbers)) / step[:, None]).T

    return least_squares(residuals, start, jac=slopes, loss="soft_l1", max_nfev=40).x


def main() -> None:
    """Read the folder that the command line names, fit, and write all answers."""
    home = Path(sys.argv[1])
    said = json.loads((home / "task.json").read_text())
    dt, given = said["horizons"][-1] / _STEPS, said["given"]
    tables = [read(path) for path in sorted((home / "train").glob("*.csv"))]
    train = [even(one, dt, given) for one in tables]
    if any(inputs(*one).shape[1] != 2 for one in train):
        sys.exit("eleven numbers are of a craft with two throttles and no wind")
    places: list[np.ndarray] = []
    for table, one in zip(tables, train, strict=True):
        grid = table["t"][-1] - dt * np.arange(len(one[0]))[::-1]
        good = np.isfinite(table["x"]) & np.isfinite(table["y"])
        places.append(np.column_stack([np.interp(grid, table["t"][good], table[c][good]) for c in ("x", "y")]))
    numbers = learnt(train, places, dt)[:, None]

    def step(velocity: np.ndarray, acting: np.ndarray) -> np.ndarray:
        return velocity[:, -1] + dt * change(velocity[:, -1], acting[:, -1], numbers)

    files = sorted((home / "asked").glob("*.csv"))
    asked = [read(path) for path in files]
    most = 2.0 * np.abs(np.concatenate([one[0] for one in train])).max(axis=0)
    tracks = rolled(step, asked, dt, given, 1, np.ones(5), most, said["horizons"][-1])
    for path, one, found in zip(files, asked, tracks, strict=True):
        write(home / "predicted" / path.name, one["t"][one["t"] > 0.0], found)


if __name__ == "__main__":
    main()
