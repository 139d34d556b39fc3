"""The Abkowitz family: the whole ship as one polynomial about a straight run, its terms named by the ship file."""

from __future__ import annotations

import re
from functools import cache
from math import inf

from ..core.parameters import PRIME, ParameterError, Scalar, Scalars, Spec, Terms, choice, spec, terms
from ..core.symbolic import larger, speed
from ..core.values import dataclass
from ..environment import Environment
from ..forces import Flow
from . import Model
from .common import Loads, Surroundings

_FACTORS = {"u": "u'", "v": "v'", "r": "r'", "d": "delta"}
_FORCES = {"X": "surge force", "Y": "sway force", "N": "yaw moment"}
_GRAMMAR = re.compile(r"([XYN])_(0?)([uvrd]*)")


@cache
def factors(name: str) -> str:
    """The factors of a term, sorted: "rvv" for Y_vvr, "" for Y_0, "uu" for Y_0uu.

    Raises:
        ParameterError: a name that is no term, or one that a ship with two equal sides cannot have.
    """
    found = _GRAMMAR.fullmatch(name)
    if found is None or not (found[2] or found[3]):
        raise ParameterError(
            f"no term '{name}'; a term is X, Y or N, an underscore and its factors out of u, v, r, d (delta), "
            "such as Y_vvr or N_ddd; X_0, Y_0, N_0, Y_0u, N_0uu are the constants and what u' makes of them"
        )
    force, constant, powers = found.groups()
    odd = sum(powers.count(side) for side in "vrd") % 2 == 1
    if constant and (powers.strip("u") or (force == "X" and powers)):
        raise ParameterError(f"no term '{name}'; write {force}_{powers}: only Y_0 and N_0 take factors, and only u")
    if force == "X" and odd:
        raise ParameterError(
            f"{name} breaks the symmetry of port and starboard: X needs an even number of factors v, r, d"
        )
    if force != "X" and not odd and not constant:
        cure = f"; the bias of a single screw is written {force}_0{powers}" if not powers.strip("u") else ""
        raise ParameterError(
            f"{name} breaks the symmetry of port and starboard: {force} needs an odd number of factors v, r, d{cure}"
        )
    return "".join(sorted(powers))


def _meaning(name: str) -> Spec:
    powers = " ".join(_FACTORS[factor] for factor in factors(name))
    return Spec(PRIME, f"{_FORCES[name[0]]} by {powers}" if powers else f"constant {_FORCES[name[0]]}")


@dataclass(frozen=True, kw_only=True)
class Body:
    """Masses of an Abkowitz ship in primes: mass over 0.5 rho L^3, inertia over 0.5 rho L^5, origin midship.

    `coriolis` selects whether m u r, m v r and m x_G r^2 are still to be added ("explicit", Sawada 2024 Eq. 17), or
    lie in Y_r, N_r, X_vr and X_rr of the file already ("absorbed"), as tables fitted to whole forces have them.
    """

    L_pp: Scalar = spec("m", "length between perpendiculars", (1e-3, 1e3))
    m: Scalar = spec(PRIME, "mass", (1e-9, inf))
    I_z: Scalar = spec(PRIME, "moment of inertia in yaw about midship", (1e-9, inf))
    x_G: Scalar = spec(PRIME, "centre of gravity ahead of midship, over L_pp")
    X_udot: Scalar = spec(PRIME, "surge force by surge acceleration: minus the added mass", (-inf, 0.0))
    Y_vdot: Scalar = spec(PRIME, "sway force by sway acceleration: minus the added mass", (-inf, 0.0))
    Y_rdot: Scalar = spec(PRIME, "sway force by yaw acceleration")
    N_vdot: Scalar = spec(PRIME, "yaw moment by sway acceleration")
    N_rdot: Scalar = spec(PRIME, "yaw moment by yaw acceleration: minus the added inertia", (-inf, 0.0))
    coriolis: str = choice("terms of the turning axes", ("explicit", "absorbed"), "explicit")

    def acceleration(
        self, force: tuple[Scalar, Scalar, Scalar], u: Scalar, v: Scalar, r: Scalar
    ) -> tuple[Scalar, Scalar, Scalar]:
        """Rates of u, v_m [m/s^2] and r [rad/s^2].

        `force` holds (X, Y, N) over 0.5 rho L^2, 0.5 rho L^2 and 0.5 rho L^3 [m^2/s^2]; u, v [m/s] are velocities
        through the water and r is the rate of turn times L_pp [m/s].
        """
        lever = self.m * self.x_G
        turning = 1.0 if self.coriolis == "explicit" else 0.0
        X = force[0] + turning * (self.m * v * r + lever * r * r)  # (17)
        Y = force[1] - turning * self.m * u * r
        N = force[2] - turning * lever * u * r
        m_22, m_23 = self.m - self.Y_vdot, lever - self.Y_rdot
        m_32, m_33 = lever - self.N_vdot, self.I_z - self.N_rdot
        rate = 1.0 / ((m_22 * m_33 - m_32 * m_23) * self.L_pp)
        return (  # (16)
            X / ((self.m - self.X_udot) * self.L_pp),
            (m_33 * Y - m_23 * N) * rate,
            (m_22 * N - m_32 * Y) * rate / self.L_pp,
        )


    def pushed(self, push: tuple[Scalar, Scalar, Scalar]) -> tuple[Scalar, Scalar, Scalar]:
        """Rates at rest under a force and a moment over the ship's own mass, see `Model.pushed`."""
        length = self.m * self.L_pp
        return self.acceleration((length * push[0], length * push[1], self.m * push[2]), 0.0, 0.0, 0.0)

    def restrained(self, force: tuple[Scalar, Scalar, Scalar], flow: Flow, rates: Scalars) -> Loads:
        """Loads of a captive test, from forces as `acceleration` takes them.

        Tables whose terms of the turning axes are "absorbed" hold those of the model's own mass too, which are
        no force of the water: they are taken out again.
        """
        L, v, r = flow.L_pp, flow.v_m, flow.r * flow.L_pp
        du, dv, dr = rates[0] * L, rates[1] * L, rates[2] * L * L
        own = self.m if self.coriolis == "absorbed" else 0.0
        X = force[0] + self.X_udot * du - own * (v * r + self.x_G * r * r)
        Y = force[1] + self.Y_vdot * dv + self.Y_rdot * dr + own * flow.u * r
        N = force[2] + self.N_vdot * dv + self.N_rdot * dr + own * self.x_G * flow.u * r
        area = 0.5 * flow.rho * L * L
        return Loads(area * X, area * Y, area * L * N)


@dataclass(frozen=True, kw_only=True)
class Abkowitz(Model):
    """X, Y, N as polynomials in u' = (u - U_0)/U, v' = v_m/U, r' = r L_pp/U and delta (Sawada 2024 Eqs. 15 to 17).

    Forces over 0.5 rho L^2 U^2, the moment over 0.5 rho L^3 U^2, U the speed through the water at the instant.
    A term is named by its force and its factors, in any order and to any degree: Y_vvr, N_ddd; the number is what
    multiplies the product, with the factorials of the series in it.

    It holds about the straight run at U_0 with the revolutions of that run: n_P does not enter, so neither do a
    stopping engine, nor wind.  Below U_low the polynomial is held at its value there (u' and the divisor
    no longer fall) and fades with U^2, so that it is finite and silent at rest; it is no physics there.
    """

    body: Body
    U_0: Scalar = spec("m/s", "speed of the straight run that the derivatives belong to", (1e-3, 100.0))
    U_low: Scalar = spec("m/s", "speed below which the polynomial is held and fades", (1e-3, 100.0))
    derivatives: Terms = terms(_meaning)

    def __post_init__(self) -> None:
        seen: dict[str, str] = {}
        for name in self.derivatives.names:
            twin = seen.setdefault(name[0] + factors(name), name)
            if twin != name:
                raise ParameterError(f"derivatives: {twin} and {name} are the same term; keep one of them")

    @property
    def asymmetries(self) -> tuple[str, ...]:
        return tuple(f"derivatives.{name}" for name in self.derivatives.names if name[:3] in ("Y_0", "N_0"))

    def derivative(self, state: Scalars, control: Scalars, environment: Environment) -> Scalars:
        around = Surroundings.of(state, environment)
        u, v, r = around.u_r, around.v_r, around.r * self.body.L_pp
        return around.rates(self.body.acceleration(self.force(u, v, r, control[1]), u, v, r))

    def pushed(self, push: Scalars) -> Scalars:
        return self.body.pushed((push[0], push[1], push[2]))

    def loads(self, flow: Flow, rates: Scalars) -> Loads:
        """What a captive test measures."""
        u, v, r = flow.u, flow.v_m, flow.r * flow.L_pp
        return self.body.restrained(self.force(u, v, r, flow.delta), flow, rates)

    def force(self, u: Scalar, v: Scalar, r: Scalar, delta: Scalar) -> tuple[Scalar, Scalar, Scalar]:
        """X, Y, N over 0.5 rho L^2, 0.5 rho L^2, 0.5 rho L^3 [m^2/s^2]; r is the rate of turn times L_pp [m/s]."""
        U = speed(u, v)
        per = 1.0 / larger(U, self.U_low)
        of = {"u": (larger(u, self.U_low) - self.U_0) * per, "v": v * per, "r": r * per, "d": delta}
        sums: dict[str, Scalar] = {"X": 0.0, "Y": 0.0, "N": 0.0}
        for name, number in self.derivatives.items():
            product = number
            for factor in factors(name):
                product = product * of[factor]
            sums[name[0]] = sums[name[0]] + product
        square = u * u + v * v
        return square * sums["X"], square * sums["Y"], square * sums["N"]
