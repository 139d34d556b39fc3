"""Ships of the garden: the standard MMG model (Yasukawa and Yoshimura 2015, JMST 20, 37-52) in plain Python floats.

`Ship` is what the simulator and the faults need of any; `others` has a low-speed model, twin screws and azimuths.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Protocol

from scipy.optimize import brentq


class Ship(Protocol):
    """What the simulator needs to know of a ship."""

    @property
    def name(self) -> str:
        """That of its ship file."""
        ...

    @property
    def length(self) -> float: ...

    @property
    def speed(self) -> float:
        """Of the approach [m/s]."""
        ...

    @property
    def rho(self) -> float: ...

    @property
    def controls(self) -> tuple[str, ...]: ...

    @property
    def gear(self) -> tuple[float, ...]:
        """How fast each control moves [rad/s or 1/s^2]."""
        ...

    @property
    def inner(self) -> tuple[str, ...]:
        """Further states that no log has, zero at the beginning; `rates` takes them last and gives theirs last."""
        ...

    @property
    def areas(self) -> Mapping[str, float] | None:
        """Above water; None for a ship that no wind moves."""
        ...

    @property
    def secret(self) -> Mapping[str, float]:
        """Coefficients of the truth that the ship file has wrong: path in the package, and by which factor."""
        ...

    def value(self, path: str) -> float:
        """A coefficient by its path in the package."""
        ...

    def having(self, values: Mapping[str, float]) -> Ship:
        """The same ship with other coefficients, by path."""
        ...

    def steered(self, turn: float, n: float) -> tuple[float, ...]:
        """Controls that steer, > 0 to starboard, by an angle [rad] at revolutions n [1/s]."""
        ...

    def rates(self, u: float, v: float, r: float, controls: tuple[float, ...], wind: tuple[float, float], *inner: float) -> tuple[float, ...]:  # noqa: E501
        """Rates of surge, sway and yaw through the water; `wind` are the components it comes from, apparent [m/s]."""
        ...


def revolutions(ship: Ship, speed: float) -> float:
    """Revolutions [1/s] that hold a speed [m/s] straight ahead in calm."""

    def net(n: float) -> float:
        return ship.rates(speed, 0.0, 0.0, ship.steered(0.0, n), (speed, 0.0))[0]

    return float(brentq(net, 0.2 * speed / ship.length, 300.0 * speed / ship.length, xtol=1e-13))


def held_speed(ship: Ship, n: float) -> float:
    """Speed [m/s] that revolutions hold straight ahead in calm."""

    def net(u: float) -> float:
        return ship.rates(u, 0.0, 0.0, ship.steered(0.0, n), (u, 0.0))[0]

    return float(brentq(net, 0.02 * ship.speed, 3.0 * ship.speed))


@dataclass(frozen=True)
class Mmg:
    """One propeller, one rudder.  Primed numbers as printed: forces over 0.5 rho L d U^2, masses over 0.5 rho L^2 d."""

    name: str
    length: float
    d: float
    volume: float
    x_G: float
    D_P: float
    A_R: float
    H_R: float
    w_P0: float
    speed: float
    rudder_rate: float
    shaft_rate: float
    rho: float = 1025.0
    hull: Mapping[str, float] = field(default_factory=lambda: dict(HULL))
    rudder: Mapping[str, float] = field(default_factory=lambda: dict(RUDDER))
    propeller: Mapping[str, float] = field(default_factory=lambda: dict(PROPELLER))
    areas: Mapping[str, float] | None = None
    still_air: bool = True
    controls: tuple[str, ...] = ("n_P", "delta")
    inner: tuple[str, ...] = ()
    added: tuple[float, float, float] = (0.022, 0.223, 0.011)

    def rates(
        self, u: float, v: float, r: float, controls: tuple[float, ...], wind: tuple[float, float], *inner: float
    ) -> tuple[float, ...]:
        return self._moved(u, v, r, self._driven(u, v, r, controls), wind)

    def _moved(
        self, u: float, v: float, r: float, driven: tuple[float, float, float], wind: tuple[float, float]
    ) -> tuple[float, float, float]:
        """Rates under forces of propeller and rudder."""
        L, rho, h = self.length, self.rho, self.hull
        m = rho * self.volume
        mass, inertia = 0.5 * rho * L**2 * self.d, 0.5 * rho * L**4 * self.d
        m_x, m_y, J_z = (share * whole for share, whole in zip(self.added, (mass, mass, inertia), strict=True))
        I_zG = m * (0.25 * L) ** 2
        U = math.hypot(u, v)
        v_, r_ = v / U, r * L / U
        X, Y, N = self._hull(v_, r_, 0.5 * rho * L * self.d * U * U, h)
        X, Y, N = X + driven[0], Y + driven[1], N + driven[2]
        if self.areas is not None:
            dX, dY, dN = blown(wind[0], wind[1], L, self.areas)
            # the drag of still air is in the resistance
            still = blown(u, v, L, self.areas) if self.still_air else (0.0, 0.0, 0.0)
            X, Y, N = X + dX - still[0], Y + dY - still[1], N + dN - still[2]
        # (m + m_x) u' = X + (m + m_y) v r + x_G m r^2, and the two coupled equations of sway and yaw
        lever = self.x_G * m
        du = (X + (m + m_y) * v * r + lever * r * r) / (m + m_x)
        a, b, c = m + m_y, lever, I_zG + self.x_G**2 * m + J_z
        p, q = Y - (m + m_x) * u * r, N - lever * u * r
        return du, (c * p - b * q) / (a * c - b * b), (a * q - b * p) / (a * c - b * b)

    def _driven(self, u: float, v: float, r: float, controls: tuple[float, ...]) -> tuple[float, float, float]:
        """Forces of propeller and rudder."""
        n, delta = controls
        T, turned = self._pushed(u, v, r, n, delta)
        return (1.0 - self.propeller["t_P"]) * T + turned[0], turned[1], turned[2]

    def _pushed(
        self, u: float, v: float, r: float, n: float, delta: float
    ) -> tuple[float, tuple[float, float, float]]:
        """Thrust of a propeller and forces of the rudder behind it, where the water comes from ahead at u."""
        U, beta = math.hypot(u, v), math.atan2(-v, u)
        r_ = r * self.length / U
        T, u_P, J2K = self._propeller(u, beta + 0.48 * r_, n)
        return T, self._rudder(U, beta, r_, delta, u_P, J2K)

    def _hull(self, v: float, r: float, q: float, h: Mapping[str, float]) -> tuple[float, float, float]:
        X = -h["R_0"] + h["X_vv"] * v**2 + h["X_vr"] * v * r + h["X_rr"] * r**2 + h["X_vvvv"] * v**4
        Y = h["Y_v"] * v + h["Y_r"] * r + h["Y_vvv"] * v**3 + h["Y_vvr"] * v**2 * r
        Y += h["Y_vrr"] * v * r**2 + h["Y_rrr"] * r**3
        N = h["N_v"] * v + h["N_r"] * r + h["N_vvv"] * v**3 + h["N_vvr"] * v**2 * r
        N += h["N_vrr"] * v * r**2 + h["N_rrr"] * r**3
        return q * X, q * Y, q * self.length * N

    def _propeller(self, u: float, beta_P: float, n: float) -> tuple[float, float, float]:
        """Thrust [N], inflow [m/s] and K_T/J^2 u_P^2 = K_T (n D)^2 [m^2/s^2]."""
        p = self.propeller
        C_2 = p["C_2p"] if beta_P > 0 else p["C_2n"]
        w = 1.0 - (1.0 - self.w_P0) * (1.0 + (1.0 - math.exp(-p["C_1"] * abs(beta_P))) * (C_2 - 1.0))
        u_P = (1.0 - w) * u
        if n == 0.0:
            return 0.0, u_P, 0.0
        J = u_P / (n * self.D_P)
        K_T = p["k_0"] + p["k_1"] * J + p["k_2"] * J * J
        return self.rho * n * n * self.D_P**4 * K_T, u_P, K_T * (n * self.D_P) ** 2

    def _rudder(
        self, U: float, beta: float, r: float, delta: float, u_P: float, K: float
    ) -> tuple[float, float, float]:
        s = self.rudder
        eta = self.D_P / self.H_R
        beta_R = beta + 0.71 * r
        v_R = U * (s["gamma_Rp"] if beta_R > 0 else s["gamma_Rn"]) * beta_R
        gain = math.sqrt(max(u_P * u_P + 8.0 * K / math.pi, 0.0)) - u_P
        u_R = s["epsilon"] * math.sqrt(eta * (u_P + s["kappa"] * gain) ** 2 + (1.0 - eta) * u_P * u_P)
        alpha = delta - math.atan2(v_R, u_R)
        F = 0.5 * self.rho * self.A_R * (u_R * u_R + v_R * v_R) * s["f_alpha"] * math.sin(alpha)
        L = self.length
        return (
            -(1.0 - s["t_R"]) * F * math.sin(delta),
            -(1.0 + s["a_H"]) * F * math.cos(delta),
            -(-0.5 * L + s["a_H"] * -0.464 * L) * F * math.cos(delta),
        )

    def altered(self, **values: float) -> Mmg:
        """The same ship with other coefficients of hull, rudder or propeller, by name."""
        groups = {name: dict(getattr(self, name)) for name in ("hull", "rudder", "propeller")}
        for key, value in values.items():
            [where] = [group for group in groups.values() if key in group]
            where[key] = value
        return replace(self, **groups)

    @property
    def gear(self) -> tuple[float, ...]:
        return tuple(self.rudder_rate if name.startswith("delta") else self.shaft_rate for name in self.controls)

    @property
    def secret(self) -> Mapping[str, float]:
        return ALTERED

    def value(self, path: str) -> float:
        group, _, name = path.partition(".")
        return getattr(self, group)[name]

    def having(self, values: Mapping[str, float]) -> Mmg:
        return self.altered(**{path.rpartition(".")[2]: value for path, value in values.items()})

    def steered(self, turn: float, n: float) -> tuple[float, ...]:
        return n, turn


def blown(u_A: float, v_A: float, length: float, a: Mapping[str, float]) -> tuple[float, float, float]:
    """Wind force of a loaded tanker (Blendermann 1994) for apparent wind components it comes from [m/s]."""
    U = math.hypot(u_A, v_A)
    if U < 1e-9:
        return 0.0, 0.0, 0.0
    C_t, kappa = 0.70, 0.40
    C_l = 0.55 if u_A < 0 else 0.90
    angle = math.atan2(v_A, u_A)
    ratio = C_l * a["A_T"] / a["A_L"]
    D = 1.0 - 0.5 * kappa * (1.0 - ratio / C_t) * math.sin(2.0 * angle) ** 2
    q = 0.5 * 1.225 * U * U * a["A_L"] / D
    Y = -q * C_t * math.sin(angle)
    lever = a["s_L"] - 0.18 * a["L_OA"] * (abs(angle) - 0.5 * math.pi)
    return -q * ratio * math.cos(angle), Y, lever * Y


HULL = {
    "R_0": 0.022, "X_vv": -0.040, "X_vr": 0.002, "X_rr": 0.011, "X_vvvv": 0.771,
    "Y_v": -0.315, "Y_r": 0.083, "Y_vvv": -1.607, "Y_vvr": 0.379, "Y_vrr": -0.391, "Y_rrr": 0.008,
    "N_v": -0.137, "N_r": -0.049, "N_vvv": -0.030, "N_vvr": -0.294, "N_vrr": 0.055, "N_rrr": -0.013,
}  # fmt: skip
RUDDER = {
    "t_R": 0.387, "a_H": 0.312, "epsilon": 1.09, "kappa": 0.50, "gamma_Rp": 0.640, "gamma_Rn": 0.395, "f_alpha": 2.747,
}  # fmt: skip
PROPELLER = {"t_P": 0.22, "C_1": 2.0, "C_2p": 1.6, "C_2n": 1.1, "k_0": 0.2931, "k_1": -0.2753, "k_2": -0.1385}

FULL = Mmg(
    "kvlcc2", 320.0, 20.8, 312600.0, 11.2, 9.86, 112.5, 15.8, 0.35, 15.5 * 1852.0 / 3600.0, math.radians(2.34), 0.02,
    areas={"A_T": 1540.0, "A_L": 3330.0, "L_OA": 333.0, "s_L": -15.0},
)  # fmt: skip
"""KVLCC2 at full scale, with the areas of a loaded tanker's upper works."""

MODEL = Mmg(
    "kvlcc2_l7", 7.0, 0.46, 3.27, 0.25, 0.216, 0.0539, 0.345, 0.40, 1.179, math.radians(15.8), 3.0, rho=1000.0
)
"""The 7 m model of the same ship."""

ALTERED = {
    "hull.R_0": 1.12, "hull.Y_v": 0.86, "hull.N_v": 1.10, "hull.N_r": 1.10, "hull.N_vvr": 0.85, "hull.Y_vvv": 1.15,
    "rudder.a_H": 1.20,
}  # fmt: skip


def truth(ship: Ship) -> Ship:
    """The ship that sails: seven coefficients differ from those that are published."""
    return ship.having(hidden(ship))


def hidden(ship: Ship) -> dict[str, float]:
    """The true value of each altered coefficient by its path in the package."""
    return {path: factor * ship.value(path) for path, factor in ship.secret.items()}
