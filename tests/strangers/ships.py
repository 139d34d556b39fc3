"""Ships of six forms and of 8 to 330 m, each with the particulars that its data sheet would have.

The numbers of the truth are those of two published hulls (KVLCC2: Yasukawa and Yoshimura 2015; KCS: Yoshimura 2008),
each drawn again within a fifth by the seed of the ship, so that no ship of the library is right.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from garden.others import ESSO, Twin
from garden.ships import HULL, PROPELLER, RUDDER, Mmg, Ship

SLENDER = {
    "R_0": 0.0167, "X_vv": -0.0549, "X_vr": -0.0468, "X_rr": -0.012, "X_vvvv": -0.0417,
    "Y_v": -0.2252, "Y_r": 0.0461, "Y_vvv": -1.7179, "Y_vvr": -0.4832, "Y_vrr": -0.8341, "Y_rrr": -0.005,
    "N_v": -0.1111, "N_r": -0.0465, "N_vvv": -0.1752, "N_vvr": -0.6168, "N_vrr": -0.0512, "N_rrr": -0.0387,
}  # fmt: skip
"""KCS, over v' = -beta.  Printed with turning terms of the added mass: X_br' - m_y' = -.1084, Y_r' - m_x' = .0398."""

MODEL = 7.0
"""Length of the models whose R_0 these numbers are [m]."""
NU = 1.19e-6
"""Of sea water at 15 C [m^2/s]."""


@dataclass(frozen=True)
class HigherOrder(Mmg):
    """An Abkowitz polynomial with terms of fifth order and of |v| v and |r| r, which no cubic hull has."""

    def _hull(self, v: float, r: float, q: float, h: Mapping[str, float]) -> tuple[float, float, float]:
        X, Y, N = super()._hull(v, r, q, h)
        Y += q * (-0.35 * abs(v) * v + 0.02 * abs(r) * r - 1.5 * v**5)
        N += q * self.length * (-0.03 * abs(v) * v - 0.012 * abs(r) * r - 0.4 * v**4 * r)
        return X, Y, N


@dataclass(frozen=True)
class Pod(Mmg):
    """One azimuth thruster under the stern: the thrust turns with it, and its strut is a rudder."""

    def _driven(self, u: float, v: float, r: float, controls: tuple[float, ...]) -> tuple[float, float, float]:
        n, angle = controls
        T, (X, Y, N) = self._pushed(u, v, r, n, angle)
        pull = (1.0 - self.propeller["t_P"]) * T
        across = pull * math.sin(angle)
        return X + pull * math.cos(angle), Y - across, N + 0.48 * self.length * across


@dataclass(frozen=True)
class Rolling(Mmg):
    """A ship of small stability: a turn heels it outwards, and heel turns it (N_phi < 0); phi to starboard down."""

    inner: tuple[str, ...] = ("phi", "p")
    period: float = 12.0

    def rates(
        self, u: float, v: float, r: float, controls: tuple[float, ...], wind: tuple[float, float], *inner: float
    ) -> tuple[float, ...]:
        phi, p = inner or (0.0, 0.0)
        w, gyration, lever = 2.0 * math.pi / self.period, 0.38 * 6.0 * self.d / 2.2, 0.4 * self.d
        X, Y, N = self._driven(u, v, r, controls)
        q = 0.5 * self.rho * self.length * self.d * math.hypot(u, v) ** 2
        moved = self._moved(u, v, r, (X, Y - 0.005 * q * phi, N - 0.012 * q * self.length * phi), wind)
        return *moved, p, -w * w * phi - 0.16 * w * p - lever * u * r / gyration**2


@dataclass(frozen=True)
class Alike:
    """Another ship of the garden at another length by Froude's law: velocities with the root, angles as they are."""

    of: Ship
    name: str
    length: float
    inner: tuple[str, ...] = ()
    secret: Mapping[str, float] = field(default_factory=dict)

    @property
    def ratio(self) -> float:
        return self.length / self.of.length

    @property
    def speed(self) -> float:
        return self.of.speed * math.sqrt(self.ratio)

    @property
    def rho(self) -> float:
        return self.of.rho

    @property
    def controls(self) -> tuple[str, ...]:
        return self.of.controls

    @property
    def gear(self) -> tuple[float, ...]:
        """Revolutions per second scale with the inverse root, their rates with the inverse of the length."""
        root = math.sqrt(self.ratio)
        return tuple(
            rate / self.ratio if name.startswith("n") else rate / root
            for name, rate in zip(self.controls, self.of.gear, strict=True)
        )

    @property
    def areas(self) -> Mapping[str, float] | None:
        return self.of.areas

    def value(self, path: str) -> float:
        return self.of.value(path)

    def having(self, values: Mapping[str, float]) -> Alike:
        return replace(self, of=self.of.having(values))

    def steered(self, turn: float, n: float) -> tuple[float, ...]:
        return self.of.steered(turn, n)

    def rates(
        self, u: float, v: float, r: float, controls: tuple[float, ...], wind: tuple[float, float], *inner: float
    ) -> tuple[float, ...]:
        root = math.sqrt(self.ratio)
        own = tuple(c * root if name.startswith("n") else c for name, c in zip(self.controls, controls, strict=True))
        du, dv, dr = self.of.rates(u / root, v / root, r * root, own, (wind[0] / root, wind[1] / root), *inner)
        return du, dv, dr / self.ratio


@dataclass(frozen=True)
class Stranger:
    """A ship that is tried, and what is known of it.

    Attributes:
        ship: the truth.
        particulars: of its data sheet, SI units.
        form: of the truth; "mmg" and "twin" have the parameters of the ship that `estimate` makes.
        fault: planted in an instrument (`logs.FAULTS`); empty where all are right.
        seed: of noise, headings, current and wind.
        harsh: whether its instruments are poor as well: fixes that wander by 1.5 m within a minute, tails that are
            heavy, a receiver that is up to half a second late from row to row.
    """

    ship: Ship
    particulars: Mapping[str, float]
    form: str
    fault: str
    seed: int
    harsh: bool = False

    @property
    def name(self) -> str:
        return self.ship.name

    @property
    def comparable(self) -> bool:
        return self.form in ("mmg", "twin")


_FORMS: Mapping[str, type[Mmg]] = {"mmg": Mmg, "twin": Twin, "abkowitz": HigherOrder, "pod": Pod, "roll": Rolling}


def _drawn(table: Mapping[str, float], random: np.random.Generator, share: float) -> dict[str, float]:
    return {name: value * (1.0 + share * float(random.uniform(-1.0, 1.0))) for name, value in table.items()}


def carried(R_0: float, length: float, speed: float, wetted: float) -> float:
    """R_0 of a model, of a ship of this length [m] at this speed [m/s]: its friction falls with the Reynolds number.

    ITTC 1957 and a form factor of .2; waves by Froude's law.  A model's R_0 at 330 m would be twice that of any ship.

    Args:
        wetted: wetted surface over L d.
    """

    def friction(L: float) -> float:
        return 1.2 * 0.075 / (math.log10(speed * math.sqrt(L / length) * L / NU) - 2.0) ** 2

    return R_0 + wetted * (friction(length) - friction(MODEL))


def _made(form: str, length: float, full: float, fault: str, seed: int) -> Stranger:
    """A ship between slender (0) and full (1), drawn by its seed."""
    random = np.random.default_rng([seed, 5])
    slow = 1.0 - full
    C_b, ratio, beam = 0.60 + 0.2 * full, 6.9 - 1.2 * full, 2.5 + 0.3 * full
    B = length / ratio
    d = B / beam
    Fn = 0.15 + 0.08 * slow
    speed, volume = Fn * math.sqrt(9.81 * length), C_b * length * B * d
    screws = 2 if form == "twin" else 1
    D_P, A_R, H_R = (0.62 * d / math.sqrt(screws), length * d / 55.0 / screws, 0.75 * d / math.sqrt(screws))
    mass = 2.0 * volume / (length**2 * d)
    hull = {name: full * HULL[name] + slow * SLENDER[name] for name in HULL}
    hull["R_0"] = carried(hull["R_0"], length, speed, 1.7 + C_b * beam)  # Denny-Mumford: S = 1.7 L d + C_b L B
    turn = math.radians(2.4) * math.sqrt(max(150.0 / length, 1.0)) * float(random.uniform(0.9, 1.5))
    name = f"{form}_{length:.0f}"
    areas = {"A_T": 0.9 * B * 0.5 * B, "A_L": 0.07 * length**2, "L_OA": 1.04 * length, "s_L": -0.03 * length}
    more = {"beside": 0.22 * B} if form == "twin" else {"period": 2.6 * math.sqrt(B)} if form == "roll" else {}
    ship = _FORMS[form](
        name, length, d, volume, (0.035 * full - 0.01 * slow) * length, D_P, A_R, H_R, 0.35 * full + 0.22 * slow,
        speed, turn, 0.1 * 320.0 / length, hull=_drawn(hull, random, 0.2), rudder=_drawn(RUDDER, random, 0.15),
        propeller={**PROPELLER, "t_P": 0.2 * float(random.uniform(0.8, 1.2))}, areas=areas,
        added=(0.05 * mass, mass * float(random.uniform(0.75, 1.0)), 0.045 * mass * float(random.uniform(0.9, 1.2))),
        **more,
    )  # fmt: skip
    if form == "pod":
        ship = replace(ship, A_R=0.4 * ship.A_R)
    known = {"L_pp": length, "B": B, "d": d, "C_b": C_b, "x_G": ship.x_G, "speed": speed, "D_P": D_P, "A_R": A_R,
             "H_R": H_R} | ({"screws": 2, "y_P": 0.22 * B} if screws == 2 else {})  # fmt: skip
    return Stranger(ship, known, form, fault, seed)


def _esso(length: float, fault: str, seed: int) -> Stranger:
    """Esso Osaka with its cross-flow hull (Sawada 2024), drawn again, at another length."""
    random = np.random.default_rng([seed, 5])
    ship = Alike(replace(ESSO, numbers=_drawn(ESSO.numbers, random, 0.15)), f"crossflow_{length:.0f}", length)
    k = ship.ratio
    known = {"L_pp": length, "B": 0.489 * k, "d": ESSO.d * k, "C_b": 0.83, "x_G": 0.03119 * length,
             "speed": ship.speed, "D_P": 0.084 * k, "A_R": 0.01063 * k * k, "H_R": 0.128 * k}  # fmt: skip
    return Stranger(ship, known, "crossflow", fault, seed)


STRANGERS: tuple[Stranger, ...] = (
    _made("mmg", 8, 0.3, "", 1), _made("mmg", 24, 0.2, "heading", 2), _made("mmg", 42, 0.3, "", 3),
    _made("mmg", 90, 0.5, "rudder_offset", 4), _made("mmg", 140, 0.4, "", 5), _made("mmg", 180, 0.7, "gyro_scale", 6),
    _made("mmg", 230, 0.1, "", 7), _made("mmg", 330, 1.0, "gnss_late", 8),
    _made("twin", 60, 0.2, "", 9), _made("twin", 120, 0.1, "speed_scale", 10), _made("twin", 210, 0.4, "", 11),
    _esso(40, "", 12), _esso(100, "rudder_late", 13), _esso(325, "", 14),
    _made("abkowitz", 35, 0.3, "", 15), _made("abkowitz", 110, 0.5, "heading", 16), _made("abkowitz", 280, 0.9, "", 17),
    _made("pod", 75, 0.2, "", 18), _made("pod", 150, 0.4, "rudder_offset", 19),
    _made("roll", 50, 0.2, "gyro_scale", 20), _made("roll", 175, 0.1, "", 21), _made("roll", 300, 0.0, "", 22),
)  # fmt: skip

JUDGES: tuple[Stranger, ...] = tuple(replace(one, harsh=True) for one in (
    _made("mmg", 15, 0.4, "", 31), _made("twin", 30, 0.3, "rudder_offset", 32), _made("abkowitz", 65, 0.2, "", 33),
    _esso(20, "", 34), _made("roll", 120, 0.4, "heading", 35),
))  # fmt: skip
"""A second garden, on which no default was chosen."""

BY_NAME = {one.name: one for one in (*STRANGERS, *JUDGES)}
