"""What the methods of others share: a folder of the yardstick to even arrays, and velocities to tracks.  NumPy only.

Each method predicts the velocities u, v_m, r one step ahead from some past steps of velocities and inputs, all over
their standard deviations; tracks follow by kinematics.  Inputs: squares of revolutions with their sign, along and
across where a thrust turns, rudder angles, throttles, and the apparent wind, which each step makes of the predicted
motion.  Velocities are kept within twice those of the training trials, so that no method blows up.
"""

from __future__ import annotations

import csv
import json
import re
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

Step = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Velocities a step ahead, shape (lanes, 3), from those of past steps (lanes, lags, 3) and inputs (lanes, lags, m)."""

Table = dict[str, np.ndarray]
_STEPS = 200  # of the longest horizon
_SLOPE = 1.0  # s to either side, over which a slope is taken where no velocity was logged


@dataclass(frozen=True)
class Series:
    """A training trial on even steps: velocities and inputs over their standard deviations, shapes (rows, 3 and m)."""

    velocity: np.ndarray
    inputs: np.ndarray


def main(fit: Callable[[list[Series]], Step], lags: int = 1) -> None:
    """Read the folder that the command line names, fit, and write all answers."""
    home = Path(sys.argv[1])
    said = json.loads((home / "task.json").read_text())
    dt = said["horizons"][-1] / _STEPS
    given = said["given"]
    train = [even(read(path), dt, given) for path in sorted((home / "train").glob("*.csv"))]
    files = sorted((home / "asked").glob("*.csv"))
    asked = [read(path) for path in files]
    whole = np.concatenate([np.column_stack([one[0], inputs(*one)]) for one in train])
    scale, size = whole.std(axis=0), np.sqrt((whole**2).mean(axis=0))
    scale = np.where(scale > 0.01 * size, scale, np.where(size > 0.0, size, 1.0))  # one that never moved: its size
    series = [Series(one[0] / scale[:3], inputs(*one) / scale[3:]) for one in train]
    step = fit(series)
    most = 2.0 * np.abs(np.concatenate([one[0] for one in train])).max(axis=0)
    tracks = rolled(step, asked, dt, given, lags, scale, most, said["horizons"][-1])
    for path, one, track in zip(files, asked, tracks, strict=True):
        write(home / "predicted" / path.name, one["t"][one["t"] > 0.0], track)


def read(path: Path) -> Table:
    with path.open() as file:
        head, *rows = csv.reader(file)
    values = np.array([[float(cell) if cell else np.nan for cell in row] for row in rows])
    return {name.split(" ")[0]: values[:, k] for k, name in enumerate(head)}


def even(table: Table, dt: float, given: list[str], until: float | None = None) -> tuple[np.ndarray, Table, np.ndarray]:
    """Velocities, controls and wind (all given channels) and headings on even steps that end at `until`."""
    t = table["t"]
    end = t[-1] if until is None else until
    grid = end - dt * np.arange(int((end - t[0]) / dt + 1e-6) + 1)[::-1]
    x, y = (_line(t, table[name], grid) for name in ("x", "y"))
    psi = _line(t, np.unwrap(_bridged(t, table["psi"])), grid)
    if all(n in table and np.isfinite(table[n]).sum() > 2 for n in ("u", "v_m", "r")):
        velocity = np.column_stack([_line(t, table[n], grid) for n in ("u", "v_m", "r")])
    else:
        north, east, r = (_slope(grid, values) for values in (x, y, psi))
        cos, sin = np.cos(psi), np.sin(psi)
        velocity = np.column_stack([north * cos + east * sin, east * cos - north * sin, r])
    return velocity, _known(table, given, grid), psi


def _known(table: Table, given: list[str], grid: np.ndarray) -> Table:
    patterns = [re.compile(one.replace("*", ".*") + "$") for one in given]
    out: Table = {}
    for name, values in table.items():
        if any(p.match(name) for p in patterns):
            angle = name.startswith(("gamma", "alpha"))
            out[name] = _line(table["t"], np.unwrap(_bridged(table["t"], values)) if angle else values, grid)
    return out


def inputs(velocity: np.ndarray, known: Table, psi: np.ndarray) -> np.ndarray:
    """Inputs of a model from velocities (rows, 3), given channels and headings, shape (rows, m)."""
    out: list[np.ndarray] = []
    for name, values in known.items():
        kind, _, number = name.partition("_")
        if kind == "n":
            thrust, turn = values * np.abs(values), known.get(f"alpha_{number}")
            out += [thrust] if turn is None else [thrust * np.cos(turn), thrust * np.sin(turn)]
        elif kind in ("delta", "throttle"):
            out.append(values)
    if "U_T" in known:
        out += [known["U_T"] * np.cos(known["gamma_T"] - psi) + velocity[:, 0],
                known["U_T"] * np.sin(known["gamma_T"] - psi) + velocity[:, 1]]
    return np.column_stack(out)


def rolled(
    step: Step, asked: list[Table], dt: float, given: list[str], lags: int, scale: np.ndarray, most: np.ndarray,
    longest: float,
) -> list[np.ndarray]:
    """Predicted x, y, psi, u, v_m, r of each question at its rows after the start, each shape (rows, 6)."""
    past, lanes, start = [], [], []
    ahead = int(np.ceil(longest / dt - 1e-6))
    for one in asked:
        before = {name: values[one["t"] <= 1e-9] for name, values in one.items()}
        velocity, known, psi = even(before, dt, given, until=0.0)
        past.append((velocity[-lags:], inputs(velocity, known, psi)[-lags:]))
        lanes.append(_known(one, given, dt * np.arange(ahead + 1)))
        start.append([before["x"][-1], before["y"][-1], psi[-1]])
    velocity, acting = (np.array([one[k] for one in past]) for k in (0, 1))
    place = np.array(start)
    track = [np.column_stack([place, velocity[:, -1]])]
    known = [{name: np.array([lane[name][k] for lane in lanes]) for name in lanes[0]} for k in range(ahead + 1)]
    for k in range(ahead):
        new = step(velocity / scale[:3], acting / scale[3:]) * scale[:3]
        new = np.clip(np.nan_to_num(new), -most, most)
        mean = 0.5 * (velocity[:, -1] + new)
        psi = place[:, 2] + 0.5 * dt * mean[:, 2]
        place = place + dt * np.column_stack([mean[:, 0] * np.cos(psi) - mean[:, 1] * np.sin(psi),
                                              mean[:, 0] * np.sin(psi) + mean[:, 1] * np.cos(psi), mean[:, 2]])
        track.append(np.column_stack([place, new]))
        now = inputs(new, known[k + 1], place[:, 2])
        velocity = np.concatenate([velocity[:, 1:], new[:, None]], axis=1)
        acting = np.concatenate([acting[:, 1:], now[:, None]], axis=1)
    whole, grid = np.array(track), dt * np.arange(ahead + 1)
    return [np.column_stack([np.interp(one["t"][one["t"] > 0.0], grid, whole[:, lane, c]) for c in range(6)])
            for lane, one in enumerate(asked)]


def pairs(series: list[Series], lags: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Past velocities, past inputs and next velocities of all steps, shapes (n, lags, 3), (n, lags, m), (n, 3)."""
    before, acting, after = [], [], []
    for one in series:
        for row in range(lags, len(one.velocity)):
            before.append(one.velocity[row - lags : row])
            acting.append(one.inputs[row - lags : row])
            after.append(one.velocity[row])
    found = np.array(before), np.array(acting), np.array(after)
    good = np.all([np.isfinite(one.reshape(len(one), -1)).all(axis=1) for one in found], axis=0)
    return found[0][good], found[1][good], found[2][good]


def write(path: Path, t: np.ndarray, track: np.ndarray) -> None:
    rows = [",".join(map(repr, map(float, (at, *row)))) for at, row in zip(t, track, strict=True)]
    path.write_text("\n".join(["t [s],x [m],y [m],psi [rad],u [m/s],v_m [m/s],r [rad/s]", *rows]) + "\n")


def _bridged(t: np.ndarray, values: np.ndarray) -> np.ndarray:
    good = np.isfinite(values)
    return np.interp(t, t[good], values[good])


def _line(t: np.ndarray, values: np.ndarray, grid: np.ndarray) -> np.ndarray:
    good = np.isfinite(values)
    return np.interp(grid, t[good], values[good])


def _slope(t: np.ndarray, values: np.ndarray) -> np.ndarray:
    reach = max(round(_SLOPE / (t[1] - t[0])), 1)
    out = np.empty(t.size)
    for k in range(t.size):
        rows = slice(max(k - reach, 0), k + reach + 1)
        out[k] = np.polyfit(t[rows] - t[k], values[rows], 1)[0]
    return out
