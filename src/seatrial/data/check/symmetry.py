"""A heading that is off by the drift it lends a ship: a hull that is alike on both sides has none of its own.

Where u and v_m are a velocity over ground, turned by the heading, an error of the heading shows in no displacement:
track and speeds agree.  It makes the ship go sideways though, by a part of its speed, on every course and with the
rudder to either side.  What the hull does in a turn changes sign with yaw rate and rudder, and what a current does
turns with the heading; by least squares over all rows the three are told apart, if there are turns to both sides.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from ...core.values import dataclass
from .. import Array, Trial, unwrapped
from ..prepare import Remedy
from .relations import has
from .repairs import step
from .sensors import Fault

_DEG = math.pi / 180.0
# A drift is told from this size on, as propellers and trim make one of some tenths of a degree, and so many errors.
_LEAST, _SURE = 1.5 * _DEG, 8.0
# Rows, and the time that counts as one independent sample of what the regression leaves [s]; stretches at least.
_ROWS, _ALIKE, _STRETCHES = 100, 60.0, 6
# Share of the column of the drift that the others must leave, for it to be told apart from them; and of the two of a
# deviation: of ships with right compasses whose trials all begin on one course they left .009 at most and took 7 deg
# of the sway of hard turns for one.
_APART, _TELLS = 0.02, 0.01
# Where a log cannot tell it from a current: from this size on, by so many stretches of so long.
_EITHER, _BRIEF, _FEW = 6.0 * _DEG, 20.0, 8
# The slower of the turns to both sides, as a part of the other.
_BOTH = 0.2
# A deviation is told from this amplitude on [rad].
_SWUNG = 2.0 * _DEG
# Share of the highest speed, and the quantile that is that, from which on a course is one.
_UNDER_WAY, _FASTEST = 0.4, 0.98
# Least over greatest eigenvalue of the squares of the columns by which ten digits of the factors are right.
_SOUND = 1e-6
# Columns that are asked for by themselves: the drift, or both of a deviation.
_FIRST = 2


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


@dataclass(frozen=True)
class Swung:
    """Deviation of a compass of one cycle, by the sway that it lends a ship under way: north cos(psi) + east sin(psi).

    Attributes:
        north, east: what the heading is too large by on these courses [rad].
        deviates: their size in standard errors, stretches of a minute being independent.
    """

    north: float
    east: float
    deviates: float

    @property
    def size(self) -> float:
        """Amplitude [rad]."""
        return math.hypot(self.north, self.east)

    @property
    def told(self) -> bool:
        """Whether neither chance nor a correction that nobody would make explains it."""
        return self.size > _SWUNG and self.deviates > _SURE


def sideways(trials: Sequence[Trial]) -> Sideways | None:
    """The drift that no turn, no rudder and no current explains; None where the logs do not tell them apart."""
    found = _told(trials, rudder=True)
    if found is None or found.apart(1) < _APART:
        return None
    x, covariance = found.first(1)
    return Sideways(float(x[0]), math.sqrt(float(covariance[0, 0])))


def _astray(trials: Sequence[Trial]) -> Sideways | None:
    """The drift that no turn and no rudder explains, be it by the heading or by a current; None without both turns."""
    rates = np.concatenate([known["r"] for trial in trials if has(known := with_rate(trial), "r")] or [np.zeros(1)])
    low, high = np.nanquantile(rates, (0.02, 0.98))
    if min(high, -low) < _BOTH * max(high, -low) or high <= low:
        return None
    found = _told(trials, rudder=True, still=True)
    if found is None or found.apart(1) < _APART:
        return None
    x, covariance = found.first(1)
    out = Sideways(float(x[0]), math.sqrt(float(covariance[0, 0])))
    return out if out.told and abs(out.angle) > _EITHER else None


def swung(trials: Sequence[Trial]) -> Swung | None:
    """The deviation that no turn, rudder, drift or current explains; None where the logs do not tell them apart.

    It is a function of the heading alone, at any yaw rate, and changes the sway by a part of the speed, which a current
    does not: the courses have to differ among turns of one side, and speeds on one course.
    """
    found = _told(trials, deviates=True)
    if found is None or found.apart(2) < _TELLS:
        return None
    x, covariance = found.first(2)
    return Swung(float(x[0]), float(x[1]), math.sqrt(max(float(x @ np.linalg.pinv(covariance) @ x), 0.0)))


@dataclass(frozen=True)
class Least:
    """Least squares over the rows of all trials.

    Attributes:
        back: pseudoinverse of the columns, each of length 1, of the first `_FIRST` of them, shape (first, rows).
        length: of each column, shape (columns,).
        x: factors of the columns of length 1, shape (columns,).
        e: what they leave, shape (rows,).
        stretch: of each row, shape (rows,).
    """

    back: Array
    length: Array
    x: Array
    e: Array
    stretch: Array

    @classmethod
    def of(cls, columns: Array, y: Array, stretch: Array, length: Array | None = None) -> Least:
        """The factors of the columns, shape (rows, columns), that leave least of y.

        Args:
            length: of the columns before others, which are not among them, explained what they could of these and y.
        """
        length = np.maximum(np.linalg.norm(columns, axis=0) if length is None else length, 1e-300)
        A = columns / length
        back, x = _solved(A, y)
        return cls(back, length, x, y - A @ x, stretch)

    def apart(self, count: int) -> float:
        """Share that the other columns leave of the combination of the first ones that they explain best."""
        most = float(np.linalg.eigvalsh(self.back[:count] @ self.back[:count].T)[-1])
        return 1.0 / most if most > 0.0 else 0.0

    def first(self, count: int) -> tuple[Array, Array]:
        """Factors of the first columns, and their covariance by the scatter of the stretches."""
        kinds, length = np.unique(self.stretch), self.length[:count]
        order = np.argsort(self.stretch, kind="stable")
        ends = np.searchsorted(self.stretch[order], kinds, "right").tolist()
        scores = np.array([self.back[:count, rows] @ self.e[rows] for rows in np.split(order, ends[:-1])])
        return self.x[:count] / length, scores.T @ scores / np.outer(length, length)


def _solved(A: Array, y: Array) -> tuple[Array, Array]:
    """Pseudoinverse of columns of length 1, as of `Least.back`, and the factors that leave least of y."""
    values, vectors = np.linalg.eigh(A.T @ A)
    if values[0] > _SOUND * values[-1]:  # by the squares, as the columns of a day of trials take half a second
        inverse: Array = ((vectors / values) @ vectors.T).astype(np.float64)
        x = inverse @ (A.T @ y)
        return inverse[:_FIRST] @ A.T, x + inverse @ (A.T @ (y - A @ x))
    back: Array = np.linalg.pinv(A, rcond=1e-6).astype(np.float64)
    return back[:_FIRST], back @ y


def _told(
    trials: Sequence[Trial], *, rudder: bool = False, deviates: bool = False, still: bool = False
) -> Least | None:  # fmt: skip
    """What explains the sway of all trials, columns as in `_rows`; None where there is little of it.

    Args:
        trials: of one ship.
        rudder, deviates: see `_rows`.
        still: whether the water is taken to stand still, by which short logs are enough.
    """
    known = [with_rate(trial) for trial in trials] if still else trials
    some = [part for trial in known if (part := _rows(trial, rudder=rudder, deviates=deviates)) is not None]
    parts = [(np.delete(A, (1, 2), axis=1), y, np.floor(t / _BRIEF)) if still else (A, y, np.floor(t / _ALIKE))
             for A, y, t in some]  # fmt: skip
    if not parts or sum(len(y) for _, y, _ in parts) < _ROWS:
        return None
    columns, y = np.concatenate([one[0] for one in parts]), np.concatenate([one[1] for one in parts])
    stretch = np.concatenate([1000 * k + one[2] for k, one in enumerate(parts)])
    if len(np.unique(stretch)) < (_FEW if still else _STRETCHES):
        return None
    return Least.of(columns, y, stretch)


def with_rate(trial: Trial) -> Trial:
    """The trial with a rate of turn, by its heading where it has no other."""
    if has(trial, "r") or not has(trial, "psi"):
        return trial
    psi = unwrapped(trial["psi"])
    good = np.isfinite(psi)
    return trial.having(r=np.gradient(np.interp(trial.t, trial.t[good], psi[good]), trial.t))


def _rows(trial: Trial, *, rudder: bool, deviates: bool) -> tuple[Array, Array, Array] | None:
    """Columns that may explain v_m, v_m, and the time of each row; the first column is that of the drift.

    Args:
        rudder: whether a trial needs one.
        deviates: whether the columns of a deviation stand before it, of the rows that make way: astern the course is
            that of the stern, and u keeps its sign.
    """
    rudders = [name for name in trial.channels if name == "delta" or name.startswith("delta_")]
    rudders = [name for name in rudders if has(trial, name)]
    if not has(trial, "u", "v_m", "psi", "r") or (rudder and not rudders):
        return None
    u, v, psi, r = (trial[name] for name in ("u", "v_m", "psi", "r"))
    d = np.mean([trial[name] for name in rudders], axis=0) if rudders else np.zeros_like(r)
    odd = (r, r * np.abs(r), r**3, u * r, u * u * r, r * np.abs(d), u * d, u * d * np.abs(d), d * np.abs(r),
           np.gradient(r, trial.t))  # fmt: skip
    swings = [-u * np.cos(psi), -u * np.sin(psi)] if deviates else []
    A = np.column_stack([*swings, -u, -np.sin(psi), np.cos(psi), *odd])
    good = np.isfinite(A).all(axis=1) & np.isfinite(v)
    if deviates and good.any():
        good &= np.abs(u) > _UNDER_WAY * np.quantile(np.abs(u[good]), _FASTEST)
    return A[good], v[good], trial.t[good] - trial.t[0]


def symmetry_faults(trials: Sequence[Trial], drifts: bool = False) -> Iterator[Fault]:
    """A heading that lends the ship a drift; `drifts` where a current is told already, which may explain it."""
    found = sideways(trials)
    if found is None and not drifts:
        yield from _either(trials)
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


def _either(trials: Sequence[Trial]) -> Iterator[Fault]:
    """A drift to one side that may be that of the heading or of a current, as the courses are too much alike."""
    found = _astray(trials)
    if found is None:
        return
    degrees = abs(found.angle) / _DEG
    side = "port" if found.angle > 0 else "starboard"
    yield Fault(
        "warning", "psi", f"the ship goes {degrees:.0f} deg to {side} of its heading, whichever way it turns",
        f"{degrees:.1f} +- {found.error / _DEG:.2g} deg going straight; its courses are too much alike to tell a "
        "heading that is off (magnetic perhaps) from a current or a wind",
        f"if the heading is magnetic or the compass off, add {-found.angle / _DEG:.3g} deg to psi (and turn u and v_m "
        "where they were made with it); else name the current", "quality", "heading_bias",
    )  # fmt: skip
