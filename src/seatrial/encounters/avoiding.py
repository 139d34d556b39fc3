"""A reference autopilot that keeps clear of traffic by velocity obstacles and the rules of the road, and its runs.

After Kuwata et al. 2014 (IEEE J. Oceanic Eng. 39(1), 110-119): of a fan of courses those are barred on which
a ship would be met within a time and nearer than a distance, and, where the rules ask to keep clear, those that leave
it to starboard; of the rest the one nearest to the course is taken.  Speed is not altered.  Written like a manoeuvre,
so that ship, autopilot and targets compile into one step, and many meetings run at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce
from typing import ClassVar, Self

import numpy as np

from ..core.errors import RequestError
from ..core.parameters import Parts, Scalar, Scalars, parts, spec
from ..core.symbolic import atan2, both, clip, cos, larger, magnitude, root, sin, smaller, speed, where
from ..data import Array
from ..engine import SimulationError
from ..manoeuvres import Policy, Settings
from ..manoeuvres.autopilot import usual_gains, wrapped
from ..ships import Ship
from ..simulate.approach import approach, time_step
from ..simulate.loop import closed_loop
from ..simulate.run import blown_up, campaign
from .meeting import Meeting
from .rules import Limits
from .tracks import Tracks

_DEG = math.pi / 180.0
_TURNS = tuple(sign * k * 10.0 * _DEG for k in range(4, 13) for sign in (1, -1))
"""Alterations to choose from: 40 deg, surely apparent (Rule 8(b)), to 120 deg, on either side."""

_STEADY = 15.0 * _DEG
"""By how much a course has to be nearer to the old one than the present alteration, so that it is changed for it."""

_BARRED = 100.0
"""Cost of a course on which a ship is met, more the sooner; above that of any alteration [rad]."""

_WIDER = 1.2
"""An alteration clears the passing distance by this factor, as the ship takes time to turn."""

_MARGIN = 1.4
"""Distance that the reference autopilots keep over the one that the checks ask for."""


@dataclass(frozen=True)
class Target:
    """A ship that keeps course and speed, from where it is at t = 0."""

    x: Scalar = spec("m", "place north")
    y: Scalar = spec("m", "place east")
    psi: Scalar = spec("rad", "course")
    U: Scalar = spec("m/s", "speed")

    def at(self, t: Scalar) -> Scalars:
        """Place [m] and velocity [m/s], north and east."""
        north, east = self.U * cos(self.psi), self.U * sin(self.psi)
        return self.x + north * t, self.y + east * t, north, east


@dataclass(frozen=True)
class KeepClear(Policy):
    """An autopilot among ships that keep course and speed; it begins at (0, 0) on course north.

    With `rules` at 1 it does what the part of the ship asks, as the ships lie at t = 0 (Rule 13(d): a part is kept): it
    leaves ships that it meets or has to give way to on its port side, and holds on before others until `alone` is left
    to the closest approach; then it does not turn to port for a ship on its own port side (Rule 17(c)).
    """

    memory: ClassVar[tuple[str, ...]] = ("turn",)

    n_P: Scalar = spec("1/s", "propeller revolutions, held")
    K_p: Scalar = spec("-", "rudder per heading error")
    K_d: Scalar = spec("s", "rudder against yaw rate")
    delta_max: Scalar = spec("rad", "greatest rudder that the autopilot orders", (0.0, math.pi))
    passing: Scalar = spec("m", "distance at which it passes other ships", (0.0, math.inf))
    horizon: Scalar = spec("s", "time to a closest approach nearer than that at which it acts", (0.0, math.inf))
    alone: Scalar = spec("s", "the same while it stands on", (0.0, math.inf))
    rules: Scalar = spec("-", "1: by the rules, 0: as if there were none", (0.0, 1.0), default=1.0)
    lean: Scalar = spec("rad", "by how much an alteration to starboard costs more than one to port", default=0.0)
    targets: Parts = parts("ship")

    def begin(self, state: Scalars) -> Scalars:
        """No alteration of course [rad]."""
        return (0.0,)

    def command(self, t: Scalar, state: Scalars, memory: Scalars) -> tuple[Scalars, Scalars]:
        """Revolutions [1/s] and rudder [rad]; the alteration is chosen anew at each step."""
        (turn,) = memory
        U = speed(state[3], state[4])
        seen = [_Seen.of(one, one.at(t), state, U, self) for _, one in self.targets.items()]
        best, chosen = self._cost(0.0, turn, seen), 0.0
        for other in _TURNS:
            cost = self._cost(other, turn, seen)
            best, chosen = smaller(cost, best), where(cost < best, other, chosen)
        error = wrapped(chosen - state[2])
        delta = clip(self.K_p * error - self.K_d * state[5], -self.delta_max, self.delta_max)
        return (self.n_P, delta), (chosen,)

    def _cost(self, turn: float, now: Scalar, seen: list[_Seen]) -> Scalar:
        """Cost of an alteration from the course [rad]."""
        kept = where(magnitude(now - turn) < 0.01, _STEADY, 0.0)
        own = abs(turn) - kept + (self.lean if turn > 0.0 else 0.0)
        barred = [one.barred(turn) for one in seen]
        return own + (reduce(larger, barred) if barred else 0.0)


@dataclass(frozen=True)
class _Seen:
    """A ship as the own one sees it now; `clear` and `stands` are 1 where the rules ask for that, else 0."""

    x: Scalar
    y: Scalar
    north: Scalar
    east: Scalar
    U: Scalar
    passing: Scalar
    horizon: Scalar
    clear: Scalar
    stands: Scalar
    to_port: Scalar

    @classmethod
    def of(cls, target: Target, there: Scalars, state: Scalars, U: Scalar, pilot: KeepClear) -> Self:
        """The own part follows from bearings at t = 0: sectors of Rules 13 to 15, borders of DNV."""
        beta = atan2(target.y, target.x)
        alpha = wrapped(beta + math.pi - target.psi)
        overtaking = where(magnitude(alpha) > 112.5 * _DEG, 1.0, 0.0)
        ahead = both(magnitude(beta) <= 5.0 * _DEG, magnitude(alpha) <= 5.0 * _DEG)
        gives = both(beta > 0.0, beta < 112.5 * _DEG)
        clear = pilot.rules * where(ahead, 1.0, where(gives, 1.0 - overtaking, 0.0))
        stands = pilot.rules * (1.0 - overtaking) * (1.0 - where(ahead, 1.0, where(gives, 1.0, 0.0)))
        horizon = where(stands > 0.5, pilot.alone, pilot.horizon)
        x, y, north, east = there
        to_port = stands * where(beta < 0.0, 1.0, 0.0)
        return cls(x - state[0], y - state[1], north, east, U, pilot.passing, horizon, clear, stands, to_port)

    def barred(self, turn: float) -> Scalar:
        """Cost of a course for this ship; 0 where it is free."""
        distance, t = self._approach(turn)
        wide = self.passing * (_WIDER if turn else 1.0)
        met = where(distance < wide, where(t > 0.0, where(t < self.horizon, 1.0, 0.0), 0.0), 0.0)
        soon = _BARRED * (2.0 - clip(t / self.horizon, 0.0, 1.0) - 0.5 * clip(distance / wide, 0.0, 1.0))
        return met * soon + self._wrong(turn)

    def _wrong(self, turn: float) -> Scalar:
        """Cost of a course against the rules, while the old course would meet the ship."""
        if not turn:
            return 0.0
        distance, t = self._approach(0.0)
        risk = where(distance < self.passing, where(t > 0.0, where(t < self.horizon, 1.0, 0.0), 0.0), 0.0)
        if turn < 0.0:  # to port: neither when keeping clear nor for a ship on the port side
            return 0.5 * _BARRED * risk * larger(self.clear, self.to_port)
        w_x, w_y = self._relative(turn)
        starboard = where(self.x * w_y - self.y * w_x > 0.0, 1.0, 0.0)
        return 0.25 * _BARRED * risk * self.clear * starboard

    def _relative(self, turn: float) -> tuple[Scalar, Scalar]:
        return self.north - self.U * math.cos(turn), self.east - self.U * math.sin(turn)

    def _approach(self, turn: float) -> tuple[Scalar, Scalar]:
        """DCPA [m] and TCPA [s] on a course; 0 s, and the present distance, where the distance does not change."""
        w_x, w_y = self._relative(turn)
        square = w_x * w_x + w_y * w_y + 1e-6
        t = -(self.x * w_x + self.y * w_y) / square
        past = larger(t, 0.0)
        x, y = self.x + w_x * past, self.y + w_y * past
        return root(x * x + y * y), t


def good(ship: Ship, meeting: Meeting, L: float) -> KeepClear:
    """The reference autopilot that keeps the rules; L is the length of the longest ship around [m]."""
    longest = np.asarray(max(L, ship.L_pp))
    limits = Limits()
    return _pilot(ship, meeting, passing=_MARGIN * float(limits.passing.of(longest)),
                  horizon=float(limits.horizon.of(longest)), alone=float(limits.alone.of(longest)))  # fmt: skip


def bad(ship: Ship, meeting: Meeting, L: float) -> KeepClear:
    """The reference autopilot that fails Rules 14 and 17: it turns to port, and as soon for ships that give way."""
    longest = np.asarray(max(L, ship.L_pp))
    limits = Limits()
    horizon = float(limits.horizon.of(longest))
    return _pilot(ship, meeting, passing=_MARGIN * float(limits.passing.of(longest)), horizon=horizon, alone=horizon,
                  rules=0.0, lean=20.0 * _DEG)  # fmt: skip


def _pilot(
    ship: Ship, meeting: Meeting, passing: float, horizon: float, alone: float, rules: float = 1.0, lean: float = 0.0
) -> KeepClear:
    U, n_P = approach(ship)
    limit = min(float(ship.actuators.rudder.high), 35.0 * _DEG)
    steer = usual_gains(Settings(n_P, U, ship.L_pp, limit))
    names = tuple(f"t{k + 1}" for k in range(meeting.x.shape[-1]))
    nowhere = Parts(names, tuple(Target(0.0, 0.0, 0.0, 0.0) for _ in names))
    return KeepClear(n_P, steer.K_p, steer.K_d, limit, passing, horizon, alone, rules, lean, nowhere)


def sail(
    ship: Ship, pilot: Callable[[Ship, Meeting, float], KeepClear], meeting: Meeting, *, duration: float,
    L: float, B: float, every: float = 10.0, threads: int | None = None,
) -> Tracks:  # fmt: skip
    """Run a ship under an autopilot through meetings, all at once.

    Args:
        pilot: `good`, `bad`, or another that makes one.
        meeting: of the speed that the ship steams at; one, or many with an axis of runs.
        duration: of each run [s].
        L, B: length and breadth of the targets [m].
        every: time from row to row of the tracks [s], to the next step of the ship.

    Returns:
        Tracks of shape (runs, ships, rows).

    Raises:
        RequestError: the meeting is of another speed, or the ship has no breadth.
        SimulationError: a run leaves what the ship's file holds for.
    """
    U = approach(ship)[0]
    if not np.allclose(meeting.U, U, rtol=1e-3):
        raise RequestError(f"the meeting is of an own ship at {np.ravel(meeting.U)[0]:g} m/s; {ship.name} makes {U:g}")
    if not float(ship.model.breadth) > 0.0:
        raise RequestError(
            f"{ship.name}: its file tells no breadth, without which hulls do not touch; take one that does"
        )
    steering, dt = pilot(ship, meeting, L), time_step(ship)
    rows = [np.atleast_2d(one) for one in (meeting.x, meeting.y, meeting.psi, meeting.U_target)]
    vary = {f"policy.targets.{name}.{what}": values[:, k].copy()
            for k, (name, _) in enumerate(steering.targets.items())
            for what, values in zip(("x", "y", "psi", "U"), rows, strict=True)}  # fmt: skip
    done = campaign(ship, steering, vary, speed=U, duration=duration, dt=dt, every=max(1, round(every / dt)),
                    threads=threads)  # fmt: skip
    if done.failures:
        first = done.failures[0]
        raise SimulationError(f"{ship.name}: run {first.lane + 1}: {blown_up(first, ship)}", first.time)
    columns = closed_loop(ship, steering, dt).stored
    own = [done.values[:, :, columns.index(name)] for name in ("x", "y", "psi", "u", "v_m")]
    return _tracks(done.t, own, rows, ship, L, B)


def _tracks(t: Array, own: list[Array], targets: list[Array], ship: Ship, L: float, B: float) -> Tracks:
    x, y, psi, U = (one[:, :, None] for one in targets)
    still = np.zeros_like(t)
    others = (x + U * np.cos(psi) * t, y + U * np.sin(psi) * t, psi + still, U + still, 0.0 * U + still)
    all_x, all_y, all_psi, u, v_m = (
        np.concatenate([one[:, None], other], axis=1) for one, other in zip(own, others, strict=True)
    )
    lengths = np.array([ship.L_pp, *[L] * x.shape[1]])
    return Tracks(t, all_x, all_y, all_psi, u, v_m, lengths, np.array([float(ship.model.breadth), *[B] * x.shape[1]]))
