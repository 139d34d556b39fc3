"""The family of Son and Nomoto (1981): a container ship that sways, turns and rolls, by one table of derivatives."""

from __future__ import annotations

import re
from functools import cache
from math import inf, pi

from ..core.parameters import PRIME, ParameterError, Scalar, Scalars, Spec, Terms, spec, terms
from ..core.symbolic import cos, larger, magnitude, sin, speed, where
from ..core.values import dataclass
from ..environment import Environment
from ..forces.propeller import race
from ..forces.rudder import signed_root
from .rolling import GRAVITY, Heeled, Rolling, lateral

_FORCES = {"X": "surge force", "Y": "sway force", "K": "roll moment", "N": "yaw moment"}
_GRAMMAR = re.compile(r"([XYKN])_((?:phi|[vrp])+)")
_FACTOR = re.compile(r"phi|[vrp]")
# Yaw rate r L_pp/U up to which terms are as printed, see `forces.hull`.
_FASTEST_TURN = 4.0


@cache
def factors(name: str) -> tuple[str, ...]:
    """The factors of a term, sorted: ("phi", "v", "v") for Y_vvphi.

    Raises:
        ParameterError: a name that is no term, or one that a ship with two equal sides cannot have.
    """
    found = _GRAMMAR.fullmatch(name)
    if found is None:
        raise ParameterError(
            f"no term '{name}'; a term is X, Y, K or N, an underscore and its factors out of v, r, p, phi, "
            "such as Y_vvr or K_vphiphi; the resistance is X_uu"
        )
    powers = tuple(sorted(_FACTOR.findall(found[2])))
    if (len(powers) % 2 == 1) == (found[1] == "X"):
        needs = f"{found[1]} needs an {'even' if found[1] == 'X' else 'odd'} number of factors"
        raise ParameterError(f"{name} breaks the symmetry of port and starboard: {needs}")
    return powers


def _meaning(name: str) -> Spec:
    powers = " ".join(factor if factor == "phi" else f"{factor}'" for factor in factors(name))
    return Spec(PRIME, f"{_FORCES[name[0]]} by {powers}")


@dataclass(frozen=True, kw_only=True)
class Body:
    """Size, masses and stability in primes: mass over 0.5 rho L^3, inertia over 0.5 rho L^5.

    The axes lie in the centre of gravity, which is midship.
    """

    L_pp: Scalar = spec("m", "length between perpendiculars", (1e-3, 1e3))
    B: Scalar = spec("m", "breadth; 0 where unknown", (0.0, 1e3), default=0.0)
    d: Scalar = spec("m", "draught", (1e-4, 100.0))
    volume: Scalar = spec("m^3", "displaced volume", (1e-9, inf))
    GM: Scalar = spec("m", "metacentric height", (-10.0, 100.0))
    m: Scalar = spec(PRIME, "mass", (1e-9, inf))
    m_x: Scalar = spec(PRIME, "added mass in surge", (0.0, inf))
    m_y: Scalar = spec(PRIME, "added mass in sway", (0.0, inf))
    I_x: Scalar = spec(PRIME, "moment of inertia in roll", (1e-12, inf))
    J_x: Scalar = spec(PRIME, "added moment of inertia in roll", (0.0, inf))
    I_z: Scalar = spec(PRIME, "moment of inertia in yaw", (1e-12, inf))
    J_z: Scalar = spec(PRIME, "added moment of inertia in yaw", (0.0, inf))
    alpha_y: Scalar = spec(PRIME, "where the added mass in sway acts, ahead of the centre of gravity, over L_pp")
    l_x: Scalar = spec(PRIME, "where the added mass in surge acts, below the centre of gravity, over L_pp")
    l_y: Scalar = spec(PRIME, "where the added mass in sway acts, below the centre of gravity, over L_pp")

    def acceleration(
        self, force: tuple[Scalar, Scalar, Scalar, Scalar], u: Scalar, v: Scalar, r: Scalar, phi: Scalar
    ) -> tuple[Scalar, Scalar, Scalar, Scalar]:
        """Rates of u, v_m [m/s^2], p and r [rad/s^2].

        `force` holds X, Y, K, N over 0.5 rho L^2 and, of moments, 0.5 rho L^3 [m^2/s^2]; u, v are velocities through
        the water [m/s] and r is the rate of turn times L_pp [m/s].
        """
        L = self.L_pp
        X, Y, K, N = force
        surge, sway = self.m + self.m_x, self.m + self.m_y
        righting = 2.0 * GRAVITY * self.volume * self.GM / (L * L * L) * phi
        ahead, below = self.m_y * self.alpha_y, self.m_y * self.l_y
        dv, dp, dr = lateral(
            (Y - surge * u * r, K + self.m_x * self.l_x * u * r - righting, N),
            ((sway, -below, ahead), (-below, self.I_x + self.J_x, 0.0), (ahead, 0.0, self.I_z + self.J_z)),
        )
        per = 1.0 / L
        return (X + sway * v * r) / (surge * L), dv * per, dp * per * per, dr * per * per


@dataclass(frozen=True, kw_only=True)
class Screw:
    """Propeller: u_P = u ((1 - w_P) + tau ((v' + x_P r')^2 + c_Pv v' + c_Pr r')), K_T = k_0 + k_1 J."""

    D_P: Scalar = spec("m", "diameter", (1e-4, 50.0))
    t_P: Scalar = spec("", "thrust deduction factor", (-0.5, 1.0))
    w_P: Scalar = spec("", "wake fraction in straight motion", (-0.5, 1.0))
    x_P: Scalar = spec(PRIME, "position ahead of midship, over L_pp")
    tau: Scalar = spec("", "how the wake falls with the square of the drift at the propeller")
    c_Pv: Scalar = spec("", "how the wake changes with v', one-sided", default=0.0)
    c_Pr: Scalar = spec("", "how the wake changes with r', one-sided", default=0.0)
    k_0: Scalar = spec("", "thrust coefficient at bollard pull", (0.0, 5.0))
    k_1: Scalar = spec("", "slope of the thrust coefficient over J")

    def race(self, u: Scalar, v: Scalar, r: Scalar, V: Scalar, n_P: Scalar) -> tuple[Scalar, Scalar]:
        """Inflow u_P [m/s] and K_T (n_P D_P)^2 [m^2/s^2]; r is times L_pp, V the speed that primes are by [m/s]."""
        drift = (v + self.x_P * r) / V
        change = drift * drift + (self.c_Pv * v + self.c_Pr * r) / V
        u_P = u * (1.0 - self.w_P + self.tau * change)
        return u_P, race(n_P, u_P, self.D_P, self.k_0, self.k_1, 0.0)


@dataclass(frozen=True, kw_only=True)
class Rudder:
    """Rudder in the race: v_R' = gamma v' + c_Rr r' + c_Rrrr r'^3 + c_Rrrv r'^2 v', normal force by Fujii."""

    A_R: Scalar = spec("m^2", "area", (0.0, 1e4))
    aspect: Scalar = spec("", "aspect ratio", (1e-3, 100.0))
    k: Scalar = spec("", "share of the race velocity that reaches the rudder", (0.0, 5.0))
    epsilon: Scalar = spec("", "ratio of 1 - w at the rudder to that at the propeller", (0.0, 5.0))
    gamma: Scalar = spec("", "flow straightening in sway")
    c_Rr: Scalar = spec(PRIME, "inflow by r'")
    c_Rrrr: Scalar = spec(PRIME, "inflow by r'^3")
    c_Rrrv: Scalar = spec(PRIME, "inflow by r'^2 v'")
    c_RX: Scalar = spec("", "share of the normal force that brakes")
    a_H: Scalar = spec("", "rudder force induced on the hull, as a ratio", (-1.0, 5.0))
    x_R: Scalar = spec(PRIME, "position ahead of midship, over L_pp")
    x_H: Scalar = spec(PRIME, "position of the induced force ahead of midship, over L_pp")
    z_R: Scalar = spec(PRIME, "position below the centre of gravity, over L_pp")

    def force(
        self, u_P: Scalar, pull: Scalar, v: Scalar, r: Scalar, V: Scalar, delta: Scalar, L: Scalar
    ) -> tuple[Scalar, Scalar, Scalar, Scalar]:
        """X, Y, K, N over 0.5 rho L^2 and 0.5 rho L^3 [m^2/s^2]; `pull` is K_T (n_P D_P)^2."""
        u_R = self.epsilon * signed_root(u_P * magnitude(u_P) + 8.0 / pi * self.k * pull)
        turn = r * r / (V * V)
        v_R = (self.gamma + self.c_Rrrv * turn) * v + (self.c_Rr + self.c_Rrrr * turn) * r
        across = u_R * sin(delta) + v_R * cos(delta)  # U_R sin(alpha_R)
        slope = 6.13 * self.aspect / (self.aspect + 2.25) * self.A_R / (L * L)
        F_N = -slope * speed(u_R, v_R) * across
        Y = (1.0 + self.a_H) * F_N * cos(delta)
        N = (self.x_R + self.a_H * self.x_H) * F_N * cos(delta)
        return self.c_RX * F_N * sin(delta), Y, -self.z_R * Y, N


@dataclass(frozen=True, kw_only=True)
class SonNomoto(Rolling):
    """X, Y, K, N by derivatives in v' = v_m/U, r' = r L_pp/U, p' = p L_pp/U and phi, with propeller and rudder.

    Forces over 0.5 rho L^2 U^2, moments over 0.5 rho L^3 U^2, U the speed through the water at the instant; a term is
    named by its force and its factors (Y_vvphi, K_p).  Written with velocities, so that a term without a cube needs
    no division and the ship is silent at rest; the source divides by U and by n_P.  Turning on the spot, beyond
    r' = 4, cubic terms are those at r' = 4; astern the resistance turns round, and nothing was fitted there.
    The righting moment is linear in the heel.
    """

    body: Body
    screw: Screw
    rudder: Rudder
    X_uu: Scalar = spec(PRIME, "surge force by u'^2: minus the resistance", (-1.0, 0.0))
    derivatives: Terms = terms(_meaning)

    def __post_init__(self) -> None:
        seen: dict[tuple[str, ...], str] = {}
        for name in self.derivatives.names:
            twin = seen.setdefault((name[0], *factors(name)), name)
            if twin != name:
                raise ParameterError(f"derivatives: {twin} and {name} are the same term; keep one of them")

    @property
    def asymmetries(self) -> tuple[str, ...]:
        """What changes the wake to one side."""
        return "screw.c_Pv", "screw.c_Pr"

    @property
    def draught(self) -> Scalar:
        return self.body.d

    @property
    def breadth(self) -> Scalar:
        return self.body.B

    def derivative(self, state: Scalars, control: Scalars, environment: Environment) -> Scalars:
        heeled = Heeled.of(state, environment)
        u, v, r = heeled.around.u_r, heeled.around.v_r, heeled.around.r * self.body.L_pp
        force = self.force(u, v, r, heeled.p * self.body.L_pp, heeled.phi, control[0], control[1])
        return heeled.rates(*self.body.acceleration(force, u, v, r, heeled.phi))

    def force(
        self, u: Scalar, v: Scalar, r: Scalar, p: Scalar, phi: Scalar, n_P: Scalar, delta: Scalar
    ) -> tuple[Scalar, Scalar, Scalar, Scalar]:
        """X, Y, K, N over 0.5 rho L^2 and 0.5 rho L^3 [m^2/s^2]; r and p are times L_pp [m/s]."""
        L, D = self.body.L_pp, self.screw.D_P
        U = speed(u, v)
        V = larger(U, magnitude(r) / _FASTEST_TURN)
        sums = self._hull(U, V, {"v": v, "r": r, "p": p, "phi": phi})
        u_P, pull = self.screw.race(u, v, r, V, n_P)
        X, Y, K, N = self.rudder.force(u_P, pull, v, r, V, delta, L)
        thrust = (1.0 - self.screw.t_P) * 2.0 * (D / L) * (D / L) * pull
        ahead = where(u < 0, -self.X_uu, self.X_uu) * u * u
        return sums["X"] + ahead + thrust + X, sums["Y"] + Y, sums["K"] + K, sums["N"] + N

    def _hull(self, U: Scalar, V: Scalar, of: dict[str, Scalar]) -> dict[str, Scalar]:
        """Sums of the terms [m^2/s^2]: each times U^2 over U once for each of its velocities."""
        squares = (U * U, U, 1.0, 1.0 / V)
        sums: dict[str, Scalar] = {"X": 0.0, "Y": 0.0, "K": 0.0, "N": 0.0}
        for name, number in self.derivatives.items():
            product, velocities = number, 0
            for factor in factors(name):
                product, velocities = product * of[factor], velocities + (factor != "phi")
            scale = squares[velocities] if velocities < 4 else squares[3] / V ** (velocities - 3)
            sums[name[0]] = sums[name[0]] + product * scale
        return sums
