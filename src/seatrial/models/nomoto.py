"""Nomoto's first-order model of steering with Norrbin's cubic term, at one speed or at several.

Sawada 2024 section 4.1.1.  Response models know yaw only: the speed through the water is held and
the ship does not drift.
"""

from __future__ import annotations

from itertools import pairwise

from ..core.parameters import ParameterError, Scalar, Scalars, Spec, Terms, spec, terms
from ..core.symbolic import clip, magnitude
from ..core.values import dataclass
from ..environment import Environment
from . import Model
from .common import Surroundings


def to_prime(K: Scalar, T: Scalar, L: Scalar, U: Scalar) -> tuple[Scalar, Scalar]:
    """K' and T' [-] from K [1/s] and T [s], length L [m] and speed U [m/s] (Sawada 2024 Eq. 7)."""
    return K * L / U, T * U / L  # (7)


def from_prime(K_prime: Scalar, T_prime: Scalar, L: Scalar, U: Scalar) -> tuple[Scalar, Scalar]:
    """K [1/s] and T [s] from K' and T' [-], length L [m] and speed U [m/s] (Sawada 2024 Eq. 7)."""
    return K_prime * U / L, T_prime * L / U  # (7)


@dataclass(frozen=True, kw_only=True)
class Nomoto(Model):
    """T r' + n_1 r + alpha r^3 = K (delta + delta_r) at a held speed through the water, without drift.

    Sawada 2024 Eqs. 6 and 8; alpha is c_3 there and n_3 elsewhere.  A ship that is unstable on a
    straight course has n_1 = -1 and positive K, T and alpha: it settles at r = +-1/sqrt(alpha) with the
    rudder amidships.  K and T hold at the speed U; at another one K grows with it and T falls with it,
    as their non-dimensional forms K L/U and T U/L stay.  alpha is taken as it is given.
    """

    K: Scalar = spec("1/s", "steady yaw rate over rudder angle at U")
    T: Scalar = spec("s", "time constant of the answer to the rudder at U; negative if unstable")
    U: Scalar = spec("m/s", "speed at which K and T hold", (1e-3, 100.0))
    alpha: Scalar = spec("s^2", "Norrbin's cubic term, per rad^2", default=0.0)
    n_1: Scalar = spec("-", "factor of the linear term: 1, or -1 for an unstable ship", default=1.0)
    delta_r: Scalar = spec("rad", "residual rudder: the angle that the ship feels amidships", default=0.0)

    def derivative(self, state: Scalars, control: Scalars, environment: Environment) -> Scalars:
        around = Surroundings.of(state, environment)
        ratio = around.u_r / self.U
        held = self.n_1 * around.r + self.alpha * around.r * around.r * around.r
        steady = self.K * ratio * (control[1] + self.delta_r)
        return around.rates((0.0, 0.0, magnitude(ratio) * (steady - held) / self.T))  # (8)


@dataclass(frozen=True, kw_only=True)
class NomotoTable(Model):
    """`Nomoto` with K and T tabulated over speed: linear in between, held beyond the ends.

    The three tables name the same speeds, slowest first, such as [speed] slow, full.
    """

    speed: Terms = terms(lambda name: Spec("m/s", f"the speed called {name}", 1e-3, 100.0))
    K: Terms = terms(lambda name: Spec("1/s", f"steady yaw rate over rudder angle at the speed called {name}"))
    T: Terms = terms(lambda name: Spec("s", f"time constant of the answer to the rudder at the speed called {name}"))
    alpha: Scalar = spec("s^2", "Norrbin's cubic term, per rad^2", default=0.0)
    n_1: Scalar = spec("-", "factor of the linear term: 1, or -1 for an unstable ship", default=1.0)
    delta_r: Scalar = spec("rad", "residual rudder: the angle that the ship feels amidships", default=0.0)

    def __post_init__(self) -> None:
        if not self.speed.names == self.K.names == self.T.names or not self.speed.names:
            raise ParameterError("speed, K and T must name the same speeds in the same order, at least one")
        known = [U for U in self.speed.numbers if isinstance(U, int | float)]
        if any(b <= a for a, b in pairwise(known)):
            raise ParameterError("the speeds of [speed] must rise from the first to the last")

    def at(self, U: Scalar) -> tuple[Scalar, Scalar]:
        """K [1/s] and T [s] at a speed U [m/s] through the water."""
        rows = tuple(zip(self.speed.numbers, self.K.numbers, self.T.numbers, strict=True))
        _, gain, time = rows[0]
        for before, here in pairwise(rows):
            share = clip((U - before[0]) / (here[0] - before[0]), 0.0, 1.0)
            gain = gain + share * (here[1] - before[1])
            time = time + share * (here[2] - before[2])
        return gain, time

    def derivative(self, state: Scalars, control: Scalars, environment: Environment) -> Scalars:
        around = Surroundings.of(state, environment)
        gain, time = self.at(around.u_r)
        # Below the slowest speed of the table the rudder loses its hold in proportion to the speed.
        way = clip(around.u_r / self.speed.numbers[0], -1.0, 1.0)
        held = self.n_1 * around.r + self.alpha * around.r * around.r * around.r
        steady = gain * way * (control[1] + self.delta_r)
        return around.rates((0.0, 0.0, magnitude(way) * (steady - held) / time))  # (8)
