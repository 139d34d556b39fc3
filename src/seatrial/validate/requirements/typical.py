"""What ships of these particulars usually have: numbers of the model, zigzag, steering gear and areas against ranges.

A ship may be unusual and right, so that a number away from what regressions say is a doubt, and a failure only far
away.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ...core.parameters import values
from ...core.values import dataclass
from ...engine import SimulationError
from ...environment import CALM
from ...models import Sampled
from ...ships.estimate import FORMULAS, SCATTER
from ...ships.formulas import Particulars
from . import Finding, ranged, worst
from . import thresholds as limit
from .probe import Probe

_PLACES = ("rudder.x_H", "rudder.x_R", "rudder.l_R", "propeller.x_P")
_MASSES = {"body.m_x": 2, "body.m_y": 2, "body.J_z": 4}
"""Powers of the length in what makes them primes: 0.5 rho L^k d."""
_LEFT_OUT = ("wind.", "waves.", "propeller.C_", "propeller.k_", "hull.R_0", "rudder.eta", "rudder.x_R", "rudder.l_R",
             "rudder.epsilon", "rudder.kappa", "rudder.gamma")  # fmt: skip
"""Of pitch, race and flow at the stern, which particulars of a model do not determine, and what other items judge."""
_SHARE = 0.25
"""Least standard deviation of a regression about another ship, as a share of its value."""
_ANGLE, _AT_FIRST = math.radians(20.0), math.radians(10.0)
_AT_SEA = 30.0
"""Length above which a hull is a ship's and not a model's [m]."""


def position(p: Probe) -> Iterator[Finding]:
    """Position and heading are the integrals of u, v_m and r of the point that they are stated for (midship)."""
    model = p.ship.model
    if isinstance(model, Sampled):
        return
    points: list[tuple[str, float]] = []
    for psi in (0.0, 0.7, 2.5):
        for u, v_m, r in ((p.U, 0.0, 0.0), (0.5 * p.U, 0.2 * p.U, 0.0), (0.0, 0.0, p.U / p.ship.L_pp)):
            rest = (0.0,) * (len(model.states) - 6)
            moved = np.array(model.derivative((0.0, 0.0, psi, u, v_m, r, *rest), p.controls(p.n_P), CALM)[:3], float)
            due = (u * math.cos(psi) - v_m * math.sin(psi), u * math.sin(psi) + v_m * math.cos(psi), r)
            apart = np.abs(moved - due) * (1.0, 1.0, p.ship.L_pp) / p.U
            what = "turning on the spot" if not u else "with sway" if v_m else "straight ahead"
            points.append((f"{what}, heading {math.degrees(psi):.0f} deg", float(apart.max())))
    wrong = "position or heading is not the integral of the ship's velocities, {at}"
    yield worst("rate of position and heading, apart from u, v_m and r", points, limit.INVARIANT, wrong, "U")


def at_first(p: Probe) -> Iterator[Finding]:
    """Heading after one length over the rudder angle, Norrbin's P: of any ship, stable or not, by motion alone."""
    if not p.conventional:
        return
    angle = min(_AT_FIRST, p.limit)
    _, runs = p.drift([p.state(p.U)] * 2, [p.controls(p.n_P, side * angle) for side in (1, -1)], p.unit_time)
    turned = float(runs[0, -1, 2] - runs[1, -1, 2]) / (2.0 * angle)
    wrong = "the first answer of yaw to the rudder is no ship's: gain K, time constant T, speed U, inertia or rudder"
    yield from ranged("heading after one length over the rudder angle", turned, "-", limit.AT_FIRST, wrong)


def zigzag(p: Probe) -> Iterator[Finding]:
    """The 20/20 zigzag of a ship is answered, and its overshoots are those of a ship that can be steered."""
    if not p.conventional or p.limit < _ANGLE:
        return
    try:
        run = p.zigzag(_ANGLE, 60.0 * p.unit_time)
    except SimulationError:
        return  # the runs of other items say so
    psi = np.degrees(np.unwrap(run["psi"]))
    ways = np.sign(np.diff(psi))
    ends = np.flatnonzero(ways[1:] * ways[:-1] < 0.0) + 1
    beyond = [abs(float(psi[k])) - 20.0 for k in ends if abs(psi[k]) > 20.0]
    weak = "a 20/20 zigzag does not end within 60 lengths: too weak a rudder, or too sluggish a ship"
    yield Finding("overshoots of a 20/20 zigzag within 60 L/U", float(len(beyond)), "-", limit.ANSWERED, weak)
    if beyond:
        what = "greatest of the first two overshoots of a 20/20 zigzag"
        most = max(beyond[:2])
        wrong = f"overshoots of {most:.0f} deg in a 20/20 zigzag: too little yaw damping or rudder for its drift moment"
        yield Finding(what, most, "deg", limit.OVERSHOOT, wrong)
        usual = limit.USUAL_OVERSHOOT if p.sways else limit.USUAL_OVERSHOOT_OF_RESPONSE
        yield Finding(f"{what}, usually", most, "deg", usual, f"unusual: {wrong}", doubt=True)


def waiting(p: Probe) -> Iterator[Finding]:
    """Dead time and lag of the steering, over the time of a ship length."""
    gears = [(name, p.ship.actuators.of(name)) for name in p.steering]
    for what, of, bound in (("dead_time", "dead time", limit.DEAD_TIME), ("lag", "lag", limit.LAG)):
        points = [(name, float(getattr(gear, what, 0.0)) / p.unit_time) for name, gear in gears]
        if points:
            wrong = f"the steering gear answers later than that of any ship: {of} of {{at}}"
            yield worst(f"{of} of the steering over L/U", points, bound, wrong)


def areas(p: Probe) -> Iterator[Finding]:
    """Areas above water over length and breadth, and where the lateral one has its centre."""
    model, L = p.ship.model, p.ship.L_pp
    wind: Any = model.part("wind")
    A_T, A_L = (float(getattr(wind, name, 0.0)) for name in ("A_T", "A_L"))
    if A_T and A_L:
        swap = "A_T is larger than A_L: frontal and lateral area of the wind look exchanged"
        of = swap if A_T > A_L else "frontal or lateral area of the wind is wrong"
        yield from ranged("frontal over lateral area above water", A_T / A_L, "-", limit.AREA_ALONG, of)
        unit = "A_L of the wind is that of no ship of this length: square feet, or another unit"
        yield from ranged("lateral area above water over the length squared", A_L / L**2, "-", limit.AREA_ACROSS, unit)
        if B := float(model.breadth):
            unit = "A_T of the wind is that of no ship of this breadth: square feet, or another unit"
            yield from ranged(
                "frontal area above water over the breadth squared", A_T / B**2, "-", limit.AREA_HEAD, unit
            )
    if centre := float(getattr(wind, "s_L", 0.0)):
        wrong = "the centre of the lateral area above water (s_L) lies where no outline has it: feet, or its sign"
        yield from ranged("centre of the lateral area ahead of midship", centre / L, "L", limit.OUTLINE, wrong)


def screw(model: Any) -> Any:
    """The part of a model that has its propeller, whatever the family calls it; None without one."""
    return model.part("propeller") or model.part("screw") or model.part("race")


def stern(p: Probe) -> Iterator[Finding]:
    """Area of the rudder over length and draught, diameter of the propeller and height of the rudder over draught."""
    model: Any = p.ship.model
    D_P = float(getattr(screw(model), "D_P", 0.0))
    A_R, d = float(getattr(model.part("rudder"), "A_R", 0.0)), float(model.draught)
    if D_P and d:
        wrong = "the diameter of the propeller (D_P) is that of no ship of this draught"
        yield from ranged("propeller diameter over draught", D_P / d, "-", limit.PROPELLER, wrong)
    if A_R and d:
        wrong = "the area of the rudder (A_R) is that of no ship of this length and draught"
        yield from ranged("rudder area over L d", A_R / (p.ship.L_pp * d), "-", limit.RUDDER_AREA, wrong)
    eta = float(getattr(model.part("rudder"), "eta", 0.0))
    if D_P and d and eta:
        wrong = "the share of the rudder in the race (eta) is that of no rudder behind such a propeller"
        yield from ranged("height of the rudder, D_P/eta, over draught", D_P / eta / d, "-", limit.RUDDER_HEIGHT, wrong)
    if p.conventional:
        yield from _behind(p)


def _behind(p: Probe) -> Iterator[Finding]:
    """Wake fraction and thrust deduction of the propeller behind its hull."""
    model: Any = p.ship.model
    known = limit.WAKE if p.ship.L_pp > _AT_SEA else limit.WAKE_OF_MODEL
    for names, what, usual in (
        (("w_P0", "w"), "wake fraction", known), (("t_P", "t"), "thrust deduction", limit.DEDUCTION),
    ):  # fmt: skip
        for name in (one for one in names if hasattr(screw(model), one)):
            wrong = f"the {what} of the propeller ({name}) is that of no ship of this size"
            yield from ranged(what, float(getattr(screw(model), name)), "-", usual, wrong)


@dataclass(frozen=True)
class Number:
    """A number as the file has it and as formulas have it, all in their units."""

    path: str
    own: float
    usual: float
    sigma: float

    def off(self, value: float) -> float:
        """How far a value is from the usual one [sigma]."""
        return (value - self.usual) / self.sigma


def numbers(p: Probe) -> Iterator[Finding]:
    """Numbers of hull, body and rudder against regressions for the particulars of the ship."""
    found = {one.path: one for one in compared(p)}
    if not found:
        return
    for one in found.values():
        away = one.off(one.own)
        said = f"{one.path} is {away:+.1f} sigma from the regressions for such a ship ({one.own:.3g}, {one.usual:.3g})"
        if abs(away) > limit.FAR_FROM_USUAL.high:
            yield Finding(f"{one.path} against the regressions", away, "sigma", limit.FAR_FROM_USUAL, said)
        elif abs(away) > limit.USUAL.high:
            yield Finding(f"{one.path} against the regressions", away, "sigma", limit.USUAL, said, doubt=True)
    far = max(abs(one.off(one.own)) for one in found.values())
    yield Finding(f"{len(found)} numbers against the regressions, the farthest", far, "sigma")


def compared(p: Probe) -> Iterator[Number]:
    """Numbers that formulas know too, of an MMG ship with the polynomial hull that they are made for."""
    model: Any = p.ship.model
    hull, body = model.part("hull"), model.part("body")
    if type(hull).__name__ != "Polynomial" or body is None:
        return
    known = {path: float(value) for path, value in values(model).items() if np.ndim(value) == 0}
    ship = _particulars(p, known)
    if ship is None:
        return
    said: dict[str, list[float]] = {}
    for formula in FORMULAS:
        if not formula.outside(ship):
            for path, value in formula.gives(ship).items():
                said.setdefault(path, []).append(value)
    for path, each in said.items():
        if path not in known or path.startswith(_LEFT_OUT):
            continue
        spread = statistics.stdev(each) if len(each) > 1 else 0.0
        sigma = math.hypot(max(SCATTER.get(path, 0.0), spread), _SHARE * abs(each[0]))
        if sigma > 0.0:
            yield Number(path, known[path] / _unit(path, ship), each[0], sigma)
    yield _centre(ship)


def _centre(ship: Particulars) -> Number:
    """Longitudinal centre of buoyancy over L_pp: Schneekluth and Bertram 1998, Eq. 2.19, and its scatter."""
    ahead = (-13.5 + 19.4 * ship.C_b / ship.C_m) / 100.0
    return Number("body.x_G", ship.x_G / ship.L_pp, ahead, 0.015)


def _unit(path: str, ship: Particulars) -> float:
    if path in _PLACES:
        return ship.L_pp
    return 0.5 * ship.rho * ship.L_pp ** _MASSES[path] * ship.d if path in _MASSES else 1.0


def _particulars(p: Probe, known: Mapping[str, float]) -> Particulars | None:
    """Of the numbers of the model; what no formula of hull and body needs is that of a usual ship."""
    try:
        L, B, d, m, rho = (known[f"body.{name}"] for name in ("L_pp", "B", "d", "m", "rho"))
    except KeyError:
        return None
    if not (B and d and m):
        return None
    volume = m / rho
    return Particulars(
        L_pp=L, B=B, d=d, C_b=volume / (L * B * d), rho=rho, nu=1.19e-6, volume=volume, x_G=known.get("body.x_G", 0.0),
        C_m=0.98, speed=p.U, D_P=known.get("propeller.D_P", 0.6 * d), pitch_ratio=0.8, blades=4.0, area_ratio=0.5,
        A_R=known.get("rudder.A_R", L * d / 55.0), H_R=0.75 * d, aspect=1.6, w_P0=known.get("propeller.w_P0", 0.3),
        C_WP=0.85, screws=float(len(p.propulsion) or 1),
    )  # fmt: skip
