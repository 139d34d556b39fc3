"""The ship's own steering control: holds a heading or follows a track, where it is told these and no rudder angle."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ..manoeuvres import Settings
from ..manoeuvres.autopilot import Gains, usual_gains, wrapped
from ..manoeuvres.track import los_heading
from ..ships import Ship

_POLE = 0.1
"""Pole of the integral action as a share of the loop's frequency: slow enough to leave turns alone."""

_NEAR = math.radians(5.0)
"""Heading error up to which the integral grows [rad]."""

_AHEAD = 2.5
"""Look-ahead of the track follower in ship lengths, as in the manoeuvre `track`."""


@dataclass
class SteeringControl:
    """A heading controller with integral action, and before it a track follower by line of sight.

    Attributes:
        limit: greatest rudder that it orders [rad].
        course: heading to steer [rad]; None while it does not steer.
        rate: greatest rate at which the heading to steer is approached [rad/s].
        across: distance to starboard of the track, where one is followed [m]; then `course` is the track's.
    """

    gains: Gains
    ahead: float
    limit: float
    course: float | None = None
    rate: float = math.inf
    across: float | None = None
    _reference: float | None = None
    _integral: float = 0.0

    @staticmethod
    def of(ship: Ship, rudder_limit: float) -> SteeringControl:
        """With the gains of an assumed merchant ship of this length and speed."""
        settings = Settings(ship.n_P or 0.0, ship.speed, ship.L_pp, rudder_limit)
        return SteeringControl(usual_gains(settings, _POLE), _AHEAD * ship.L_pp, rudder_limit)

    def steer(self, course: float, rate: float = math.inf, across: float | None = None) -> None:
        """Steer this heading [rad], or along a track of this direction from `across` metres to starboard of it."""
        self.course, self.rate, self.across = course, rate, across

    def let_go(self) -> None:
        """Steer no more; what was learned of the weather is forgotten."""
        self.course, self.rate, self.across, self._reference, self._integral = None, math.inf, None, None, 0.0

    def snapshot(self) -> list[float | None]:
        """What it steers, and what it has learned, for JSON."""
        return [self.course, self.rate, self.across, self._reference, self._integral]

    def restore(self, saved: Sequence[Any]) -> None:
        """Go on from what `snapshot` gave."""
        self.course, self.rate, self.across, self._reference, self._integral = saved

    def rudder(self, psi: float, r: float, dt: float, limit: float = math.inf) -> float:
        """Rudder for the next `dt` seconds [rad]; 0 while it does not steer.

        Args:
            psi, r: heading [rad] and rate of turn [rad/s].
            dt: time until it is asked again [s].
            limit: of the rudder, where a smaller one was ordered [rad].
        """
        if self.course is None:
            return 0.0
        aim = float(self.course if self.across is None else los_heading(self.course, self.across, self.ahead))
        before = psi if self._reference is None else self._reference
        step = float(wrapped(aim - before))
        here = aim if math.isinf(self.rate) else before + min(max(step, -self.rate * dt), self.rate * dt)
        self._reference = here
        turning = math.copysign(self.rate, step) if math.cos(aim - here) < 1.0 - 1e-12 else 0.0
        most = min(limit, self.limit)
        error = float(wrapped(here - psi))
        wanted = float(self.gains.K_p * error - self.gains.K_d * (r - turning) + self.gains.K_i * self._integral)
        if abs(wanted) < most and abs(error) < _NEAR:  # what a turn adds up is no weather
            self._integral += error * dt
        return min(max(wanted, -most), most)
