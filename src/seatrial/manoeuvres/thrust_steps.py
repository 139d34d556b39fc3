"""Thrust steps: surge force, sway force and yaw moment stepped at random, one of them or several at a time.

For ships whose thrusters take orders of force and direction.  With a thruster at either end the three are independent
(each axis can be tried on its own, as Pedersen 2019 did); with both at one end a sway force brings its moment
along, which is what underactuated means here.
"""

from __future__ import annotations

import math
from typing import ClassVar, Self

import numpy as np

from ..core.parameters import ParameterError, Scalar, Scalars, spec
from ..core.symbolic import atan2, speed
from ..core.values import dataclass
from ..data import Array
from . import Settings
from .autopilot import wrapped
from .pseudo_random import Excitation

_LEVELS = (-1.0, -0.5, 0.0, 0.5, 1.0)
# A level lasts for so many L/U on the mean; the same as share of the mean that every level lasts at least.
_HOLD, _LEAST = 1.0, 0.4
_LENGTH = 20.0
# Share of full thrust that an ordered run uses.
_SHARE = 0.4


@dataclass(frozen=True)
class ThrustSteps(Excitation):
    """Forces held at random levels; the heading is held where `K_p` or `K_d` are above zero.

    Switches fall on whole seconds, whatever the time step.

    Attributes:
        hold: mean time between switches of one force [s].
        length: time after which the run counts as complete [s].
        seed: of levels and switches.
        first, second: names of the two thrusters, whose controls are f_NAME [N] and alpha_NAME [rad].
        x_first, x_second: where they stand ahead of midship [m]; equal, they push alike, and N is had from Y.
    """

    kind: ClassVar[str] = "thrust-steps"
    from_rest: ClassVar[bool] = True
    takes: ClassVar[tuple[str, ...]] = ("seed",)
    memory: ClassVar[tuple[str, ...]] = ("psi_0",)
    given: ClassVar[tuple[str, ...]] = ("surge", "sway", "yaw")

    X: Scalar = spec("N", "greatest change of the force ahead", (0.0, math.inf), default=0.0)
    Y: Scalar = spec("N", "greatest force to starboard", (0.0, math.inf), default=0.0)
    N: Scalar = spec("N m", "greatest moment to starboard", (0.0, math.inf), default=0.0)
    X_mean: Scalar = spec("N", "force ahead about which it changes", default=0.0)
    K_p: Scalar = spec("N m", "moment per heading error that holds the heading", (0.0, math.inf), default=0.0)
    K_d: Scalar = spec("N m s", "moment against yaw rate", (0.0, math.inf), default=0.0)
    hold: float = 6.0
    length: float = 60.0
    seed: int = 1
    first: str = "bow"
    second: str = "stern"
    x_first: float = 1.0
    x_second: float = -1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.x_first == self.x_second == 0:
            raise ParameterError("x_first, x_second: both thrusters stand at midship and cannot turn the ship")

    @classmethod
    def ordered(cls, settings: Settings) -> Self:
        """All three at once at two fifths of the thrust, each level for some L/U, on the first two thrusts f_NAME.

        `Settings` does not hold their positions: bow and stern are taken to stand at 0.4 L either way, others aft.

        Raises:
            ParameterError: fewer than two thrusts with a limit.
        """
        limits = {name[2:]: most for name, most in settings.controls.items() if name.startswith("f_") and most > 0}
        if len(limits) < 2:
            raise ParameterError("thrust-steps drives two thrusters by f_NAME; give [actuators] with limits of two")
        first, second = ("bow", "stern") if {"bow", "stern"} <= set(limits) else tuple(limits)[:2]
        unit, x = settings.clock, 0.4 * settings.L_pp
        force = _SHARE * min(limits[first], limits[second])
        return cls(
            force, force, force * x, hold=_HOLD * unit, length=_LENGTH * unit, seed=settings.seed,
            first=first, second=second, x_first=x if first == "bow" else -x, x_second=-x,
        )  # fmt: skip

    @property
    def orders(self) -> tuple[str, ...]:
        """Thrust and direction of both thrusters."""
        return tuple(f"{what}_{name}" for name in (self.first, self.second) for what in ("f", "alpha"))

    def begin(self, state: Scalars) -> Scalars:
        """The heading to hold [rad]."""
        return (state[2],)

    def schedule(self, dt: float, steps: int) -> Array:
        """Levels of surge, sway and yaw in [-1, 1] per step, shape (steps, 3); the same at every call."""
        second = np.floor(dt * np.arange(steps) + 1e-9)
        return np.column_stack([self._levels(axis, second) for axis in range(3)])

    def _levels(self, axis: int, second: Array) -> Array:
        """One force's levels at whole seconds; no level follows itself."""
        rng = np.random.default_rng([self.seed, axis])
        starts, kept = [0.0], [float(rng.choice(_LEVELS))]
        while second.size and starts[-1] <= second[-1]:
            wait = _LEAST * self.hold + rng.exponential((1.0 - _LEAST) * self.hold)
            starts.append(starts[-1] + max(round(wait), 1))
            kept.append(float(rng.choice([one for one in _LEVELS if one != kept[-1]])))
        return np.array(kept)[np.searchsorted(starts, second, "right") - 1]

    def command(
        self, t: Scalar, state: Scalars, memory: Scalars, given: Scalars = (0.0, 0.0, 0.0)
    ) -> tuple[Scalars, Scalars]:
        """Thrust [N] and direction [rad] of both thrusters, and the heading to hold."""
        surge, sway, yaw = given
        ahead = 0.5 * (self.X_mean + self.X * surge)
        moment = self.N * yaw + self.K_p * wrapped(memory[0] - state[2]) - self.K_d * state[5]
        span = self.x_first - self.x_second
        if span:
            first = (moment - self.x_second * self.Y * sway) / span
            second = self.Y * sway - first
        else:
            first = second = 0.5 * (self.Y * sway + moment / self.x_first)
        pushes = ((ahead, first), (ahead, second))
        return tuple(one for X, Y in pushes for one in (speed(X, Y), atan2(Y, X))), memory
