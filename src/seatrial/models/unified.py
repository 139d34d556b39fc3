"""The unified model: manoeuvring of the MMG family with roll, and heave, pitch and the memory of radiated waves.

Fossen (2005) and Perez and Fossen (2008): one set of equations for manoeuvring and seakeeping.  Slow motions are those
of `mmg_roll:MmgRoll`, whose added masses are the ones at zero frequency; what added mass and damping vary with the
frequency is the memory of `forces.radiation`, which is silent in a steady run.  So in calm water a steady turn is that
of the ship without it, and small motions in waves are those of the frequency domain.

Rotations and heave are about midship at the height of the centre of gravity, in axes that head with the ship and stay
level: w is the rate of heave, q that of pitch.  Radiation is that of zero speed.
"""

from __future__ import annotations

from math import inf

from ..core.parameters import ParameterError, Parts, Scalar, Scalars, parts, spec
from ..core.values import dataclass
from ..environment import Environment, InWaves
from ..forces.radiation import Lateral, Longitudinal, Three
from ..forces.shallow import afloat
from . import ROLL, STATES
from .mmg_roll import MmgRoll
from .rolling import GRAVITY, Heeled, lateral

HEAVING = ("z", "w", "theta", "q")
"""Heave [m] and its rate [m/s], down; pitch [rad], bow up, and its rate [rad/s]: behind those of a rolling ship."""


@dataclass(frozen=True, kw_only=True)
class Heave:
    """Inertia and stiffness of heave and pitch, and added masses that manoeuvring does not know.

    With respect to midship at the height of the centre of gravity; A at infinite frequency for heave and pitch, at zero
    for sway, roll and yaw, as the ship's own m_y, J_x and J_z are.
    """

    I_y: Scalar = spec("kg m^2", "moment of inertia in pitch", (1e-9, inf))
    A_13: Scalar = spec("kg", "added mass, surge by heave", default=0.0)
    A_15: Scalar = spec("kg m", "added mass, surge by pitch", default=0.0)
    A_33: Scalar = spec("kg", "added mass in heave", (0.0, inf))
    A_35: Scalar = spec("kg m", "added mass, heave by pitch", default=0.0)
    A_55: Scalar = spec("kg m^2", "added moment of inertia in pitch", (0.0, inf))
    A_26: Scalar = spec("kg m", "added mass, sway by yaw", default=0.0)
    A_46: Scalar = spec("kg m^2", "added moment of inertia, roll by yaw", default=0.0)
    C_33: Scalar = spec("N/m", "stiffness in heave: weight of the water plane", (0.0, inf))
    C_35: Scalar = spec("N", "stiffness, heave by pitch", default=0.0)
    C_55: Scalar = spec("N m", "stiffness in pitch", (0.0, inf))
    B_33: Scalar = spec("kg/s", "damping in heave besides that of waves", (0.0, inf), default=0.0)
    B_55: Scalar = spec("kg m^2/s", "damping in pitch besides that of waves", (0.0, inf), default=0.0)


@dataclass(frozen=True, kw_only=True)
class Unified(MmgRoll):
    """A ship of the MMG family in six degrees of freedom, with the memory of its waves.

    Its states are those of the ship that rolls, `HEAVING`, then of each section of the memory h and y of its three
    motions.  First-order wave forces come with an environment `InWaves`.
    """

    heave: Heave
    longitudinal: Parts = parts("memory")
    transverse: Parts = parts("memory")

    def __post_init__(self) -> None:
        MmgRoll.__post_init__(self)
        for name, cls in (("longitudinal", Longitudinal), ("transverse", Lateral)):
            for part in getattr(self, name).components:
                if type(part) is not cls:
                    raise ParameterError(f"{name}: a section of the memory is a radiation:{cls.__name__}")

    @property
    def states(self) -> tuple[str, ...]:  # type: ignore[override]
        groups = (("u", "w", "q", self.longitudinal), ("v", "p", "r", self.transverse))
        own = (f"{what}_{name}_{k + 1}" for *motions, sections in groups for k in range(len(sections.components))
               for what in ("h", "y") for name in motions)  # fmt: skip
        return (*STATES, *ROLL, *HEAVING, *own)

    @property
    def sides(self) -> tuple[int, ...]:
        own = len(self.longitudinal.components), len(self.transverse.components)
        return (-1, -1, *(1,) * len(HEAVING), *(1,) * (6 * own[0]), *(-1,) * (6 * own[1]))

    def derivative(self, state: Scalars, control: Scalars, environment: Environment | InWaves) -> Scalars:
        still: Scalars = (0.0,) * 6
        around = environment.calm if isinstance(environment, InWaves) else environment
        waves = environment.forces if isinstance(environment, InWaves) else still
        heeled = Heeled.of(state[:8], around)
        flow = heeled.flow(self.body, control[0], control[1])
        force, driving = self.rolling(flow, heeled.phi, control[2:])
        righting = self.roll.moment(heeled.phi, heeled.p, flow.u, self.body.m * GRAVITY)
        z, w, theta, q = state[8:12]
        split = 12 + 6 * len(self.longitudinal.components)
        along, vertical = self._remembered(self.longitudinal, state[12:split])
        aside, across = self._remembered(self.transverse, state[split:])
        heave, body, roll = self.heave, afloat(self.body, self.hull, flow), self.roll
        u, v_m, r = flow.u, flow.v_m, flow.r
        lever = body.x_G * body.m
        X = force.X + (body.m + body.m_y) * v_m * r + lever * r * r
        Z = -heave.C_33 * z - heave.C_35 * theta - heave.B_33 * w
        M = -heave.C_35 * z - heave.C_55 * theta - heave.B_55 * q
        slow, fast = _slow(self.longitudinal), _slow(self.transverse)
        du, dw, dq = lateral(
            (X + along[0] + waves[0], Z + along[1] + waves[2], M + along[2] + waves[4]),
            (
                (body.m + body.m_x - slow[0], heave.A_13, heave.A_15),
                (heave.A_13, body.m + heave.A_33, heave.A_35 - lever),
                (heave.A_15, heave.A_35 - lever, heave.I_y + heave.A_55),
            ),
        )
        surge, below = body.m + body.m_x, -body.m_y * roll.l_y - fast[1]
        far, yaw = lever + heave.A_26 - fast[2], heave.A_46 - fast[4]
        dv, dp, dr = lateral(
            (force.Y - surge * u * r + aside[0] + waves[1],
             driving + righting + body.m_x * roll.l_x * u * r + aside[1] + waves[3],
             force.N - lever * u * r + aside[2] + waves[5]),
            (
                (body.m + body.m_y - fast[0], below, far),
                (below, roll.I_x + roll.J_x - fast[3], yaw),
                (far, yaw, body.I_zG + body.x_G * lever + body.J_z - fast[5]),
            ),
        )  # fmt: skip
        rates = heeled.rates(du, dv, dp, dr)
        return (*rates, w, dw, q, dq, *_changed(self.longitudinal, vertical, (du, dw, dq)),
                *_changed(self.transverse, across, (dv, dp, dr)))  # fmt: skip

    def _remembered(self, sections: Parts, state: Scalars) -> tuple[Three, list[tuple[Three, Three]]]:
        """Force of the memory, and h and y of each of its sections."""
        total: Three = (0.0, 0.0, 0.0)
        kept: list[tuple[Three, Three]] = []
        for k, section in enumerate(sections.components):
            h, y = _three(state, 6 * k), _three(state, 6 * k + 3)
            one = section.answer(h, y)
            total = (total[0] + one[0], total[1] + one[1], total[2] + one[2])
            kept.append((h, y))
        return total, kept


def _three(state: Scalars, at: int) -> Three:
    return state[at], state[at + 1], state[at + 2]


def _slow(sections: Parts) -> Scalars:
    """Added mass that the memory gives to slow motions, in the order of `radiation.weighed`."""
    total: Scalars = (0.0,) * 6
    for section in sections.components:
        total = tuple(a + b for a, b in zip(total, section.slow, strict=True))
    return total


def _changed(sections: Parts, kept: list[tuple[Three, Three]], acceleration: Three) -> Scalars:
    rates: list[Scalar] = []
    for section, (h, y) in zip(sections.components, kept, strict=True):
        rates += section.rates(h, y, acceleration)
    return tuple(rates)
