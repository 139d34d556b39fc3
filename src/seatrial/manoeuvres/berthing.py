"""A berthing run: approach along a line, lose way with the propeller astern, stop at a pose.

The law is a plain one.  Rudder: line of sight along the berth's line, under PD.  Revolutions: what the
wanted speed would need, plus a share for the speed still too high, which takes the propeller astern.
The wanted speed falls with the root of the distance to go, that is, at a constant deceleration.  A single
screw without thrusters cannot hold its heading while it goes astern; what is left is in the indices.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar, Self

import numpy as np

from ..core.parameters import Scalar, Scalars, spec
from ..core.symbolic import clip, cos, root, sin, smaller
from ..core.values import dataclass
from ..data import Trial
from . import Index, Manoeuvre, Settings
from .autopilot import usual_gains, wrapped
from .reading import in_lengths, track, turned
from .track import Leg, los_heading

# The default run in ship lengths: way to go, side step, way over which speed is lost, look-ahead.
_ALONG, _ACROSS, _BRAKING, _AHEAD = 28.0, 1.0, 20.0, 5.0
# Revolutions answer a speed error of the approach speed with so many times the approach's revolutions.
_BRAKE = 12.0
# The rudder loses its hold with the way; the gains of the open sea are raised by so much.
_FIRMER = 2.0
# Below this share of the first speed the ship counts as stopped.
_STOPPED = 0.03


@dataclass(frozen=True)
class Berthing(Manoeuvre):
    """Stop at the pose `along` ahead and `across` to starboard of the start, turned by `turn`."""

    kind: ClassVar[str] = "berthing"
    takes: ClassVar[tuple[str, ...]] = ("rudder", "heading", "side")
    memory: ClassVar[tuple[str, ...]] = ("x_0", "y_0", "psi_0")

    n_P: Scalar = spec("1/s", "propeller revolutions of the approach")
    speed: Scalar = spec("m/s", "speed of the approach", (1e-6, 100.0))
    along: Scalar = spec("m", "way to the berth, ahead of the start")
    across: Scalar = spec("m", "way to the berth, to starboard of the start")
    turn: Scalar = spec("rad", "heading at the berth less that of the start", (-math.pi, math.pi))
    braking: Scalar = spec("m", "distance to go at which the speed begins to fall", (1e-6, math.inf))
    ahead: Scalar = spec("m", "look-ahead distance of the line of sight", (1e-6, math.inf))
    K_p: Scalar = spec("-", "rudder per heading error")
    K_d: Scalar = spec("s", "rudder against yaw rate")
    K_u: Scalar = spec("1/m", "revolutions per speed error")
    n_max: Scalar = spec("1/s", "greatest revolutions, ahead and astern", (0.0, math.inf))
    delta_max: Scalar = spec("rad", "greatest rudder that is ordered", (0.0, math.pi), default=math.inf)

    @classmethod
    def ordered(cls, settings: Settings) -> Self:
        """Some 28 ship lengths ahead, one to starboard by default, parallel unless a heading is given.

        Revolutions go as far as those of the approach, ahead and astern.
        """
        L, U, n = settings.L_pp, settings.speed, settings.n_P
        K_p, K_d, _ = usual_gains(settings)
        limit = settings.rudder_or(settings.rudder_limit)
        return cls(
            n, U, _ALONG * L, settings.side * _ACROSS * L, settings.side * settings.heading_or(0.0), _BRAKING * L,
            _AHEAD * L, _FIRMER * K_p, _FIRMER * K_d, _BRAKE * n / U, n, limit,
        )  # fmt: skip

    def begin(self, state: Scalars) -> Scalars:
        """The pose from which the berth is counted [m, m, rad]."""
        return state[:3]

    def command(self, t: Scalar, state: Scalars, memory: Scalars) -> tuple[Scalars, Scalars]:
        x_0, y_0, psi_0 = memory
        c, s = cos(psi_0), sin(psi_0)
        alpha = psi_0 + self.turn
        berth = Leg(x_0 + c * self.along - s * self.across, y_0 + s * self.along + c * self.across, alpha, 0.0)
        beyond, aside = berth.along_across(state[0], state[1])
        error = wrapped(los_heading(alpha, aside, self.ahead) - state[2])
        delta = clip(self.K_p * error - self.K_d * state[5], -self.delta_max, self.delta_max)
        # u^2 = 2 a s with a = U^2 / (2 braking)
        wanted = self.speed * smaller(root(-beyond / self.braking), 1.0)
        n = self.n_P * wanted / self.speed + self.K_u * (wanted - state[3])
        return (clip(n, -self.n_max, self.n_max), delta), memory

    def complete(self, trial: Trial) -> bool:
        """Whether the ship has stopped."""
        return self._stopped(trial) is not None

    def indices(self, trial: Trial, L_pp: float) -> Mapping[str, Index]:
        """Where and how the ship stops; where it never does, the same figures at the end, without `time`.

        `final_distance` from the berth, of which `final_along` beyond it and `final_across` to starboard
        of its line [m]; `final_speed` [m/s] and `heading_error` [rad] there; `time` from the start until the
        speed is below 3 % of the first one [s].
        """
        stop = self._stopped(trial)
        row = len(trial) - 1 if stop is None else stop
        ahead, starboard = (float(values[row]) for values in track(trial))
        berth = Leg(self.along, self.across, self.turn, 0.0)
        along, across = berth.along_across(ahead, starboard)
        error = math.remainder(float(turned(trial)[row]) - self.turn, 2 * math.pi)
        out = {
            "final_distance": in_lengths(math.hypot(along, across), L_pp),
            "final_along": in_lengths(along, L_pp),
            "final_across": in_lengths(across, L_pp),
            "final_speed": Index(math.hypot(float(trial["u"][row]), float(trial["v_m"][row])), "m/s"),
            "heading_error": Index(error, "rad"),
        }
        return out if stop is None else {**out, "time": Index(float(trial.t[row] - trial.t[0]), "s")}

    def _stopped(self, trial: Trial) -> int | None:
        """First row at which the ship has lost its way."""
        way = np.flatnonzero(np.abs(trial["u"]) < _STOPPED * abs(self.speed))
        return int(way[0]) if way.size else None
