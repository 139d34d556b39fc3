"""Checks of the body: its masses, Coriolis terms and energy, the two sides, heading, and uniform current."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from ...core.parameters import Scalar, spec
from ...core.values import dataclass, replace
from ...data import Array
from ...environment import CALM, Environment
from ...forces import Flow, Force, ForceModule
from ...models import ROLL
from . import Finding, not_applicable, ranged, worst
from . import thresholds as limit
from .probe import Probe

_DRIFTS = (0.0, 5.0, 10.0, 20.0, 30.0, 50.0, 70.0, 90.0)  # [deg]
_TURNS = (0.0, 0.2, 0.4, 0.8)  # r L/U
_ASIDE = ((0.2, 0.0, 0.0), (0.4, 0.0, 0.0), (0.0, 0.4, 0.0), (-0.2, 0.4, 0.0), (0.0, 0.0, 0.3), (0.0, 0.0, 1.0),
          (-0.2, 0.4, 1.0))  # fmt: skip
"""Sway over u, yaw rate over u/L and rudder over its limit, each to be mirrored."""
_MOTIONS = len(_ASIDE)
_USUAL = np.diag([1.07, 1.8, 0.1])
"""Masses of a usual ship, in mass and length, where those of the model cannot be measured."""
_SLENDER = 6.5
"""Length over breadth of a ship whose breadth is unknown."""
_HEELED = 0.02
"""Heel [rad] and roll rate [rad/s] of slopes."""


@dataclass(frozen=True, kw_only=True)
class Push(ForceModule):
    """A known force, whatever the flow: what masses are measured with."""

    X: Scalar = spec("N", "surge force")
    Y: Scalar = spec("N", "sway force")
    N: Scalar = spec("N m", "yaw moment")

    def force(self, flow: Flow) -> Force:
        """The force itself."""
        return Force(self.X, self.Y, self.N)


def masses(p: Probe, u: float = 0.0) -> Array | None:
    """Mass matrix, added mass included, by pushes in place of the wind; None where a model has no place for one.

    A family that weighs forces by the ship's own mass is pushed by itself, and the matrix is over that mass.
    """
    model: Any = p.ship.model
    if not model.takes("wind"):
        return _own_masses(p)
    held = {"still_air": "wind"} if hasattr(model, "still_air") else {}

    def pushed(X: float, Y: float, N: float) -> Array:
        ship = replace(p.ship, model=replace(model, wind=Push(X=X, Y=Y, N=N), **held))
        return replace(p, ship=ship).rates(u, 0.0, 0.0, p.controls())

    still, size = pushed(0.0, 0.0, 0.0), float(model.displaced) or 1.0
    push = size * p.U**2 / p.ship.L_pp * np.diag([1.0, 1.0, p.ship.L_pp])
    answers = np.column_stack([pushed(*row) - still for row in push.tolist()])
    try:
        return np.asarray(push @ np.linalg.inv(answers), dtype=float)
    except np.linalg.LinAlgError:
        return None


def _own_masses(p: Probe) -> Array | None:
    """Mass matrix over the ship's own mass of a family that can be pushed; None of others."""
    push = np.diag([1.0, 1.0, p.ship.L_pp])
    answers = [p.ship.model.pushed(tuple(row)) for row in push.tolist()]
    if any(answer is None for answer in answers):
        return None
    try:
        return np.asarray(push @ np.linalg.inv(np.array(answers, dtype=float).T), dtype=float)
    except np.linalg.LinAlgError:
        return None


def shares(p: Probe) -> Array:
    """Mass matrix with yaw in lengths, shape (3, 3), over the displaced mass, or over that in surge where unknown."""
    M = masses(p)
    if M is None:
        return _USUAL
    scale = np.diag([1.0, 1.0, 1.0 / p.ship.L_pp])
    even = scale @ M @ scale
    return even / (float(p.ship.model.displaced) or float(even[0, 0]))


def inertia(p: Probe) -> Iterator[Finding]:
    """Added masses against the displaced water, and the symmetry of the mass matrix; at rest and under way."""
    displaced, L = float(p.ship.model.displaced), p.ship.L_pp
    if not p.ship.model.takes("wind"):
        displaced = 1.0  # the matrix is over the ship's own mass
    measured = {name: masses(p, u) for name, u in (("at rest", 0.0), ("at U", p.U)) if u or p.rests}
    found = {name: M for name, M in measured.items() if M is not None}
    if not found:
        return
    scale = np.diag([1.0, 1.0, 1.0 / L])
    apart: list[tuple[str, float]] = []
    for name, M in found.items():
        even = scale @ M @ scale
        apart.append((name, float(np.abs(even - even.T).max() / np.abs(even).max())))
    yield worst("asymmetry of the mass matrix", apart, limit.SYMMETRY, "the mass matrix is not symmetric, {at}")
    if not displaced > 0.0:
        return
    for axis, k, bound in (("surge", 0, limit.SURGE_MASS), ("sway", 1, limit.SWAY_MASS)):
        points = [(name, float(M[k, k]) / displaced) for name, M in found.items()]
        yield worst(
            f"mass in {axis} over the displaced water", points, bound, f"no plausible added mass in {axis}, {{at}}"
        )
    gyration = [(name, math.sqrt(max(float(M[2, 2]) / displaced, 0.0)) / L) for name, M in found.items()]
    wrong = "no plausible inertia in yaw, added inertia included, {at}"
    yield worst("radius of gyration in yaw", gyration, limit.GYRATION, wrong, "L")


def coriolis(p: Probe) -> Iterator[Finding]:
    """What turning does to a ship that moves ahead or sideways, at every speed and to both sides."""
    if not p.sways:
        return
    L = p.ship.L_pp
    thrown: list[tuple[str, float]] = []
    held: list[tuple[str, float]] = []
    speeds = sorted({*p.astern, *((0.0,) if p.rests else ()), *p.ahead})
    for slow, fast in pairwise(speeds):
        top = max(abs(slow), abs(fast)) * p.U
        for side in (1, -1):
            r, v = side * 0.2 * top / L, -side * 0.2 * top
            pairs = [(f * p.U, s, t) for f in (slow, fast) for s, t in ((0.0, 0.0), (0.0, r), (v, 0.0), (v, r))]
            rates = p.at(pairs, [p.controls(max(f, 0.0) * p.n_P) for f in (slow, fast) for _ in range(4)])
            where = f"{slow:g} to {fast:g} U, to {'starboard' if side > 0 else 'port'}"
            # what does not change with u, linear damping, falls out of the difference
            by_turn = rates[1::4, 1] - rates[0::4, 1]
            thrown.append((where, float(by_turn[0] - by_turn[1]) / ((fast - slow) * p.U * r)))
            both = rates[3::4, 0] - rates[1::4, 0] - rates[2::4, 0] + rates[0::4, 0]
            if fast > 0:
                held.append((f"{fast:g} U, to {'starboard' if side > 0 else 'port'}", float(both[1]) / (v * r)))
            if slow < 0:
                held.append((f"{slow:g} U, to {'starboard' if side > 0 else 'port'}", float(both[0]) / (v * r)))
    wrong = "no centrifugal force in a turn: the Coriolis term is missing or reversed, {at}"
    yield worst("sway by turning, over -u r", thrown, limit.CENTRIFUGAL, wrong)
    wrong = "no Coriolis term of drift and yaw in surge, {at}"
    yield worst("surge by drift and yaw, over v_m r", held, limit.DRIFTING_TURN, wrong)


def energy(p: Probe) -> Iterator[Finding]:
    """No kinetic energy comes from nowhere: engines stopped, over speeds, drift angles and yaw rates."""
    M, L = masses(p), p.ship.L_pp
    if M is not None and not p.stops:
        yield not_applicable("gain of kinetic energy, engines stopped", "the model has no engine to stop")
    if M is None or not p.stops:
        return
    rows = [
        (f * p.U * math.cos(b), side * f * p.U * math.sin(b), turn * f * p.U / L)
        for f in (*p.astern, *p.ahead) for b in map(math.radians, _DRIFTS) for side in (1, -1)
        for turn in (*_TURNS, *(-t for t in _TURNS[1:]))
    ]  # fmt: skip
    moved = np.array([row for row in rows if all(
        p.allows(name, x) for name, x in zip(("u", "v_m", "r"), row, strict=True))])  # fmt: skip
    rates = p.at(moved, p.controls())
    momentum = moved @ M
    gained = np.einsum("ij,ij->i", momentum, rates) / (0.5 * np.einsum("ij,ij->i", momentum, moved))
    speeds = np.hypot(moved[:, 0], moved[:, 1])
    points = [
        (f"u {u / p.U:.2g} U, v_m {v / p.U:+.2g} U, r {r * L / p.U:+.2g} U/L", float(g * L / s))
        for (u, v, r), g, s in zip(moved.tolist(), gained, speeds, strict=True)
    ]
    wrong = "with the engines stopped the ship gains energy, at {at}"
    yield worst("gain of kinetic energy, engines stopped", points, limit.ENERGY, wrong, "1/L")


def sides(p: Probe) -> Iterator[Finding]:
    """Port is the mirror image of starboard, but for the swirl of a single propeller."""
    L, turn = p.ship.L_pp, np.array([1.0, -1.0, -1.0])
    names = ("surge", "sway", "yaw")
    scale = np.array([1.0, 1.0, L])
    rows: list[tuple[float, float, float]] = []
    orders: list[tuple[float, float]] = []
    for f in (*p.astern, *p.ahead):
        for v, r, d in _ASIDE:
            rows.append((f * p.U, v * f * p.U, r * abs(f) * p.U / L))
            orders.append((max(f, 0.0) * p.n_P, d * p.limit))
    here = np.array(rows)
    straight = p.at(here * [1.0, 0.0, 0.0], [p.controls(n) for n, _ in orders])
    one = p.at(here, [p.controls(*order) for order in orders]) - straight
    other = p.at(here * turn, [p.controls(n, -d) for n, d in orders]) - straight
    for k, name in enumerate(names):
        size = np.maximum(np.abs(one[:, k]), np.abs(other[:, k])) * scale[k]
        # what lies below does not show in a track; nor does a small rest of large forces that cancel
        floor = np.maximum(
            0.05 * here[:, 0] ** 2 / L, 0.4 * np.repeat(size.reshape(-1, _MOTIONS).max(axis=1), _MOTIONS)
        )
        apart = np.abs(one - other * turn)[:, k] * scale[k] / np.maximum(size, floor)
        points = [
            (
                f"u {u / p.U:.2g} U, v_m {v / p.U:+.2g} U, r {r * L / p.U:+.2g} U/L, rudder {d / (p.limit or 1):+.1g}",
                float(a),
            )
            for (u, v, r), (_, d), a in zip(rows, orders, apart, strict=True)
        ]
        yield worst(
            f"{name}: difference of the sides",
            points,
            limit.MIRROR,
            f"port is no mirror image of starboard in {name}, {{at}}",
        )


def heading(p: Probe) -> Iterator[Finding]:
    """Neither heading matters in calm water, nor which way a compass points."""
    motion, control = [(p.U, 0.1 * p.U, 0.2 / p.unit_time)], p.controls(p.n_P, 0.5 * p.limit)
    usual = p.at(motion, control)
    points = [
        (f"{math.degrees(psi):g} deg", float(np.abs(p.at(motion, control, psi=psi) - usual).max()) * p.unit_time / p.U)
        for psi in (0.7, 1.5708, 2.6, 4.0, 5.5)
    ]
    yield worst(
        "rates by heading in calm water", points, limit.INVARIANT, "motion in calm depends on the heading", "U^2/L"
    )


def _going(north: float, east: float) -> Environment:
    """Water and air that move together, so that the air is still to what drifts."""
    return Environment(current_x=north, current_y=east, wind_x=-north, wind_y=-east)


def current(p: Probe) -> Iterator[Finding]:
    """A uniform current carries the ship, once: motion in it is that in still water, plus the drift."""
    if not p.sways:
        return
    L, U_C, lasts = p.ship.L_pp, 0.3 * p.U, 4 * p.unit_time
    control = p.controls(p.n_P, 0.5 * p.limit)
    start = np.array(p.state(p.U, 0.05 * p.U, 0.1 / p.unit_time))
    _, (still,) = p.drift([tuple(start)], [control], lasts)
    adrift: list[tuple[str, float]] = []
    turning: list[tuple[str, float]] = []
    for towards in (0.0, 90.0, 180.0, 270.0, 45.0):
        north, east = (U_C * f(math.radians(towards)) for f in (math.cos, math.sin))
        moved = start + np.array([0.0, 0.0, 0.0, north, east, 0.0])
        t, (run,) = p.drift([tuple(moved.tolist())], [control], lasts, _going(north, east))
        apart = run[:, :2] - still[:, :2] - np.outer(t, [north, east])
        turning.append((f"towards {towards:g} deg", float(np.abs(apart).max()) / L))
        if p.rests:
            afloat = p.state(north, east)
            _, (left,) = p.drift([afloat], [p.controls()], lasts, _going(north, east))
            off = left[-1, :2] - t[-1] * np.array([north, east])
            adrift.append((f"towards {towards:g} deg", float(np.abs(off).max()) / L))
    wrong = "motion in a current is not that in still water plus the drift, current {at}"
    yield worst("turn in a current, drift taken off", turning, limit.CURRENT, wrong, "L")
    if adrift:
        wrong = "a ship at rest in the water does not go with the current, once, current {at}"
        yield worst("adrift in a current, drift taken off", adrift, limit.CURRENT, wrong, "L")


def heel(p: Probe) -> Iterator[Finding]:
    """A ship that rolls rights itself, its roll dies out, and in a turn it heels outwards."""
    model = p.ship.model
    if model.motion[6:] != ROLL:
        return
    control = p.controls(p.n_P)

    def rolled(phi: float, rate: float, motion: tuple[float, ...]) -> float:
        return float(model.derivative((0.0, 0.0, 0.0, *motion, phi, rate), control, CALM)[7])

    straight = (p.U, 0.0, 0.0)
    stiff = -(rolled(_HEELED, 0.0, straight) - rolled(-_HEELED, 0.0, straight)) / (2.0 * _HEELED)
    fading = -(rolled(0.0, _HEELED, straight) - rolled(0.0, -_HEELED, straight)) / (2.0 * _HEELED)
    wrong = "the righting moment (GM) or inertia in roll (I_x, J_x) is that of no ship"
    B = float(model.breadth) or p.ship.L_pp / _SLENDER
    yield from ranged("square of the roll frequency over g/B", stiff * B / 9.81, "-", limit.ROLL_STIFFNESS, wrong)
    if stiff > 0.0:
        wrong = "roll damping (K_p) is that of no ship"
        yield from ranged("roll damping over critical", 0.5 * fading / math.sqrt(stiff), "-", limit.ROLL_DAMPING, wrong)
        for side, name in ((1.0, "starboard"), (-1.0, "port")):
            _, (run,) = p.drift([p.state(p.U)], [p.controls(p.n_P, side * p.limit)], 15 * p.unit_time)
            outwards = -side * rolled(0.0, 0.0, tuple(run[-1, 3:6].tolist())) / stiff
            wrong = f"in a turn to {name} the ship does not heel outwards as ships do: roll moment (K_v, K_r, z)"
            yield from ranged(
                f"heel outwards in a hard turn to {name}", math.degrees(outwards), "deg", limit.HEEL, wrong
            )
