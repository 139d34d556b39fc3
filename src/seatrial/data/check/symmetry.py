"""A heading that is off by the drift it lends a ship: a hull that is alike on both sides has none of its own.

Where u and v_m are a velocity over ground, turned by the heading, an error of the heading shows in no displacement:
track and speeds agree.  It makes the ship go sideways though, by a part of its speed, on every course and with the
rudder to either side.  What the hull does in a turn changes sign with yaw rate and rudder, and what a current does
turns with the heading; by least squares over all rows the three are told apart, if there are turns to both sides.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from .. import Array, Trial
from ..prepare import Remedy
from .relations import has
from .repairs import step
from .sensors import Fault

_DEG = math.pi / 180.0
# A drift is told from this size on, as propellers and trim make one of some tenths of a degree, and so many errors.
_LEAST, _SURE = 1.5 * _DEG, 8.0
# Rows, and the time that counts as one independent sample of what the regression leaves [s]; stretches at least.
_ROWS, _ALIKE, _STRETCHES = 100, 60.0, 6
# Share of the column of the drift that the others must leave, for it to be told apart from them.
_APART = 0.02


@dataclass(frozen=True)
class Sideways:
    """How far the velocity over ground lies to port of the heading of a ship that goes straight [rad].

    Attributes:
        angle: so far the heading, or the sensor of the speeds, is turned clockwise.
        error: standard error, stretches of a minute being independent.
    """

    angle: float
    error: float

    @property
    def told(self) -> bool:
        """Whether neither chance nor what is not alike on both sides of a ship explains it."""
        return abs(self.angle) > max(_LEAST, _SURE * self.error)


def sideways(trials: Sequence[Trial]) -> Sideways | None:
    """The drift that no turn, no rudder and no current explains; None where the logs do not tell them apart."""
    parts = [part for trial in trials if (part := _rows(trial)) is not None]
    if not parts or sum(len(y) for _, y, _ in parts) < _ROWS:
        return None
    columns, y = np.concatenate([one[0] for one in parts]), np.concatenate([one[1] for one in parts])
    stretch = np.concatenate([1000 * k + one[2] for k, one in enumerate(parts)])
    length = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    A = columns / length
    back = np.linalg.pinv(A, rcond=1e-6)
    # What the other columns leave of the first one, whose length is 1.
    if not (left := float((back[0] ** 2).sum())) or 1.0 / left < _APART:
        return None
    x = back @ y
    e, kinds = y - A @ x, np.unique(stretch)
    if len(kinds) < _STRETCHES:
        return None
    scores = np.array([back[0, stretch == k] @ e[stretch == k] for k in kinds])
    return Sideways(float(x[0] / length[0]), math.sqrt(float((scores**2).sum())) / float(length[0]))


def _rows(trial: Trial) -> tuple[Array, Array, Array] | None:
    """Columns that may explain v_m, v_m, and the stretch of each row; the first column is that of the drift."""
    rudders = [name for name in trial.channels if name == "delta" or name.startswith("delta_")]
    if not has(trial, "u", "v_m", "psi", "r") or not any(has(trial, name) for name in rudders):
        return None
    u, v, psi, r = (trial[name] for name in ("u", "v_m", "psi", "r"))
    d = np.mean([trial[name] for name in rudders], axis=0)
    odd = (r, r * np.abs(r), r**3, u * r, u * u * r, r * np.abs(d), u * d, u * d * np.abs(d), d * np.abs(r),
           np.gradient(r, trial.t))  # fmt: skip
    A = np.column_stack([-u, -np.sin(psi), np.cos(psi), *odd])
    good = np.isfinite(A).all(axis=1) & np.isfinite(v)
    return A[good], v[good], np.floor((trial.t[good] - trial.t[0]) / _ALIKE)


def symmetry_faults(trials: Sequence[Trial]) -> Iterator[Fault]:
    """A heading that lends the ship a drift."""
    found = sideways(trials)
    if found is None or not found.told:
        return
    degrees = found.angle / _DEG
    turned = step("rotate", "u", "v_m", amount=(-degrees,)).steps
    yield Fault(
        "warning", "psi", f"heading bias of {degrees:+.2f} deg, by which u and v_m were turned too",
        f"going straight the ship would drift {abs(degrees):.2f} +- {found.error / _DEG:.2g} deg to "
        f"{'port' if degrees > 0 else 'starboard'} on every course",
        Remedy(steps=(*step("add", "psi", amount=(-degrees,), unit="deg").steps, *turned)), "quality", "heading_bias",
    )  # fmt: skip
