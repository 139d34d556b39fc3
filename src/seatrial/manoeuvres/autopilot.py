"""Course keeping and course change under an autopilot: a PID law on the heading."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar, NamedTuple, Self

import numpy as np

from ..core.parameters import ParameterError, Scalar, Scalars, spec
from ..core.symbolic import atan2, clip, cos, magnitude, sin, where
from ..core.values import dataclass
from ..data import Trial
from . import Index, Manoeuvre, Settings
from .reading import at, helm_channel, reached, rms, turned

# A middling merchant ship (K' 1.3-2.5, T' 1.5-6): assumed where those of the ship are unknown.
K_PRIME, T_PRIME = 1.8, 2.5
# The closed loop's frequency times L/U, and its damping.
OMEGA_PRIME, ZETA = 0.8, 0.9
# Within this share of the change the ship counts as on the new course.
_BAND = 0.05


class Gains(NamedTuple):
    """Rudder per heading error [-], per yaw rate [s] and per integral of the error [1/s]."""

    K_p: Scalar
    K_d: Scalar
    K_i: Scalar = 0.0


def gains(K: float, T: float, omega: float, zeta: float, pole: float = 0.0) -> Gains:
    """Gains that give T r' + r = K delta the given poles, under delta = K_p e - K_d r + K_i int e.

    The closed loop is (s^2 + 2 zeta omega s + omega^2)(s + pole); without integral action (pole 0) a
    change of course overshoots by exp(-pi zeta / sqrt(1 - zeta^2)).  Follows from comparing the
    coefficients of T s^3 + (1 + K K_d) s^2 + K K_p s + K K_i.

    Args:
        K, T: Nomoto's constants [1/s, s]; both negative for a ship unstable on course.
        omega: natural frequency [rad/s].
        zeta: damping ratio [-].
        pole: of the integral action [1/s]; a tenth of omega is usual.

    Raises:
        ParameterError: K or T is zero, or the closed loop is unstable.
    """
    if not (K and T and math.isfinite(K) and math.isfinite(T)):
        raise ParameterError(f"K is {K:g} and T is {T:g}; an autopilot needs a ship that answers its rudder")
    if not (omega > 0 and zeta > 0 and pole >= 0):
        raise ParameterError(f"omega {omega:g}, zeta {zeta:g}, pole {pole:g}: a stable loop has them above zero")
    return Gains(
        T * (omega**2 + 2 * zeta * omega * pole) / K,
        (T * (2 * zeta * omega + pole) - 1.0) / K,
        T * omega**2 * pole / K,
    )


def usual_gains(settings: Settings, pole: float = 0.0) -> Gains:
    """Gains for an assumed merchant ship of the ship's length and speed; `pole` as a share of omega."""
    rate = settings.speed / settings.L_pp
    omega = OMEGA_PRIME * rate
    return gains(K_PRIME * rate, T_PRIME / rate, omega, ZETA, pole * omega)


def wrapped(angle: Scalar) -> Scalar:
    """The same direction in (-pi, pi] [rad]."""
    return atan2(sin(angle), cos(angle))


@dataclass(frozen=True)
class CourseKeeping(Manoeuvre):
    """Keep the course of the approach, or that plus `change` from t = 0 on."""

    kind: ClassVar[str] = "course-keeping"
    takes: ClassVar[tuple[str, ...]] = ("rudder", "heading", "side")
    memory: ClassVar[tuple[str, ...]] = ("psi_0", "error_integral", "t_last")

    n_P: Scalar = spec("1/s", "propeller revolutions, held")
    change: Scalar = spec("rad", "change of course, positive to starboard", (-math.pi, math.pi))
    K_p: Scalar = spec("-", "rudder per heading error")
    K_d: Scalar = spec("s", "rudder against yaw rate")
    K_i: Scalar = spec("1/s", "rudder per integral of the heading error", default=0.0)
    delta_max: Scalar = spec("rad", "greatest rudder that the autopilot orders", (0.0, math.pi), default=math.inf)

    @classmethod
    def ordered(cls, settings: Settings) -> Self:
        """A change of 10 deg to starboard by default, with the gains of an assumed merchant ship.

        `rudder` limits what the autopilot orders.
        """
        limit = settings.rudder_or(settings.rudder_limit)
        change = settings.side * settings.heading_or(math.radians(10.0))
        return cls(settings.n_P, change, *usual_gains(settings), limit)

    def begin(self, state: Scalars) -> Scalars:
        """The course of the approach [rad], no integral [rad s], and t = 0."""
        return (state[2], 0.0, 0.0)

    def command(self, t: Scalar, state: Scalars, memory: Scalars) -> tuple[Scalars, Scalars]:
        """Revolutions [1/s] and rudder [rad]; the integral waits while the rudder is at its limit."""
        psi_0, integral, t_last = memory
        error = wrapped(psi_0 + self.change - state[2])
        delta = self.K_p * error - self.K_d * state[5] + self.K_i * integral
        grown = integral + (t - t_last) * error
        integral = where(magnitude(delta) <= self.delta_max, grown, integral)
        return (self.n_P, clip(delta, -self.delta_max, self.delta_max)), (psi_0, integral, t)

    def complete(self, trial: Trial) -> bool:
        """Whether the ship has been on the new course as long as it took to get there."""
        settled = self._settled(trial)
        return settled is not None and settled <= 0.5 * (len(trial) - 1)

    def indices(self, trial: Trial, L_pp: float) -> Mapping[str, Index]:
        """Overshoot and final error [rad], rise and settling time [s], how quiet heading and rudder then are [rad].

        `overshoot` is the heading beyond the new course, `rise_time` when it is first reached,
        `settling_time` when the heading comes within 5 % of the change for good.  `heading_rms` and
        `rudder_rms` hold from there on: over the whole run without a change, over its second half where
        the ship never settles.
        """
        heading = turned(trial)
        out: dict[str, Index] = {}
        settled = self._settled(trial)
        if self.change:
            side = math.copysign(1.0, self.change)
            out["overshoot"] = Index(max(0.0, float(np.nanmax(side * (heading - self.change)))), "rad")
            moment = reached(side * heading, abs(self.change))
            if moment is not None:
                out["rise_time"] = Index(at(trial.t, moment) - float(trial.t[0]), "s")
            if settled is not None:
                out["settling_time"] = Index(float(trial.t[settled] - trial.t[0]), "s")
        rest = slice(len(trial) // 2 if settled is None else settled, None)
        error = heading[rest] - self.change
        out["final_error"] = Index(float(error[-1]), "rad")
        out["heading_rms"] = Index(rms(error), "rad")
        helm = helm_channel(trial)
        if helm in trial:
            out["rudder_rms"] = Index(rms(trial[helm][rest]), "rad", helm=1)
        return out

    def _settled(self, trial: Trial) -> int | None:
        """Row from which the heading stays within the band to the end; None where the end is outside."""
        if not self.change:
            return 0
        away = np.flatnonzero(np.abs(turned(trial) - self.change) > _BAND * abs(self.change))
        row = int(away[-1]) + 1 if away.size else 0
        return row if row < len(trial) else None
