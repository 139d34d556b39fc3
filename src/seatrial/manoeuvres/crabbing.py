"""Crabbing: sideways at no way ahead, by a pair of thrusters fore and aft that also hold the heading.

The pair are tunnel thrusters (n_bow and n_stern), or azimuths set athwart; which controls they are is
named by the policy, and a ship that lacks them is refused.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar, Self

import numpy as np

from ..core.parameters import ParameterError, Scalar, Scalars, spec
from ..core.symbolic import clip, cos, magnitude, root, sign, sin, where
from ..core.values import dataclass
from ..data import Trial
from . import Index, Manoeuvre, Settings
from .autopilot import wrapped
from .reading import at, in_lengths, reached, track, turned

_ATHWART = 0.5 * math.pi
# Share of full thrust that drives sideways; the rest is left for the heading.
_DRIVE = 0.6
# Share of full thrust per heading error, per yaw rate times L/U, and per integral of the error over L/U.
_HOLD, _DAMP, _TRIM = 3.0, 3.0, 0.3


@dataclass(frozen=True)
class Crabbing(Manoeuvre):
    """Drive to one side for `distance`, then let the way run out; the heading is held by the difference fore and aft.

    Controls that begin with n are revolutions, whose thrust goes with the square; others are thrusts.

    Attributes:
        bow, stern: controls of the thrusters.
        bow_angle, stern_angle: controls that turn them, set athwart; empty for tunnel thrusters.
    """

    kind: ClassVar[str] = "crabbing"
    from_rest: ClassVar[bool] = True
    takes: ClassVar[tuple[str, ...]] = ("side",)
    memory: ClassVar[tuple[str, ...]] = ("x_0", "y_0", "psi_0", "error_integral", "t_last")

    bow_max: Scalar = spec("", "greatest order of the bow thruster, in the unit of its control")
    stern_max: Scalar = spec("", "greatest order of the stern thruster, in the unit of its control")
    distance: Scalar = spec("m", "way to go sideways", (0.0, math.inf))
    side: Scalar = spec("-", "+1 starboard, -1 port", (-1.0, 1.0), default=1.0)
    drive: Scalar = spec("-", "share of full thrust that drives sideways", (0.0, 1.0), default=_DRIVE)
    K_p: Scalar = spec("-", "share of full thrust per heading error", default=_HOLD)
    K_d: Scalar = spec("s", "share of full thrust against yaw rate", default=0.0)
    K_i: Scalar = spec("1/s", "share of full thrust per integral of the heading error", default=0.0)
    bow: str = "n_bow"
    stern: str = "n_stern"
    bow_angle: str = ""
    stern_angle: str = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        if bool(self.bow_angle) != bool(self.stern_angle):
            raise ParameterError("bow_angle, stern_angle: give both (azimuths) or none (tunnel thrusters)")

    @classmethod
    def ordered(cls, settings: Settings) -> Self:
        """Two ship lengths to starboard by default, on tunnel thrusters n_bow and n_stern.

        They turn up to the revolutions of the approach, or as far as their own limits let them.
        """
        return cls.fitted(settings, settings.controls)

    @classmethod
    def fitted(cls, settings: Settings, controls: Mapping[str, float]) -> Self:
        """The same with the pair that a ship has: azimuths where there are any, else tunnel thrusters.

        Args:
            controls: greatest value of each control of the ship by name, infinite without a limit.

        Raises:
            ParameterError: a thrust without a limit.
        """
        pairs = [(f"{unit}_bow", f"{unit}_stern") for unit in ("f", "n")]
        bow, stern = next((pair for pair in pairs if all(name in controls for name in pair)), pairs[-1])
        most = {name: _greatest(name, controls, settings) for name in (bow, stern)}
        azimuths = "alpha_bow" in controls and "alpha_stern" in controls
        return cls(
            most[bow], most[stern], 2.0 * settings.L_pp, settings.side, _DRIVE, _HOLD, _DAMP * settings.clock,
            _TRIM / settings.clock,
            bow, stern, *(("alpha_bow", "alpha_stern") if azimuths else ()),
        )  # fmt: skip

    @property
    def orders(self) -> tuple[str, ...]:
        """What it orders: the thrusters, and their angles where they have any."""
        return (self.bow, self.stern, *((self.bow_angle, self.stern_angle) if self.bow_angle else ()))

    def begin(self, state: Scalars) -> Scalars:
        """The pose at the start [m, m, rad], no integral [rad s], and t = 0."""
        return (*state[:3], 0.0, 0.0)

    def command(self, t: Scalar, state: Scalars, memory: Scalars) -> tuple[Scalars, Scalars]:
        """Orders of the thrusters, and 90 deg for azimuths."""
        x_0, y_0, psi_0, integral, t_last = memory
        error = wrapped(psi_0 - state[2])
        yaw = self.K_p * error - self.K_d * state[5] + self.K_i * integral
        integral = where(magnitude(yaw) <= 1.0, integral + (t - t_last) * error, integral)
        gone = cos(psi_0) * (state[1] - y_0) - sin(psi_0) * (state[0] - x_0)  # to starboard of the first heading
        way = where(self.side * gone >= self.distance, 0.0, self.side * self.drive)
        orders = (
            self.bow_max * _order(self.bow, clip(way + yaw, -1.0, 1.0)),
            self.stern_max * _order(self.stern, clip(way - yaw, -1.0, 1.0)),
        )
        angles = (_ATHWART, _ATHWART) if self.bow_angle else ()
        return (*orders, *angles), (x_0, y_0, psi_0, integral, t)

    def complete(self, trial: Trial) -> bool:
        """Whether the ship has gone the distance."""
        return reached(self.side * track(trial)[1], self.distance) is not None

    def indices(self, trial: Trial, L_pp: float) -> Mapping[str, Index]:
        """How fast the ship goes sideways and what it does besides.

        Over the way that was set: `lateral_distance` and `forward_drift` [m], largest in magnitude;
        `heading_deviation`, largest [rad]; `time` until the distance is gone [s]; `lateral_speed`, the mean
        over the second half of that way, and `lateral_speed_max` [m/s].
        """
        along, across = track(trial)
        across = self.side * across
        moment, half = (reached(across, share * self.distance) for share in (1.0, 0.5))
        end = len(trial) if moment is None else int(moment) + 2
        out = {
            "lateral_distance": in_lengths(float(across[:end][-1]), L_pp),
            "forward_drift": in_lengths(float(along[:end][np.argmax(np.abs(along[:end]))]), L_pp),
            "heading_deviation": Index(float(np.nanmax(np.abs(turned(trial)[:end]))), "rad"),
            "lateral_speed_max": Index(float(np.nanmax(np.gradient(across, trial.t)[:end])), "m/s"),
        }
        if moment is not None and half is not None:
            time, midway = at(trial.t, moment), at(trial.t, half)
            out["lateral_speed"] = Index(0.5 * self.distance / (time - midway), "m/s")
            out["time"] = Index(time - float(trial.t[0]), "s")
        return out


def _greatest(name: str, controls: Mapping[str, float], settings: Settings) -> float:
    limit = controls.get(name, math.inf)
    if math.isfinite(limit):
        return limit
    if not name.startswith("n"):
        raise ParameterError(f"{name} has no limit; give one in [actuators.{name}], or bow_max and stern_max here")
    return settings.n_P


def _order(control: str, thrust: Scalar) -> Scalar:
    """Order over its greatest value for a share of full thrust: revolutions go with its root."""
    return sign(thrust) * root(magnitude(thrust)) if control.startswith("n") else thrust
