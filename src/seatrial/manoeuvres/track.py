"""Track following by line of sight: steer for a point ahead on the leg, change legs before the corner.

The guidance law is the look-ahead form psi_d = alpha - atan(e / Delta) with the cross-track error e,
and with integral action psi_d = alpha - atan((e + sigma z) / Delta), z' = Delta e / (Delta^2 + (e +
sigma z)^2) (Borhaug 2008, Fossen 2011 section 10.3), which takes out the offset of a steady current.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import ClassVar, NamedTuple, Self

import numpy as np

from ..core.parameters import ParameterError, Scalar, Scalars, Spec, Terms, spec, terms
from ..core.symbolic import atan2, both, clip, cos, sin, where
from ..core.values import dataclass
from ..data import Trial
from . import Index, Manoeuvre, Settings
from .autopilot import usual_gains, wrapped
from .reading import in_lengths

# The default path and law, in ship lengths: each leg, look-ahead, wheel-over before a corner.
_LEG, _AHEAD, _TURN = 20.0, 2.5, 3.0


class Leg(NamedTuple):
    """A straight leg: where it begins [m], its direction [rad] and its length [m]."""

    x: Scalar
    y: Scalar
    alpha: Scalar
    length: Scalar

    def along_across(self, x: Scalar, y: Scalar) -> tuple[Scalar, Scalar]:
        """Distance gone along the leg, and to starboard of it [m]."""
        c, s = cos(self.alpha), sin(self.alpha)
        return c * (x - self.x) + s * (y - self.y), c * (y - self.y) - s * (x - self.x)


def legs(points: Sequence[tuple[Scalar, Scalar]]) -> tuple[Leg, ...]:
    """The legs between waypoints (x, y) [m]."""
    found: list[Leg] = []
    for (x, y), (x_end, y_end) in pairwise(points):
        north, east = x_end - x, y_end - y
        alpha = atan2(east, north)
        found.append(Leg(x, y, alpha, cos(alpha) * north + sin(alpha) * east))
    return tuple(found)


def los_heading(alpha: Scalar, across: Scalar, ahead: Scalar) -> Scalar:
    """Heading for a point `ahead` metres on along a line of direction `alpha`, from `across` beside it [rad]."""
    return alpha - atan2(across, ahead)


def _meaning(name: str) -> Spec:
    axis, _, number = name.partition("_")
    if axis not in ("x", "y") or not number.isdecimal() or int(number) < 1:
        raise ParameterError(f"no waypoint coordinate '{name}'; they are x_1, y_1, x_2, y_2, ...")
    return Spec("m", f"waypoint {number}, {'north' if axis == 'x' else 'east'}")


def waypoints(points: Sequence[tuple[float, float]]) -> Terms:
    """Waypoints (x, y) [m] as the numbers of a `TrackFollowing`; two of them or more.

    Raises:
        ParameterError: fewer than two, one that is not finite, or two in a row at the same place.
    """
    if len(points) < 2:
        raise ParameterError(f"a track has two waypoints or more, not {len(points)}")
    for k, (a, b) in enumerate(pairwise(points), 1):
        if not 0 < math.dist(a, b) < math.inf:
            raise ParameterError(f"waypoints {k} and {k + 1} are {math.dist(a, b):g} m apart; there is no leg between")
    names = tuple(f"{axis}_{k}" for k in range(1, len(points) + 1) for axis in ("x", "y"))
    return Terms(names, tuple(float(value) for point in points for value in point))


@dataclass(frozen=True)
class TrackFollowing(Manoeuvre):
    """Follow straight legs between waypoints, the first of which is passed already."""

    kind: ClassVar[str] = "track"
    takes: ClassVar[tuple[str, ...]] = ("rudder", "heading", "side")
    memory: ClassVar[tuple[str, ...]] = ("leg", "offset_integral", "t_last")

    n_P: Scalar = spec("1/s", "propeller revolutions, held")
    K_p: Scalar = spec("-", "rudder per heading error")
    K_d: Scalar = spec("s", "rudder against yaw rate")
    ahead: Scalar = spec("m", "look-ahead distance Delta", (1e-6, math.inf))
    radius: Scalar = spec("m", "distance from a waypoint at which the next leg is taken", (0.0, math.inf))
    sigma: Scalar = spec("m/s", "integral action on the cross-track error; 0 for none", (0.0, math.inf), default=0.0)
    delta_max: Scalar = spec("rad", "greatest rudder that is ordered", (0.0, math.pi), default=math.inf)
    path: Terms = terms(_meaning)

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.path.names) < 4 or len(self.path.names) % 2:
            raise ParameterError("path: a track has two waypoints or more, x_1, y_1, x_2, y_2, ...")

    @classmethod
    def ordered(cls, settings: Settings) -> Self:
        """North for 20 ship lengths, a corner of 90 deg to starboard by default, 20 lengths more."""
        L, corner = settings.L_pp, settings.side * settings.heading_or(math.radians(90.0))
        turn = _LEG * L
        path = waypoints([(0.0, 0.0), (turn, 0.0), (turn * (1.0 + math.cos(corner)), turn * math.sin(corner))])
        K_p, K_d, _ = usual_gains(settings)
        limit = settings.rudder_or(settings.rudder_limit)
        return cls(settings.n_P, K_p, K_d, _AHEAD * L, _TURN * L, delta_max=limit, path=path)

    def begin(self, state: Scalars) -> Scalars:
        """On the first leg, no integral [m s/m], t = 0."""
        return (0.0, 0.0, 0.0)

    def command(self, t: Scalar, state: Scalars, memory: Scalars) -> tuple[Scalars, Scalars]:
        """Revolutions [1/s] and rudder [rad]; the next leg is taken within `radius` of its waypoint."""
        number, integral, t_last = memory
        number = self._number(number, state)
        leg = self._leg(number)
        _, across = leg.along_across(state[0], state[1])
        integral = where(number > memory[0], 0.0, integral)  # an offset learned on one leg is wrong on the next
        aim = across + self.sigma * integral
        integral = integral + (t - t_last) * self.ahead * across / (self.ahead * self.ahead + aim * aim)
        error = wrapped(los_heading(leg.alpha, aim, self.ahead) - state[2])
        delta = clip(self.K_p * error - self.K_d * state[5], -self.delta_max, self.delta_max)
        return (self.n_P, delta), (number, integral, t)

    @property
    def legs(self) -> tuple[Leg, ...]:
        """The legs of the path."""
        numbers = self.path.numbers
        return legs(list(zip(numbers[::2], numbers[1::2], strict=True)))

    def _number(self, number: Scalar, state: Scalars) -> Scalar:
        """Number of the leg to follow, the first being 0."""
        for k, leg in enumerate(self.legs[:-1]):
            along, _ = leg.along_across(state[0], state[1])
            near = along >= leg.length - self.radius
            number = where(both(number > k - 0.5, both(number < k + 0.5, near)), k + 1.0, number)
        return number

    def _leg(self, number: Scalar) -> Leg:
        """The leg of that number."""
        chosen, *others = self.legs
        for k, leg in enumerate(others, 1):
            chosen = Leg(*(where(number > k - 0.5, new, old) for new, old in zip(leg, chosen, strict=True)))
        return chosen

    def complete(self, trial: Trial) -> bool:
        """Whether the ship has come abreast of the last waypoint."""
        return self._rows(trial)[-1] < len(trial)

    def indices(self, trial: Trial, L_pp: float) -> Mapping[str, Index]:
        """Cross-track errors [m] and the time to the last waypoint [s].

        Errors are distances to the leg followed or the one before it, whichever is nearer, so that a
        corner is no error before the ship has left its first leg; the first leg is judged from where the
        ship begins.  `cross_track_end` keeps its sign: positive to starboard of the last leg.
        `corner_overshoot` is how far the ship swings across the new leg after a corner, at most.
        """
        rows = self._rows(trial)
        ends = [*rows[:-1], min(rows[-1], len(trial) - 1) + 1]
        error = np.zeros(ends[-1])
        swing = 0.0
        for k, (leg, first, last) in enumerate(zip(self.legs, [0, *rows[:-1]], ends, strict=True)):
            x, y = trial["x"][first:last], trial["y"][first:last]
            across = leg.along_across(x, y)[1]
            before = np.abs(self.legs[k - 1].along_across(x, y)[1]) if k else np.full_like(across, math.inf)
            error[first:last] = np.where(before < np.abs(across), before, across)
            if k and across.size:
                swing = max(swing, float(np.max(-math.copysign(1.0, across[0]) * across)))
        out = {
            "cross_track_max": in_lengths(float(np.nanmax(np.abs(error))), L_pp),
            "cross_track_rms": in_lengths(math.sqrt(float(np.nanmean(error**2))), L_pp),
            "cross_track_end": in_lengths(float(error[-1]), L_pp),
        }
        if len(rows) > 1 and rows[0] < len(trial):
            out["corner_overshoot"] = in_lengths(swing, L_pp)
        return {**out, "time": Index(float(trial.t[rows[-1]] - trial.t[0]), "s")} if rows[-1] < len(trial) else out

    def _rows(self, trial: Trial) -> list[int]:
        """First row after each leg; the length of the trial where a leg is not over."""
        row, out = 0, list[int]()
        for k, leg in enumerate(self.legs):
            reach = leg.length - (self.radius if k < len(self.legs) - 1 else 0.0)
            done = np.flatnonzero(leg.along_across(trial["x"][row:], trial["y"][row:])[0] >= reach)
            row = row + int(done[0]) if done.size else len(trial)
            out.append(row)
        return out
