"""Forces of the whole ship, measured by its motion, against what ships of its size and form have.

Rates times measured masses are forces, whatever the family: a term of an Abkowitz table, of a Fossen matrix and of a
hull behind its own rudder are held against one regression.  Forces are over m U^2/L, moments over m U^2, with m the
displaced mass: then the linear derivatives of Clarke et al. (1983) depend on little more than draught and breadth.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import cached_property

import numpy as np

from ...core.values import dataclass
from ...data import Array
from ...environment import CALM
from ...models import ROLL
from . import Finding, ranged
from . import thresholds as limit
from .body import shares
from .probe import Probe
from .thresholds import Range

_SLENDER, _DRAUGHT, _BREADTH = 0.52, 0.05, 2.6
"""d^2 L over the volume, d/L and B/d of a usual ship, for files that do not have them."""
_LITTLE, _DRIFT, _TURN, _HELM = 0.02, 0.3, 0.5, 0.1
"""v_m/U and r L/U of slopes; of a hard turn; rudder of slopes [rad]."""
_BROAD = 0.5
"""Breadth over the length of a craft without rudders whose breadth is unknown."""
_ADDED = 0.2
"""Least added mass in sway over the displaced one that a figure is divided by."""
_GYRATION = 0.4
"""Radius of gyration in roll, added inertia included, over the breadth."""
_NU, _RHO = 1.19e-6, 1025.0
_SPEED = 0.1
"""Share of U about a speed that slopes of surge are taken over."""

Named = tuple[str, float, str, Range, str]
"""What, its value and unit, where ships lie, what is wrong beyond."""


@dataclass(frozen=True)
class Whole:
    """A ship as forces by motion."""

    p: Probe

    @cached_property
    def mass(self) -> Array:
        """Mass matrix over m, with yaw in lengths, shape (3, 3)."""
        return shares(self.p)

    @cached_property
    def volume(self) -> float:
        """Displaced volume [m^3], in the water of the file; NaN where the mass is unknown."""
        model = self.p.ship.model
        m, rho = float(model.displaced), float(getattr(model.part("body"), "rho", _RHO))
        return m / rho if m > 0.0 and rho > 0.0 and model.takes("wind") else math.nan

    @cached_property
    def form(self) -> tuple[float, float, float]:
        """d^2 L over the volume, d/L and B/d; usual ones where unknown."""
        model, L = self.p.ship.model, self.p.ship.L_pp
        d, B = float(model.draught), float(model.breadth)
        slender = d * d * L / self.volume if d and math.isfinite(self.volume) else _SLENDER
        return slender, d / L if d else _DRAUGHT, B / d if d and B else _BREADTH

    def forces(self, rows: list[tuple[float, ...]]) -> Array:
        """X, Y over m U^2/L and N over m U^2 at rows of u/U, v_m/U, r L/U, n/n_P, rudder [rad], shape (rows, 3)."""
        p, L = self.p, self.p.ship.L_pp
        motion = np.array(rows)[:, :3] * [p.U, p.U, p.U / L]
        rates = p.at(motion, [p.controls(n * p.n_P, d) for *_, n, d in rows])
        return (rates * [1.0, 1.0, L]) @ self.mass.T * L / p.U**2

    def slope(self, row: tuple[float, ...], step: tuple[float, ...]) -> Array:
        """Slope of X, Y, N along a step from a row, by central differences; the step's own size divides."""
        size = float(np.abs(step).max())
        up, down = (tuple(a + s * b for a, b in zip(row, step, strict=True)) for s in (1.0, -1.0))
        plus, minus = self.forces([up, down])
        return (plus - minus) / (2.0 * size)

    def parts(self, v: float, r: float) -> Array:
        """X, Y, N in drift and turn, split by symmetry: odd in v, odd in r, odd in both, even; shape (4, 3)."""
        a, b, c, d = self.forces([(1.0, s * v, t * r, 1.0, 0.0) for s in (1, -1) for t in (1, -1)])
        return np.array([a + b - c - d, a - b + c - d, a - b - c + d, a + b + c + d]) / 4.0


def findings(p: Probe) -> Iterator[Finding]:
    """Masses, linear and large forces of hull and rudder, resistance: of the whole ship, against those of others."""
    for one in named(p):
        if not math.isnan(one[1]):
            yield from ranged(*one)


def named(p: Probe) -> Iterator[Named]:
    """The figures, each with the range of ships."""
    if not p.sways:
        return
    ship = Whole(p)
    yield from (*_masses(ship), *_resistance(ship), *_shared(ship), *_keel(ship))
    if p.conventional:
        yield from (*_linear(ship), *_large(ship))


def _masses(ship: Whole) -> Iterator[Named]:
    M, p, L = ship.mass, ship.p, ship.p.ship.L_pp
    known = limit.MASSES if p.conventional else limit.MASSES_OF_CRAFT
    surge = float(M[0, 0]) if M[0, 0] != 1.0 else math.nan  # over itself, where the displaced mass is unknown
    broad = float(p.ship.model.breadth) / L or (0.0 if p.conventional else _BROAD)
    gyration = math.sqrt(max(float(M[2, 2] / M[0, 0]), 0.0)) / math.hypot(1.0, broad)
    than = "large" if gyration > known[2].usual.low else "small"
    yield "length between perpendiculars", L, "m", limit.LONGEST, "length L_pp is no ship's: feet, or another unit"
    yield "mass in surge over displaced", surge, "-", known[0], "added mass in surge (m_x) is that of no ship"
    yield ("mass in sway over surge", float(M[1, 1] / M[0, 0]), "-", known[1],
           "added mass in sway (m_y) is that of no ship")  # fmt: skip
    yield ("radius of gyration in yaw, of the mass in surge, over the diagonal of the plan", gyration, "-", known[2],
           f"inertia in yaw is too {than} for a ship (I_z, J_z)")  # fmt: skip
    yield ("lever of sway on yaw in the masses", float(M[1, 2] / M[1, 1]), "L", limit.MASS_LEVER,
           "the centre of mass (x_G) lies far from midship")  # fmt: skip
    if math.isfinite(ship.volume):
        yield ("length over the cube root of the volume", L / ship.volume ** (1.0 / 3.0), "-", limit.FULLNESS,
               "mass or length is wrong: too heavy or light for its length")  # fmt: skip
    d, B = float(p.ship.model.draught), float(p.ship.model.breadth)
    if not (d and B):
        return
    yield "breadth over draught", B / d, "-", limit.BREADTH, "breadth B or draught d is wrong"
    yield "length over breadth", L / B, "-", limit.LENGTH, "length or breadth B is wrong"
    if not math.isfinite(ship.volume):
        return
    full = ship.volume / (L * B * d)
    yield ("block coefficient", full, "-", limit.BLOCK if p.conventional else limit.BLOCK_OF_CRAFT,
           "mass, length, breadth or draught is wrong")  # fmt: skip
    if p.conventional:
        F_n = p.U / math.sqrt(9.81 * L)
        yield ("block coefficient over that of ships as fast",
               full / (0.7 + 0.125 * math.atan((23.0 - 100.0 * F_n) / 4.0)), "-", limit.USUAL_BLOCK,
               "mass, length, breadth, draught or speed is wrong")  # fmt: skip


def _resistance(ship: Whole) -> Iterator[Named]:
    """Resistance over the friction (ITTC 1957) of the wetted surface 2.6 sqrt(volume L), with waves by speed."""
    p, L = ship.p, ship.p.ship.L_pp
    if p.conventional:
        slope = float(ship.slope((1.0, 0.0, 0.0, 1.0, 0.0), (_SPEED, 0.0, 0.0, 0.0, 0.0))[0])
        yield ("damping of surge at held revolutions", -slope, "m U/L", limit.SURGE_SLOPE,
               "resistance (R_0, X_u) or thrust is out of proportion")  # fmt: skip
    if not (p.stops and math.isfinite(ship.volume)):
        return
    own = -float(ship.forces([(1.0, 0.0, 0.0, 0.0, 0.0)])[0, 0])
    friction = 0.075 / (math.log10(p.U * L / _NU) - 2.0) ** 2
    wetted = 2.6 * math.sqrt(ship.volume * L)
    share = own * ship.volume / L / (0.5 * wetted * friction)
    waves = 1.0 + (p.U / math.sqrt(9.81 * L) / 0.3) ** 4
    known = limit.RESISTANCE_OF_SHIPS if p.conventional else limit.RESISTANCE_OF_CRAFT
    yield ("resistance over friction and waves", share / waves, "-", known,
           "resistance (R_0, X_u) is that of no such ship")  # fmt: skip


def _shared(ship: Whole) -> Iterator[Named]:
    """Yaw damping over sway damping where the ends of the ship move as fast: a strip of drag has 1/8, of lift 1/6."""
    under_way = ship.p.conventional
    u, n = (1.0, 1.0) if under_way or not ship.p.rests else (0.5, 0.5)
    sway = float(ship.slope((u, 0.0, 0.0, n, 0.0), (0.0, 0.4 * u, 0.0, 0.0, 0.0))[1])
    yaw = float(ship.slope((u, 0.0, 0.0, n, 0.0), (0.0, 0.0, 0.8 * u, 0.0, 0.0))[2])
    known = limit.SHARED if under_way else limit.SHARED_OF_CRAFT
    yield ("yaw damping over sway damping, ends as fast", 2.0 * yaw / sway if sway else math.nan, "-", known,
           "damping of yaw (N_r) and of sway (Y_v) do not belong to one hull")  # fmt: skip
    if ship.p.stops and ship.p.allows("v_m", 0.4 * ship.p.U):
        aside = 0.5 * float(np.subtract(*ship.forces([(0.0, s, 0.0, 0.0, 0.0) for s in (-0.4, 0.4)])[:, 1]))
        along = -float(ship.forces([(0.4, 0.0, 0.0, 0.0, 0.0)])[0, 0])
        if ship.p.rests and along > 0.0:
            yield ("drag sideways over ahead at one speed", aside / along, "-", limit.SIDEWAYS,
                   "drag across is that of no hull: damping of sway and surge (Y_v, X_u), or forces kept at low "
                   "speed")  # fmt: skip


def _keel(ship: Whole) -> Iterator[Named]:
    """The side force of a drift acts below the centre of gravity, by the roll that it starts."""
    p, model = ship.p, ship.p.ship.model
    B, d, v = float(model.breadth), float(model.draught), _LITTLE * p.U
    if model.motion[6:] != ROLL or not (B and d):
        return
    rolled = [float(model.derivative((0.0, 0.0, 0.0, p.U, side * v, 0.0, 0.0, 0.0), p.controls(p.n_P), CALM)[7])
              for side in (1.0, -1.0)]  # fmt: skip
    sway = float(ship.slope((1.0, 0.0, 0.0, 1.0, 0.0), (0.0, _LITTLE, 0.0, 0.0, 0.0))[1])
    heels = 0.5 * (rolled[0] - rolled[1]) / v * (_GYRATION * B) ** 2 * p.ship.L_pp / p.U
    yield ("depth of the side force of a drift below the centre of gravity, over the draught",
           -heels / sway / d if sway else math.nan, "-", limit.KEEL,
           "a drift does not heel the ship as a hull's does: roll moment (K_v, its sign or size)")  # fmt: skip


def _linear(ship: Whole) -> Iterator[Named]:
    """Linear derivatives of the ship with its rudder over those of a hull by Clarke, Gedling and Hine (1983)."""
    slender, d, B = ship.form
    straight = (1.0, 0.0, 0.0, 1.0, 0.0)
    drift = ship.slope(straight, (0.0, _LITTLE, 0.0, 0.0, 0.0))
    turn = ship.slope(straight, (0.0, 0.0, _LITTLE, 0.0, 0.0))
    helm = ship.slope(straight, (0.0, 0.0, 0.0, 0.0, _HELM))
    k = 0.5 * math.pi * slender
    words = "{} is that of no such ship: {}"
    yield ("sway by drift over Clarke's", float(drift[1]) / -(k + 0.2 * math.pi), "-", limit.CLARKE["Y_v"],
           words.format("Y_v", "sway force by drift"))  # fmt: skip
    yield ("yaw by drift over Clarke's", float(drift[2]) / -(k * (0.5 + 2.4 * d)), "-", limit.CLARKE["N_v"],
           words.format("N_v", "yaw moment by drift, that of Munk with it"))  # fmt: skip
    yield ("yaw by turning over Clarke's", float(turn[2]) / -(k * (0.25 + 0.039 * B - 0.56 * B * d)), "-",
           limit.CLARKE["N_r"], words.format("N_r", "yaw damping"))  # fmt: skip
    yield ("sway by turning, the mass taken off", float(turn[1]) + float(ship.mass[0, 0]), "m U", limit.CLARKE["Y_r"],
           words.format("Y_r", "sway force by yaw rate"))  # fmt: skip
    yield ("sway by the rudder", float(helm[1]), "m U^2/L", limit.HELM_SWAY,
           words.format("Y_delta", "side force of the rudder"))  # fmt: skip
    yield "yaw by the rudder", float(helm[2]), "m U^2", limit.HELM_YAW, words.format("N_delta", "moment of the rudder")
    lever = float(helm[2] / helm[1]) if helm[1] else math.nan
    yield ("lever of the rudder force", lever, "L", limit.HELM_LEVER,
           "the rudder force does not act at the stern (x_R, x_H, a_H)")  # fmt: skip
    hard = ship.p.limit
    ahead, right, left = ship.forces([(1.0, 0.0, 0.0, 1.0, angle) for angle in (0.0, hard, -hard)])
    across = 0.5 * float(right[1] - left[1])
    yield ("drag of the rudder over its side force, at the greatest angle",
           (0.5 * float(right[0] + left[0]) - float(ahead[0])) / across if across else math.nan, "-", limit.HELM_DRAG,
           "drag of a turned rudder (X_delta-delta, t_R) is that of no ship: it holds the ship back")  # fmt: skip


def _large(ship: Whole) -> Iterator[Named]:
    """What drift and yaw do to each other in a hard turn; separated by symmetry, so by terms such as Y_vrr, N_vvr.

    A strip of the hull meets v_m + x r and resists by its square: damping of sway grows with the turn, of yaw with
    drift, and nothing in it feeds one from the other.
    """
    both = ship.parts(_DRIFT, _TURN)
    (sway, _, _, aside), (_, yaw, _, about) = ship.parts(_DRIFT, 0.0), ship.parts(0.0, _TURN)
    straight = ship.forces([(1.0, 0.0, 0.0, 1.0, 0.0)])[0]
    low = ship.parts(_LITTLE, 0.0)[0] / _LITTLE, ship.parts(0.0, _LITTLE)[1] / _LITTLE
    v, r = low[0], low[1]

    beyond = float(ship.mass[1, 1]) - 1.0

    def over(value: float, base: float) -> float:
        return value / base if base else math.nan

    told = (
        ("sway force of 17 deg of drift, over its slope", over(float(sway[1]) / _DRIFT, float(v[1])), "-", "Y_vvv",
         "sway force at large drift (Y_vvv) does not grow as a hull's"),
        ("gain of sway damping by turning", over(float(both[0, 1] - sway[1]) / _DRIFT, float(v[1])), "-", "Y_vrr",
         "sway damping falls by turning, or grows too much (Y_vrr)"),
        ("yaw moment of r' = 0.5, over its slope", over(float(yaw[2]) / _TURN, float(r[2])), "-", "N_rrr",
         "yaw damping at large rates (N_rrr) does not grow as a hull's"),
        ("gain of yaw damping by drift", over(float(both[1, 2] - yaw[2]) / _TURN, float(r[2])), "-", "N_vvr",
         "yaw damping falls by drift, or grows too much (N_vvr)"),
        ("change of the drift moment at 17 deg", float(sway[2]) / _DRIFT - float(v[2]), "m U^2", "N_vvv",
         "yaw moment at large drift (N_vvv) is that of no ship"),
        ("change of the drift moment by turning", float(both[0, 2] - sway[2]) / _DRIFT, "m U^2", "N_vrr",
         "yaw moment by drift in a turn (N_vrr) is that of no ship"),
        ("change of sway by turning at r' = 0.5", float(yaw[1]) / _TURN - float(r[1]), "m U^2/L", "Y_rrr",
         "sway force at large rates (Y_rrr) is that of no ship"),
        ("change of sway by turning in drift", float(both[1, 1] - yaw[1]) / _TURN, "m U^2/L", "Y_vvr",
         "sway force by turning in drift (Y_vvr) is that of no ship"),
        ("surge by drift and yaw, the mass taken off, over the added mass in sway",
         over(float(both[2, 0]) / (_DRIFT * _TURN) - 1.0, beyond if beyond > _ADDED else 0.0), "-", "X_vr",
         "surge force of a drifting turn (X_vr) is that of no ship"),
        ("surge by drift", float(aside[0] - straight[0]) / _DRIFT**2, "m U^2/L", "X_vv",
         "surge force by drift (X_vv, X_vvvv) is that of no ship"),
        ("surge by turning", float(about[0] - straight[0]) / _TURN**2, "m U^2/L", "X_rr",
         "surge force by turning (X_rr, x_G) is that of no ship"),
    )  # fmt: skip
    for what, value, unit, name, wrong in told:
        yield what, value, unit, limit.LARGE[name], wrong
