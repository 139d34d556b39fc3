"""Where the tracked point of a log lies: a turning ship pivots ahead of midship, and by how much is nearly alike.

Positions of an antenna, and speeds of the same receiver, agree with each other wherever it stands, and the equations
of sway and yaw of a hull, dv/dt and dr/dt linear in v, r and the rudder, have the same form about every point of it: no
fit of a track tells how far ahead of midship its antenna was.  What tells is where the hull has no sway, v = -pivot r:
of ships that are steered by a rudder, turning at speed, that point lies within narrow bounds (`PIVOTS`).  Outside of
them it is not the ship that is another, but the point that was tracked.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from ...core.ranks import quantile
from ...core.values import dataclass
from .. import Array, Trial
from ..prepare import Remedy
from .relations import has, length_of
from .sensors import Fault
from .symmetry import Least, with_rate

PIVOTS = 0.2, 0.65
"""Pivot ahead of midship, in lengths, of ships with a rudder: measured .37 to .48 (three hulls), of the library .32 to
.41."""

# Controls that turn a ship without a rudder: where it pivots is up to them.
_OTHERWISE = ("alpha", "n_bow", "n_stern", "f_", "throttle", "thrust")
# Share of the highest speed from which on it makes way; heading it has to turn through [rad].
_UNDER_WAY, _TURNED = 0.4, math.radians(15.0)
# Share of the column of the turn that heading, current and a compass that is off must leave; standard errors.
_APART, _SURE = 0.05, 4.0
# Stretches that count as independent, in lengths sailed; at least so many.
_STRETCH, _FEWEST = 5.0, 6


@dataclass(frozen=True)
class Pivot:
    """The point of a turning ship that has no sway, ahead of the one that was tracked [m], and its standard error.

    Attributes:
        ahead, error: of that point [m].
        speed: of the ship meanwhile [m/s].
    """

    ahead: float
    error: float
    speed: float = 1.0

    def antenna(self, length: float) -> tuple[float, float] | None:
        """Least and most that the tracked point lies ahead of midship [m]; None where it may lie there.

        Args:
            length: of the ship [m].
        """
        low, high = (length * part for part in PIVOTS)
        sure = _SURE * self.error
        if low - sure <= self.ahead <= high + sure:
            return None
        return low - self.ahead, high - self.ahead


def pivot(trials: Sequence[Trial], length: float) -> Pivot | None:
    """Pivot of a ship that its rudder turns, by least squares over all trials; None where the logs do not tell it.

    v_m = -pivot r, beside a current of each trial and a heading that is off by an angle.

    Args:
        trials: of one ship, speeds over ground.
        length: of the ship [m].
    """
    turned, left, stretches = [], [], []
    for trial in map(with_rate, trials):
        if not has(trial, "u", "v_m", "psi", "r") or not _steered(trial):
            continue
        u, v, psi, r = (trial[name] for name in ("u", "v_m", "psi", "r"))
        good = np.isfinite(u) & np.isfinite(v) & np.isfinite(psi) & np.isfinite(r)
        good &= u > _UNDER_WAY * quantile(u[good], 0.98) if good.any() else good
        if good.sum() < 20 or np.ptp(np.unwrap(psi[good])) < _TURNED:
            continue
        sailed = np.cumsum(np.where(good, u, 0.0)) * trial.dt / (_STRETCH * length)
        turned.append(np.column_stack([-r, -u])[good])
        # its current explains first what it can: columns of all trials' currents would grow with their square
        water = np.linalg.qr(np.column_stack([-np.sin(psi), np.cos(psi)])[good])[0]
        both = np.column_stack([turned[-1], v[good]])
        left.append(both - water @ (water.T @ both))
        stretches.append(1000 * len(left) + np.floor(sailed[good]))
    if not left:
        return None
    stretch = np.concatenate(stretches)
    if len(np.unique(stretch)) < _FEWEST:
        return None
    columns, rest = np.concatenate(turned), np.concatenate(left)
    whole: Array = np.linalg.norm(columns, axis=0)
    found = Least.of(rest[:, :2], rest[:, 2], stretch, whole)
    share = np.linalg.norm(rest[:, 0]) / max(whole[0], 1e-300)  # that the currents leave of the turn
    if min(found.apart(1), share**2) < _APART:
        return None
    x, covariance = found.first(1)
    return Pivot(float(x[0]), math.sqrt(float(covariance[0, 0])), -float(np.mean(columns[:, 1])))


def _steered(trial: Trial) -> bool:
    rudders = [name for name in trial.channels if name == "delta" or name.startswith("delta_")]
    return any(has(trial, name) for name in rudders) and not any(
        name.startswith(_OTHERWISE) and has(trial, name) for name in trial.channels
    )


def pivot_faults(trials: Sequence[Trial]) -> Iterator[Fault]:
    """Positions and speeds of one antenna far from midship; a doubt, as hulls differ."""
    length = length_of(trials[0]) if trials else None
    found = pivot(trials, length) if length else None
    place = found.antenna(length) if found and length else None
    if found is None or length is None or place is None:
        return
    yield Fault("warning", "x, y, u, v_m", *told(found, length, place), "quality", "lever_arm")


def told(found: Pivot, length: float, place: tuple[float, float]) -> tuple[str, str, Remedy]:
    """What is wrong, the numbers that show it, and what to do."""
    ahead = sum(place) / 2.0
    where = "ahead" if ahead > 0.0 else "abaft"
    return (
        f"positions and speeds seem to be those of an antenna some {abs(ahead):.2g} m {where} of midship",
        f"in turns the point without sway lies {found.ahead / length:.2f} +- {found.error / length:.1g} lengths ahead "
        f"of the tracked one; of ships with a rudder it lies {PIVOTS[0]:g} to {PIVOTS[1]:g} ahead of midship; a heading"
        f" that is {'late' if ahead > 0.0 else 'early'} by {abs(ahead) / found.speed:.2g} s would look alike",
        Remedy("import again with its place in the mapping, of tables antenna = [ahead, to starboard], of other logs "
               f"antenna = {{ forward = ... }}: {place[0]:.2g} to {place[1]:.2g} m ahead by this log"),
    )  # fmt: skip
