"""Further ships of the garden: a 3 m model with cross-flow drag, a tanker with twin screws, a tug with two azimuths.

Equations from Sawada et al. (2024), appendix, and You et al. (2023), section 2, in plain Python floats.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from .ships import PROPELLER, RUDDER, Mmg, blown

Three = tuple[float, float, float]
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)


def _solved(mass: float, m_y: float, lever: float, inertia: float, force: Three, u: float, v: float, r: float) -> Three:
    """Rates of a body with masses `mass` in surge and `m_y` in sway, and x_G m = `lever`."""
    X, Y, N = force
    du = (X + m_y * v * r + lever * r * r) / mass
    p, q = Y - mass * u * r, N - lever * u * r
    D = m_y * inertia - lever * lever
    return du, (inertia * p - lever * q) / D, (m_y * q - lever * p) / D


@dataclass(frozen=True)
class LowSpeed:
    """Low-speed MMG model (Sawada 2024, Eqs. 36-62), propeller ahead only; `numbers` by path, as printed."""

    numbers: Mapping[str, float]
    name: str = "esso_osaka_3m"
    length: float = 3.0
    d: float = 0.20114
    speed: float = 0.397
    rho: float = 998.0
    rudder_rate: float = math.radians(20.0)
    shaft_rate: float = 5.0
    controls: tuple[str, ...] = ("n_P", "delta")
    inner: tuple[str, ...] = ()
    areas: Mapping[str, float] | None = field(default_factory=lambda: {"A_T": 0.13544, "A_L": 0.52038})
    secret: Mapping[str, float] = field(default_factory=lambda: {
        "hull.X_0F": 1.12, "hull.Y_v": 0.86, "hull.N_v": 1.10, "hull.N_r": 1.12, "hull.C_D": 0.85, "hull.Y_r": 1.20,
        "rudder.a_H": 1.20,
    })  # fmt: skip

    @property
    def gear(self) -> tuple[float, ...]:
        return self.shaft_rate, self.rudder_rate

    def value(self, path: str) -> float:
        return self.numbers[path]

    def having(self, values: Mapping[str, float]) -> LowSpeed:
        return replace(self, numbers={**self.numbers, **values})

    def steered(self, turn: float, n: float) -> tuple[float, ...]:
        return n, turn

    def rates(
        self, u: float, v: float, r: float, controls: tuple[float, ...], wind: tuple[float, float], *_: float
    ) -> Three:
        c, L, rho = self.numbers, self.length, self.rho
        mass, area = 0.5 * rho * L * L * self.d, 0.5 * rho * L * self.d
        m, x_G = 0.27078 * mass, 0.03119 * L
        force = [a + b + w for a, b, w in zip(self._hull(u, v, r * L, area, c), self._driven(u, v, r, controls, c),
                                              fujiwara(*wind, L, self.areas), strict=True)]  # fmt: skip
        inertia = 0.0286 * mass * L * L + x_G * x_G * m
        return _solved(m + 0.0467 * mass, m + 0.2579 * mass, x_G * m, inertia, tuple(force), u, v, r)

    def _hull(self, u: float, v: float, r: float, area: float, c: Mapping[str, float]) -> Three:
        """(38); r is the speed of the bow for half the rate, r L [m/s]."""
        ahead, astern = c["hull.X_0F"], -0.03189
        X_0 = ahead + (astern - ahead) * math.atan2(abs(v), u) / math.pi
        force, moment = (self._strips(v, c[f"hull.C_r{which}"] * r, k) for k, which in enumerate("YN"))
        return (
            area * (X_0 * u * math.hypot(u, v) - 0.0081 * v * r),
            area * (c["hull.Y_v"] * v * abs(u) + c["hull.Y_r"] * r * u - c["hull.C_D"] * force),
            area * self.length * (c["hull.N_v"] * v * u + c["hull.N_r"] * r * abs(u) - c["hull.C_D"] * moment),
        )

    @staticmethod
    def _strips(v: float, k: float, power: int) -> float:
        """Integral of |v + k x| (v + k x) x^power over x from -1/2 to 1/2, split where the cross flow turns."""
        ends = [-0.5, 0.5] if not k or abs(v / k) >= 0.5 else [-0.5, -v / k, 0.5]
        total = 0.0
        for a, b in pairwise(ends):
            for node, weight in zip(_NODES, _WEIGHTS, strict=True):
                x = 0.5 * (a + b) + 0.5 * (b - a) * node
                total += 0.5 * (b - a) * weight * abs(v + k * x) * (v + k * x) * x**power
        return total

    def _driven(self, u: float, v: float, r: float, controls: tuple[float, ...], c: Mapping[str, float]) -> Three:
        n, delta = controls
        L, D, U = self.length, 0.084, math.hypot(u, v)
        drift = (v - 0.517 * L * r) / U
        u_P = min(max(1.0 - 0.614 + 0.871 * abs(drift) - 0.359 * drift * drift, 0.0), 1.0) * u  # (40)
        K = 0.3278 * (n * D) ** 2 - 0.3323 * n * D * u_P - 0.156 * u_P * u_P
        gain = math.sqrt(max(u_P * u_P + 8.0 * K / math.pi, 0.0)) - u_P
        eta, epsilon = D / math.sqrt(1.539 * 0.01063), c["rudder.epsilon"]
        u_R = epsilon * math.sqrt(eta * (u_P + c["rudder.k_x"] / epsilon * gain) ** 2 + (1.0 - eta) * u_P * u_P)  # (56)
        v_R = -(c["rudder.gamma_P"] if v - 0.5 * L * r >= 0 else c["rudder.gamma_N"]) * (v - 1.08 * L * r)  # (55)
        slope = 6.13 * 1.539 / (2.25 + 1.539)  # (52)
        F = 0.5 * self.rho * 0.01063 * slope * (u_R**2 + v_R**2) * math.sin(delta - math.atan2(v_R, u_R))
        a_H, across = c["rudder.a_H"], F * math.cos(delta)
        pull = (1.0 - c["propeller.t_P"]) * self.rho * D * D * K
        return pull - (1.0 - 0.19) * F * math.sin(delta), -(1.0 + a_H) * across, (0.5 + 0.45 * a_H) * L * across


def fujiwara(u_A: float, v_A: float, L: float, areas: Mapping[str, float] | None) -> Three:
    """Wind force on the 3 m model (61), (62) for apparent wind components it comes from [m/s]."""
    if areas is None:
        return 0.0, 0.0, 0.0
    q, angle = 0.5 * 1.225 * (u_A**2 + v_A**2), 2.0 * math.pi - math.atan2(v_A, u_A)
    X = -0.010466204998894729 - 0.8219919564319996 * math.cos(angle)
    X += 0.06027361325749792 * math.cos(3.0 * angle) + 0.0445582213610391 * math.cos(5.0 * angle)
    Y = 1.0581720825172258 * math.sin(angle) + 0.0023214632949092665 * math.sin(3.0 * angle)
    Y += -0.015293451706738998 * math.sin(5.0 * angle)
    N = -0.030727798087409615 * math.sin(angle) + 0.10411637035092244 * math.sin(2.0 * angle)
    N += -0.0008803014758436215 * math.sin(3.0 * angle)
    return q * areas["A_T"] * X, q * areas["A_L"] * Y, q * areas["A_L"] * L * N


ESSO = LowSpeed({
    "hull.X_0F": -0.02139, "hull.Y_v": -0.3728, "hull.Y_r": 0.116, "hull.N_v": -0.1458, "hull.N_r": -0.04849,
    "hull.C_D": 0.9665, "hull.C_rY": 2.217, "hull.C_rN": 0.8097, "rudder.a_H": 0.393, "rudder.epsilon": 1.42,
    "rudder.k_x": 0.288, "rudder.gamma_P": 0.3506, "rudder.gamma_N": 0.4406, "propeller.t_P": 0.22,
})  # fmt: skip
"""Esso Osaka, model of 3 m."""


@dataclass(frozen=True)
class Twin(Mmg):
    """Two propellers and two rudders, mirror images, each in the surge velocity of its own place."""

    beside: float = 0.3175
    controls: tuple[str, ...] = ("n_P_1", "n_P_2", "delta_1", "delta_2")

    def steered(self, turn: float, n: float) -> tuple[float, ...]:
        return n, n, turn, turn

    def _driven(self, u: float, v: float, r: float, controls: tuple[float, ...]) -> Three:
        total = np.zeros(3)
        for n, delta, side in zip(controls[:2], controls[2:], (-1.0, 1.0), strict=True):
            hand, y = -side, side * self.beside  # the starboard side is the port side in a mirror
            T, (X, Y, N) = self._pushed(u - y * r, hand * v, hand * r, n, hand * delta)
            X += (1.0 - self.propeller["t_P"]) * T
            total += X, hand * Y, hand * N - y * X
        return float(total[0]), float(total[1]), float(total[2])


TWIN = Twin(
    "twin_virtual", 7.0, 0.46, 3.27, 0.25, 0.216 / math.sqrt(2.0), 0.02695, 0.345 / math.sqrt(2.0), 0.40, 1.179,
    math.radians(15.8), 3.0, rho=1000.0, rudder={**RUDDER, "gamma_Rp": 0.5175, "gamma_Rn": 0.5175},
    propeller={**PROPELLER, "C_2p": 1.35, "C_2n": 1.35},
    areas={"A_T": 0.737, "A_L": 1.593, "L_OA": 7.284, "s_L": -0.328}, still_air=False,
)  # fmt: skip
"""The 7 m model of KVLCC2 with its propeller and rudder split in two."""


@dataclass(frozen=True)
class Tug:
    """Surge-decoupled model of 22 parameters (You 2023, Eqs. 1-5), two stern azimuths (Eqs. 7, 8, 20); by path."""

    numbers: Mapping[str, float]
    name: str = "qiuxin5"
    length: float = 2.152
    speed: float = 0.9
    rho: float = 1000.0
    controls: tuple[str, ...] = ("n_1", "alpha_1", "n_2", "alpha_2")
    inner: tuple[str, ...] = ()
    gear: tuple[float, ...] = (2.0, 0.1151, 2.0, 0.1161)
    areas: Mapping[str, float] | None = field(
        default_factory=lambda: {"A_T": 0.16, "A_L": 0.40, "L_OA": 2.3, "s_L": 0.1}
    )
    secret: Mapping[str, float] = field(default_factory=lambda: {
        "damping.X_uu": 1.12, "damping.Y_v": 0.86, "damping.Y_r": 1.20, "damping.N_v": 1.15, "damping.N_r": 1.10,
        "damping.N_rr": 0.85, "inertia.m_33": 1.15,
    })  # fmt: skip

    def value(self, path: str) -> float:
        return self.numbers[path]

    def having(self, values: Mapping[str, float]) -> Tug:
        return replace(self, numbers={**self.numbers, **values})

    def steered(self, turn: float, n: float) -> tuple[float, ...]:
        return n, -turn, n, -turn  # a stern that is pushed to port turns the bow to starboard

    def rates(
        self, u: float, v: float, r: float, controls: tuple[float, ...], wind: tuple[float, float], *_: float
    ) -> Three:
        c = {path.rpartition(".")[2]: value for path, value in self.numbers.items()}
        X, Y, N = blown(*wind, self.length, self.areas) if self.areas else (0.0, 0.0, 0.0)
        for n, alpha, y in ((*controls[:2], 0.163), (*controls[2:], -0.163)):
            along, across = thrust(n) * math.cos(alpha), thrust(n) * math.sin(alpha)
            X, Y, N = X + along, Y + across, N - 0.8 * across - y * along
        a, b = abs(v), abs(r)
        X += (c["X_u"] + c["X_uu"] * abs(u) + c["X_uuu"] * u * u) * u  # (4)
        Y += (c["Y_v"] + c["Y_vv"] * a + c["Y_rv"] * b + c["Y_vvv"] * v * v) * v
        Y += (c["Y_r"] + c["Y_vr"] * a + c["Y_rr"] * b) * r
        N += (c["N_v"] + c["N_vv"] * a + c["N_rv"] * b) * v
        N += (c["N_r"] + c["N_vr"] * a + c["N_rr"] * b + c["N_rrr"] * r * r) * r
        c_13, c_23 = -c["m_22"] * v - c["m_23"] * r, c["m_11"] * u  # (3)
        p, q = Y - c_23 * r, N + c_13 * u + c_23 * v
        D = c["m_22"] * c["m_33"] - c["m_23"] * c["m_32"]
        return (X - c_13 * r) / c["m_11"], (c["m_33"] * p - c["m_23"] * q) / D, (c["m_22"] * q - c["m_32"] * p) / D


def thrust(n: float) -> float:
    """Thrust of one azimuth [N], half of (20), from 0 to 10 1/s; the offset fades out at rest."""
    n = min(max(n, -10.0), 10.0)
    k = abs(n)
    ahead = (0.987 + 0.0755 * k + 0.02489 * k**2 + 0.0005935 * k**3 - 8.865e-05 * k**4) * n
    return ahead + 0.0361 * math.tanh(n / 0.01)


TUG = Tug({
    "inertia.m_11": 138.0574, "inertia.m_22": 106.6003, "inertia.m_33": 15.6476, "inertia.m_23": 1.1254,
    "inertia.m_32": -16.0598, "damping.X_u": -8.9859, "damping.X_uu": -31.4285, "damping.X_uuu": -6.8953,
    "damping.Y_v": -71.9041, "damping.Y_vv": -77.6429, "damping.Y_rv": -43.2207, "damping.Y_vvv": -27.1394,
    "damping.Y_r": -26.0498, "damping.Y_vr": 26.7652, "damping.Y_rr": 7.7996, "damping.N_v": -14.8953,
    "damping.N_vv": -1.6306, "damping.N_rv": 8.7911, "damping.N_r": -26.7122, "damping.N_vr": -2.3474,
    "damping.N_rr": -9.8284, "damping.N_rrr": -9.232,
})  # fmt: skip
"""Qiuxin No. 5, a tug 1:20; with a loaded deck's windage, that of `blown`."""
