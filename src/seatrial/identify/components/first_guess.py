"""A first guess of the matrices of a Fossen model from the particulars of a hull, and a ship made of it.

You 2023 Eq. 11, put right.  Its I_z is that of a spheroid floating wholly under water, which for their tug
weighs three times as much as the ship: here it is m (0.25 L)^2.  Its Y_vdot lacks a pi against strip theory,
and its N_rdot has one sign in Eq. 11 and the other in Eq. 16.  The paper leaves damping at zero;
lift and drag across the hull can be guessed too, and keep a first prediction bounded.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from ...actuators import Actuator, Actuators
from ...core.parameters import Parts, specs, unknown, walk
from ...core.values import dataclass, replace
from ...forces.damping import Polynomial
from ...models.fossen import Fossen, Inertia, Particulars
from ...ships import Entry, Ship, ShipError
from .servo import ServoFit
from .thrust_map import ThrustMap

CLARKE = (4.0, 9.0)
"""L/B within which Clarke 1983 is used; for a hull as beamy as a tug its regression loses the added inertia."""

_DRAG = 1.0
_USUAL = 0.3
"""Relative uncertainty where two formulas do not give one."""


@dataclass(frozen=True, kw_only=True)
class Hull:
    """Particulars of a hull.

    Attributes:
        L_pp, B, d: length, breadth and draught [m].
        m: mass [kg], which is that of the water displaced.
        rho: density of the water [kg/m^3].
        x_G: centre of gravity ahead of midship [m].
    """

    L_pp: float
    B: float
    d: float
    m: float
    rho: float = 1000.0
    x_G: float = 0.0

    def __post_init__(self) -> None:
        for name in ("L_pp", "B", "d", "m", "rho"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise ShipError(f"{name} is {value:g}; it must be above zero")
        if not 0.2 <= self.C_b <= 1.0:
            raise ShipError(
                f"m = {self.m:g} kg in a box of {self.L_pp:g} x {self.B:g} x {self.d:g} m is a block coefficient of "
                f"{self.C_b:.3g}; ships have 0.2 to 1, so check units, draught and density"
            )

    @property
    def C_b(self) -> float:
        """Block coefficient, of the mass as displacement."""
        return self.m / (self.rho * self.L_pp * self.B * self.d)


@dataclass(frozen=True)
class Guess:
    """One number, what it may be off by, and the formula it comes from."""

    value: float
    sigma: float
    source: str


def guesses(hull: Hull, *, speed: float | None = None, thrust: float | None = None) -> dict[str, Guess]:
    """First guess of each number of a Fossen model that the particulars say something about, by path.

    Args:
        hull: the particulars.
        speed: the usual speed ahead [m/s], for which lift gives Y_v and N_r.
        thrust: of all thrusters together [N], which holds it; it gives X_uu.

    Returns:
        inertia.m_* [kg, kg m, kg m^2] and damping.* [SI] with sigma and source.

    Raises:
        ShipError: a thrust without the speed that it holds, or one of them not above zero.
    """
    m, L, x_G = hull.m, hull.L_pp, hull.x_G
    surge, sway, yaw = _added(hull)
    inertia = Guess(m * (0.25 * L) ** 2, 0.2 * m * (0.25 * L) ** 2, "m (0.25 L)^2")
    found = {
        "inertia.m_11": Guess(m + surge.value, surge.sigma, f"m + {surge.source}"),
        "inertia.m_22": Guess(m + sway.value, sway.sigma, f"m + {sway.source}"),
        "inertia.m_33": Guess(
            inertia.value + m * x_G**2 + yaw.value, math.hypot(inertia.sigma, yaw.sigma),
            f"{inertia.source} + m x_G^2 + {yaw.source}",
        ),
        # Alike fore and aft the coupled added masses vanish; alike or not, both are one number.
        "inertia.m_23": Guess(m * x_G, 0.05 * m * L, "m x_G; a hull alike fore and aft adds nothing"),
        "inertia.m_32": Guess(m * x_G, 0.05 * m * L, "m x_G; a hull alike fore and aft adds nothing"),
        **_drag(hull),
    }  # fmt: skip
    for what, value in (("speed", speed), ("thrust", thrust)):
        if value is not None and not value > 0:
            raise ShipError(f"{what} is {value:g}; it must be above zero")
    if speed is not None:
        found |= _lift(hull, speed)
    if thrust is not None:
        if speed is None:
            raise ShipError(f"{thrust:g} N determine nothing without the speed that they hold; give speed")
        X_uu = -thrust / speed**2
        found["damping.X_uu"] = Guess(X_uu, _USUAL * -X_uu, f"{thrust:.4g} N hold {speed:.4g} m/s")
    return found


def first_guess(hull: Hull, *, speed: float | None = None, thrust: float | None = None) -> dict[str, float]:
    """The values of `guesses` alone, by path, as `Ship.having` takes them."""
    return {path: one.value for path, one in guesses(hull, speed=speed, thrust=thrust).items()}


def as_printed(hull: Hull) -> dict[str, float]:
    """Masses by You 2023 Eqs. 10-11 to the letter, whose values are Eqs. 16-17: to reproduce that paper, not to use.

    The spheroid of I_z has semi-axes L/2 and B/2, so that it displaces more than the ship weighs; Y_vdot lacks pi.
    """
    m, L, B, d, rho, a, b = hull.m, hull.L_pp, hull.B, hull.d, hull.rho, 0.5 * hull.L_pp, 0.5 * hull.B
    yaw = (0.1 * m * B * B + math.pi * rho * d * d * L**3) / 24.0
    inertia = 4.0 / 15.0 * math.pi * rho * a * b * b * (a * a + b * b)
    return {
        "inertia.m_11": m + 0.05 * m, "inertia.m_22": m + 0.5 * rho * d * d * L, "inertia.m_33": inertia + yaw,
        "inertia.m_23": m * hull.x_G, "inertia.m_32": m * hull.x_G,
    }  # fmt: skip


def _added(hull: Hull) -> tuple[Guess, Guess, Guess]:
    """Added mass in surge and sway [kg] and added moment of inertia in yaw [kg m^2]."""
    m, L, B, d, rho = hull.m, hull.L_pp, hull.B, hull.d, hull.rho
    soeding, twentieth = 2.7 * rho * (m / rho) ** (5 / 3) / L**2, 0.05 * m
    strip = 0.5 * math.pi * rho * d * d * L, (0.1 * m * B * B + math.pi * rho * d * d * L**3) / 24.0
    clarke = (
        strip[0] * (1 + 0.16 * hull.C_b * B / d - 5.1 * (B / L) ** 2),
        0.5 * math.pi * rho * d * d * L**3 * (1 / 12 + 0.017 * hull.C_b * B / d - 0.33 * B / L),
    )
    names = ("Clarke 1983", "strip theory (You 2023 Eq. 11 with pi, N_rdot below zero)")
    ours, other = (clarke, strip) if CLARKE[0] <= L / B <= CLARKE[1] else (strip, clarke)
    name, rival = names if ours is clarke else names[::-1]
    sway, yaw = (
        Guess(a, max(abs(a - b), 0.1 * a), f"{name} {a:.4g}; {rival} {b:.4g}")
        for a, b in zip(ours, other, strict=True)
    )
    spread = max(abs(soeding - twentieth), 0.02 * m)
    return Guess(soeding, spread, f"Soeding 1982 {soeding:.4g}; 0.05 m {twentieth:.4g}"), sway, yaw


def _drag(hull: Hull) -> dict[str, Guess]:
    """Cross-flow drag of a flat side: the integral of C_D rho d/2 |v + x r| (v + x r) for v alone and r alone."""
    L, d, rho = hull.L_pp, hull.d, hull.rho
    found = {"Y_vv": -0.5 * _DRAG * rho * d * L, "N_rr": -_DRAG * rho * d * L**4 / 64.0}
    source = f"cross-flow drag, assumed C_D = {_DRAG:g}"
    return {f"damping.{name}": Guess(value, 0.5 * -value, source) for name, value in found.items()}


def _lift(hull: Hull, speed: float) -> dict[str, Guess]:
    """Clarke 1983 at a speed.  Its Y_r and N_v hold added mass times speed, which C(nu) nu has already: not used."""
    L, B, d = hull.L_pp, hull.B, hull.d
    scale = 0.5 * math.pi * hull.rho * d * d * speed
    Y_v = -scale * (1 + 0.4 * hull.C_b * B / d)
    N_r = -scale * L * L * (0.25 + 0.039 * B / d - 0.56 * B / L)
    source = f"Clarke 1983 at {speed:.4g} m/s"
    found = {"damping.Y_v": Guess(Y_v, -Y_v, source)}
    # Of a very beamy hull the regression would drive the turn.
    return {**found, "damping.N_r": Guess(N_r, -N_r, source)} if N_r < 0 else found


def fossen_ship(
    name: str, hull: Hull, thrusters: Mapping[str, tuple[float, float, ThrustMap]], *,
    speed: float, n: float | None = None, servos: Mapping[str, ServoFit] | None = None,
) -> Ship:  # fmt: skip
    """A ship ready for a study: matrices of a first guess, measured thrust maps and servos.

    Parameters that the particulars do not determine are zero; all 22 can be freed.

    Args:
        name: of the ship.
        hull: the particulars.
        thrusters: position x ahead of midship, y to starboard [m] and thrust map, by name.
        speed: approach speed [m/s].
        n: revolutions of all thrusters that hold it [1/s]; they give X_uu.
        servos: of the directions, by control such as ``alpha_1``; one without turns at once.

    Raises:
        ShipError: no thruster, a servo for what the ship has not, or a first guess that cannot be.
        DataError: `n` that was not tested.
    """
    if not thrusters:
        raise ShipError(f"{name}: no thruster; give position and thrust map of each")
    total = None if n is None else sum(float(one.thrust(n)) for _, _, one in thrusters.values())
    found = guesses(hull, speed=speed, thrust=total)
    damping: dict[str, Any] = {"X_u": 0.0, "Y_v": 0.0, "N_r": 0.0, **_below(found, "damping")}
    parts = Parts(tuple(thrusters), tuple(one.azimuth(x, y) for x, y, one in thrusters.values()))
    model = Fossen(
        body=Particulars(rho=hull.rho, L_pp=hull.L_pp, B=hull.B, d=hull.d, m=hull.m),
        inertia=Inertia(**_below(found, "inertia")), damping=Polynomial(**damping), thrusters=parts,
    )  # fmt: skip
    given: dict[str, Any] = {}
    for control, fit in (servos or {}).items():
        if control not in model.controls:
            raise ShipError(f"{name}: {unknown(control, model.controls, 'control')}")
        given[control] = fit.servo
    for key, (_, _, one) in thrusters.items():
        given[f"n_{key}"] = Actuator(low=one.n_low, high=one.n_max)
    title = {"title": f"{name}: a first guess for a study"}
    ship = Ship(name, model, Actuators(given), hull.L_pp, speed, n, notes=title)
    return replace(ship, entries=_entries(ship, found, thrusters, servos or {}))


def _below(found: Mapping[str, Guess], part: str) -> dict[str, Any]:
    return {path.partition(".")[2]: one.value for path, one in found.items() if path.startswith(f"{part}.")}


def _entries(
    ship: Ship, found: Mapping[str, Guess], thrusters: Mapping[str, tuple[float, float, ThrustMap]],
    servos: Mapping[str, ServoFit],
) -> dict[str, Entry]:  # fmt: skip
    """Where each number of the ship comes from."""
    units = specs(ship.model)
    entries = {
        path: Entry("particulars" if path.startswith("body.") else "assumed: not known before the study", value)
        for path, _, value in walk(ship.model)
    } | {
        path: Entry(f"first guess: {one.source}", one.value, unit=units[path].unit, sigma=one.sigma)
        for path, one in found.items()
    }
    for key, (x, y, one) in thrusters.items():
        source = f"bollard pull: {one.rows} rows, R^2 {one.R2:.5f}, rmse {one.rmse:.3g} N"
        for k, (c, s) in enumerate(zip(one.coefficients, one.sigma, strict=True)):
            entries[f"thrusters.{key}.c_{k}"] = Entry(source, float(c), sigma=float(s))
        entries[f"thrusters.{key}.x"] = Entry("particulars", x)
        entries[f"thrusters.{key}.y"] = Entry("particulars", y)
        tested = Entry("greatest revolutions tested", one.n_max)
        entries[f"thrusters.{key}.n_max"] = entries[f"actuators.n_{key}.high"] = tested
        entries[f"actuators.n_{key}.low"] = Entry("least revolutions tested", one.n_low)
        told = "bollard pull astern" if one.n_low < 0 else "assumed: not tested astern"
        entries[f"thrusters.{key}.astern"] = Entry(told, one.astern)
    for control, fit in servos.items():
        for key in ("rate", "lag", "dead_time"):
            source = f"log of order and angle: {fit.samples} samples, rmse {fit.rmse:.3g} rad"
            sigma = fit.sigma.get(key)
            known = sigma if sigma is not None and math.isfinite(sigma) else None
            entries[f"actuators.{control}.{key}"] = Entry(source, float(getattr(fit.servo, key)), sigma=known)
    entries["approach.speed"] = Entry("given", ship.speed)
    if ship.n_P is not None:
        entries["approach.n_P"] = Entry("given", ship.n_P)
    return entries
