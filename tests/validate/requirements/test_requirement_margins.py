"""Each requirement between a ship that just meets it and one that just does not: verdict and figure by the law.

Every case is a ship written down so that the figure of one finding is `x`.  Figures are tried a fifth or so inside and
outside of each end of a bound: a bound that moves by half would take another side.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest
from plain_ships import LIMIT, N_P, L, U, plain
from scipy.optimize import brentq

from seatrial.actuators import Actuator, Actuators
from seatrial.core.symbolic import clip
from seatrial.validate.requirements import (
    Finding,
    body,
    control,
    hull,
    plausible,
    propulsion,
    steering,
    weather,
)


def named(findings: Iterable[Finding], begins: str) -> Finding:
    found = [one for one in findings if one.what.startswith(begins)]
    assert len(found) == 1, (begins, [one.what for one in findings])
    return found[0]


def sign(x: Any) -> Any:
    return np.sign(x)


def sq(x: Any) -> Any:
    return x * np.abs(x)


def speed(m: Any) -> Any:
    return np.hypot(m.u, m.v)


def steered(N: Callable[[Any], Any], X: Callable[[Any], Any] = lambda m: m.n - m.u) -> Any:
    return lambda m: (X(m), 0.0 * m.u, N(m))


def surged(X: Callable[[Any], Any]) -> Any:
    return lambda m: (X(m), 0.0 * m.u, 0.0 * m.u)


Case = tuple[str, Callable[[float], Iterable[Finding]], tuple[float, ...], tuple[float, ...]]
"""What is measured, the findings of a ship whose figure is x, figures that are met and figures that are not."""


RESISTANCE: list[Case] = [
    ("loss of speed ahead", lambda x: hull._coasting(plain(surged(
        lambda m: 0.1 * m.n - sq(m.u) * np.where(m.u > 0, x, 0.02)))), (0.012,), (0.008, -0.01)),
    ("loss of speed astern", lambda x: hull._coasting(plain(surged(
        lambda m: 0.1 * m.n - sq(m.u) * np.where(m.u > 0, 0.02, x)))), (0.012,), (0.008, -0.01)),
    ("power of speed", lambda x: hull._coasting(plain(surged(
        lambda m: 0.1 * m.n - 0.1 * sign(m.u) * np.abs(m.u) ** x))), (0.6, 4.5), (0.4, 6.0)),
    ("resistance astern over", lambda x: hull._coasting(plain(surged(
        lambda m: 0.1 * m.n - sq(m.u) * np.where(m.u > 0, 0.02, 0.02 * x)))), (0.25, 7.0), (0.17, 9.5)),
    ("damping of surge", lambda x: hull._coasting(plain(surged(lambda m: 0.1 * m.n - x * m.u))), (0.0012,), (0.0008,)),
    ("damping of sway", lambda x: hull._damping(plain(lambda m: (m.n - m.u, -x * m.v * speed(m), -m.r)), True),
     (0.036,), (0.024, -0.1)),
    ("damping of yaw", lambda x: hull._damping(plain(
        lambda m: (m.n - m.u, -m.v, -x * m.r * np.hypot(m.u, m.r))), True), (0.036,), (0.024, -0.1)),
    ("speed left in a hard turn", lambda x: hull._turned(plain(surged(
        lambda m: 4.0 * (m.n * (1.0 - (1.0 - x) * np.abs(m.d) / LIMIT) - m.u)))), (0.06, 0.9), (0.04, 1.1)),
]  # fmt: skip


@pytest.mark.parametrize(
    ("held", "kept", "holds"), [(1.25, 0.9, True), (0.8, 0.9, True), (1.25, 1.0, False), (0.8, 1.0, False)]
)
def test_speed_in_a_hard_turn_is_over_that_which_the_ship_holds_straight_ahead(
    held: float, kept: float, holds: bool
) -> None:
    """A table without a propeller holds its own speed, whatever the approach."""
    law = surged(lambda m: 4.0 * (held * (1.0 - (1.0 - kept) * np.abs(m.d) / LIMIT) - m.u) + 0.0 * m.n)
    found = named(hull._turned(plain(law)), "speed left in a hard turn")
    assert found.value == pytest.approx(kept, abs=1e-4)
    assert found.holds == holds


@pytest.mark.slow
def test_hard_turns_at_half_the_revolutions_begin_at_half_the_speed_and_last_twice_as_long() -> None:
    """Each is also one of the turns that the rudder is judged by, and is made once."""
    p = plain(surged(lambda m: m.n - m.u))
    list(hull._turned(p))
    assert {(n / N_P, delta / LIMIT, lasts * U / L, u / U) for n, delta, lasts, u, _ in p.made} == {
        (share, side, 25.0 / share, share) for share in (1.0, 0.5) for side in (1.0, -1.0)
    }
    made = len(p.made)
    steering.turning(p)
    assert len(p.made) == made + 6, "0.3 and 0.6 of the angle at U, 0.3 of it at half, to both sides"


@pytest.mark.slow
@pytest.mark.parametrize(("drift", "loss", "holds"), [(0.05, 0.03, True), (0.05, 0.02, False), (0.2, 0.03, False)])
def test_a_gentle_turn_takes_less_speed(drift: float, loss: float, holds: bool) -> None:
    """Drift and r' = 0.5 at the limit: v_m r of 0.025 asks for half of the loss of 5 % that 0.05 or more asks for."""

    def law(m: Any) -> Any:
        side = m.n * m.d / LIMIT
        return 4.0 * (m.n - loss * np.abs(side) - m.u), -4.0 * (drift * side + m.v), 4.0 * (0.5 * side - m.r)

    found = named(hull._turned(plain(law)), "speed left in a hard turn")
    speed = math.hypot(1.0 - loss, drift)
    hard = min(1.0, drift * 0.5 / speed**2 / 0.05)
    assert found.value == pytest.approx(1.0 - (1.0 - speed) / hard if drift < 0.1 else speed, abs=2e-3)
    assert found.holds == holds


def pulled(x: float, root: float) -> Iterable[Finding]:
    """A ship that is left turning at x to either side, pushed over by any rudder."""
    return hull._pulled_out(plain(steered(lambda m: 3.0 * m.d - m.r + x * sign(m.r))), (root, root))[0]


STABILITY: list[Case] = [
    ("change of the root with speed", lambda x: hull.stability(plain(
        lambda m: (m.n - m.u, -3.0 * m.v, -m.r * (1.0 + x / (0.75 - x) * m.u)))).findings, (0.012,), (0.008,)),
    ("change of the root by half of q", lambda x: hull.stability(plain(
        lambda m: (m.n - m.u, -3.0 * m.v, -m.r * (1.0 + m.q)), q=2.0 * x / (1.0 - 2.0 * x))).findings,
     (0.012,), (0.008,)),
    ("rate of turn left 300 L/U after a pull-out from port", lambda x: pulled(x, -0.024), (0.018,), (0.024,)),
    ("rate of turn left 300 L/U after a pull-out from port", lambda x: pulled(x, 0.024), (0.006,), (0.004,)),
    ("rate of turn left 300 L/U after a pull-out from port", lambda x: pulled(x, 0.016), (0.18,), (0.24,)),
    ("rate of turn left 300 L/U after a pull-out from port", lambda x: pulled(x, -0.016), (0.18,), (0.24,)),
]  # fmt: skip


def massed(m_x: float = 1.07, m_y: float = 1.8, k: float = 0.33, uneven: float = 0.0) -> Any:
    M = [[m_x, 0.0, 0.0], [0.0, m_y, uneven * m_y * L], [0.0, 0.0, (k * L) ** 2]]
    return body.inertia(plain(lambda m: (0.0 * m.u,) * 3, masses=M))


def in_current(x: float, at_rest: bool) -> Iterable[Finding]:
    """A ship that the water takes along by all but a share s: over ground V' = -(V - (1 - s) C) in 4 L/U.

    With the Coriolis terms in it the track is off by s C (t - 1 + exp(-t)), of a current C of .3.
    """
    s = x / (0.3 * (3.0 + math.exp(-4.0)))

    def law(m: Any) -> Any:
        c, k = np.cos(m.psi), np.sin(m.psi)
        ahead, aside = (1.0 - s) * (c * m.north + k * m.east), (1.0 - s) * (c * m.east - k * m.north)
        return -(m.u - ahead) + m.v * m.r, -(m.v - aside) - m.u * m.r, 0.0 * m.r

    return body.current(plain(law, dt=2.5, file=None if at_rest else {"u": (0.1 * U, 2.0 * U)}))


PLAUSIBLE: list[Case] = [
    ("greatest speed", lambda x: plausible._under_orders(plain(lambda m: (x * m.n - m.u, -m.v, -m.r)))[0],
     (1.9,), (2.3,)),
    ("greatest rate of turn", lambda x: plausible._under_orders(plain(
        lambda m: (m.n - m.u, -m.v, x / LIMIT * m.d - m.r)))[0], (9.0,), (12.0,)),
    ("motion left 20", lambda x: plausible._left_alone(plain(
        lambda m: (m.n + 0.05 * math.log(x) * m.u, 0.05 * math.log(x) * m.v, 0.05 * math.log(x) * m.r))),
     (1.0, 0.9), (1.05, 1.3)),
    ("gain of kinetic energy", lambda x: body.energy(plain(
        lambda m: (m.n + 0.05 * x * m.u, 0.05 * x * m.v, 0.05 * x * m.r), masses=np.diag([1.1, 1.9, 200.0]))),
     (), (0.1, 0.4)),
    ("sway by turning", lambda x: body.coriolis(plain(
        lambda m: (1.4 * m.v * m.r + m.n - m.u, -x * m.u * m.r - m.v, -m.r))), (0.12, 1.5), (0.08, 1.8, -0.5)),
    ("surge by drift", lambda x: body.coriolis(plain(
        lambda m: (x * m.v * m.r + m.n - m.u, -0.8 * m.u * m.r - m.v, -m.r))), (0.6, 3.6), (0.4, 4.6, -1.0)),
    ("mass in surge", lambda x: massed(m_x=x), (1.05, 1.5), (1.0, 1.8)),
    ("mass in sway", lambda x: massed(m_y=x), (1.3, 3.6), (1.1, 4.4)),
    ("radius of gyration", lambda x: massed(k=x), (0.3, 0.5), (0.24, 0.62)),
    ("asymmetry", lambda x: massed(uneven=x), (0.018,), (0.025,)),
    ("yaw: difference", lambda x: body.sides(plain(
        lambda m: (m.n - m.u, -m.v, -m.r + 0.4 * x / (0.32 - 0.16 * x) * m.r**2))), (0.36,), (0.45,)),
    ("turn in a current", lambda x: in_current(x, False), (0.9e-3,), (1.2e-3,)),
    ("adrift in a current", lambda x: in_current(x, True), (0.9e-3,), (1.2e-3,)),
]  # fmt: skip


def circling(curve: Callable[[Any], Any], drift: float = 8.0) -> Iterable[Finding]:
    """A ship that soon turns with a given curvature [1/L] by rudder, whatever its speed, its bow inside by degrees."""
    tangent = math.tan(math.radians(drift))
    return steering.turning(plain(lambda m: (
        4.0 * (m.n - m.u), 4.0 * (-tangent * sign(m.d) * m.u - m.v), 4.0 * (curve(m.d) * np.hypot(m.u, m.v) - m.r)
    ))).findings  # fmt: skip


def shares(*of: float) -> Callable[[Any], Any]:
    """Curvature by the share of the rudder, at .3, .6 and 1 of its limit."""
    return lambda d: sign(d) * np.interp(np.abs(d) / LIMIT, [0.0, 0.3, 0.6, 1.0], [0.0, *of])


TURNING: list[Case] = [
    ("curvature of the circle to starboard", lambda x: circling(shares(x, 2 * x, 3 * x)), (0.024,), (0.016,)),
    ("curvature of the circle to port", lambda x: circling(lambda d: shares(0.3, 0.4, 0.5)(d) * np.where(
        d < 0, x / 0.3, 1.0)), (0.024,), (0.016,)),
    ("gain of curvature by more rudder to starboard", lambda x: circling(shares(0.2, 0.2 + x, 0.2 + 2 * x)),
     (0.0012,), (0.0008,)),
    ("gain of curvature by more rudder to port", lambda x: circling(shares(0.2, 0.2 + x, 0.2 + 2 * x)),
     (0.0012,), (0.0008,)),
    ("curvature to starboard over", lambda x: circling(lambda d: shares(0.2, 0.3, 0.4)(d) / np.where(d < 0, x, 1.0)),
     (0.45, 2.3), (0.35, 2.8)),
    ("diameter of the steady circle", lambda x: circling(shares(0.6 / x, 1.2 / x, 2.0 / x)), (0.12, 23.0),
     (0.08, 28.0)),
    ("drift angle", lambda x: circling(shares(0.2, 0.3, 0.4), x), (0.6,), (0.4, -3.0)),
    ("sway by the rudder over", lambda x: steering._side_force(plain(lambda m: (m.n - m.u, x * m.d, m.d))),
     (-1.3, 0.018), (-1.8, 0.025)),
]  # fmt: skip


def inflow(N: Callable[[Any], Any]) -> Iterable[Finding]:
    return steering._inflow(plain(steered(N)))


ANSWER: list[Case] = [
    ("force of the rudder at rest", lambda x: inflow(lambda m: m.d * (sq(m.u) + x / (1.0 - x))), (0.9e-3,), (1.2e-3,)),
    ("force of the rudder at U", lambda x: inflow(
        lambda m: m.d * (x / 0.3 * sq(m.u) + (1.0 - x / 0.3) * sq(m.n))), (0.0012,), (0.0008,)),
    ("the same at a quarter", lambda x: inflow(
        lambda m: m.d * np.abs(m.u) ** (-math.log(x) / math.log(4.0))), (0.024, 0.13), (0.016, 0.18)),
    ("gain of rudder force", lambda x: steering._race(plain(steered(
        lambda m: m.d * np.abs(m.n) ** (math.log1p(x) / math.log(1.6 / 1.3))))), (0.006,), (0.004,)),
    ("kick", lambda x: steering._race(plain(steered(
        lambda m: m.d * (sq(m.u) + 4.0 * x / (1.0 - 4.0 * x) * sq(m.n))))), (0.0012,), (0.0008,)),
    ("yaw by the rudder with sternway", lambda x: steering._sternway(plain(steered(
        lambda m: m.d * m.u**2 * np.where(m.u > 0, 1.0, x)))), (0.018, -0.5), (0.025,)),
    ("change of the answer within 2 L/U, half", lambda x: steering.answer_varies(plain(steered(
        lambda m: m.d * (1.0 + 2.0 * x * (m.u - 1.0)), lambda m: 0.0 * m.n))).findings, (0.012,), (0.008,)),
    ("change of the answer within 2 L/U, 1.3", lambda x: steering.answer_varies(plain(steered(
        lambda m: m.d * (1.0 + x / 0.3 * (m.n - 1.0)), lambda m: 0.0 * m.n))).findings, (0.012,), (0.008,)),
]  # fmt: skip


def held(u: Callable[[Any], Any]) -> Iterable[Finding]:
    """A ship that soon has a given speed by its revolutions."""
    return propulsion.speed_by_revolutions(plain(surged(lambda m: 4.0 * (u(m.n) - m.u)))).findings


def thrust(X: Callable[[Any], Any]) -> Iterable[Finding]:
    return propulsion._thrust(plain(surged(X)))


def astern(X: Callable[[Any], Any]) -> Iterable[Finding]:
    return propulsion._astern(plain(surged(X)))


PROPULSION: list[Case] = [
    ("gain of thrust by revolutions", lambda x: thrust(lambda m: x / 0.08 * m.n), (1.2e-4,), (0.8e-4,)),
    ("bollard pull (", lambda x: thrust(lambda m: 2.0 * x * m.n), (1.2e-4,), (0.8e-4,)),
    ("bollard pull at twice", lambda x: thrust(lambda m: np.abs(m.n) ** math.log2(x)), (1.7, 5.5), (1.3, 7.0)),
    ("gain of thrust by speed", lambda x: thrust(lambda m: m.n * (1.0 + x) ** (m.u / 0.25)), (0.0,), (0.01,)),
    ("gain of steady speed", lambda x: held(lambda n: np.interp(n, [0.25, 0.5, 0.75, 1.0], 0.5 + x * np.arange(4.0))),
     (0.012,), (0.008,)),
    ("steady speed at half", lambda x: held(lambda n: np.abs(n) ** -math.log2(x)), (0.25, 0.75), (0.17, 0.95)),
    ("steady speed astern", lambda x: held(lambda n: np.where(n < 0, x, 1.0) * n), (0.12, 1.2), (0.08, 1.6)),
    ("head reach", lambda x: propulsion._stopping(plain(surged(  # at a steady loss of speed, in ten steps
        lambda m: np.where(m.n < 0, -0.5 / x, 0.0)), dt=min(5.0 * x, 12.5))), (0.25, 36.0), (0.15, 46.0)),
    ("pull astern of reversed", lambda x: astern(lambda m: x / 0.3 * m.n), (1.2e-4,), (0.8e-4,)),
    ("gain of pull astern", lambda x: astern(lambda m: x / 0.3 * m.n), (1.2e-4,), (0.8e-4,)),
    ("bollard pull astern over", lambda x: astern(lambda m: sq(m.n) * np.where(m.n < 0, x, 1.0)),
     (0.17, 1.2), (0.12, 1.5)),
    ("greatest yaw by reversed", lambda x: propulsion.reversing(plain(
        lambda m: (m.n - m.u, -m.v, np.where(m.n < 0, x, 0.0) * m.n**2))).findings, (0.0012,), (0.0008,)),
    ("yaw by the reversed right-handed", lambda x: propulsion.wrong_swing(plain(
        lambda m: (m.n - m.u, np.where(m.n < 0, -0.02, 0.0) - m.v, np.where(m.n < 0, x, 0.0) - m.r))),
     (0.01, 0.3), (-0.01,)),
    ("side force of it at midship", lambda x: propulsion.wrong_swing(plain(
        lambda m: (m.n - m.u, np.where(m.n < 0, -x, 0.0) - m.v, np.where(m.n < 0, 0.02, 0.0) - m.r))),
     (0.01, 0.3), (-0.01,)),
]  # fmt: skip


def tunnel(N: Callable[[Any, Any], Any]) -> Any:
    """A bow thruster of thrust N(revolutions, u), its lever .3 L."""
    gear = Actuators({"n_bow": Actuator(low=-4.0, high=4.0)})
    return plain(lambda m: (m.n - m.u, N(m.own[0], m.u) - m.v, 0.3 * N(m.own[0], m.u) - m.r), "n_bow",
                 file={"u": (0.0, 2.0 * U)}, gear=gear)  # fmt: skip


THRUSTERS: list[Case] = [
    ("n_bow: yaw and sway left", lambda x: control.losses(tunnel(lambda n, u: sq(n) * (1.0 - 2.0 * (1.0 - x) * u)))[0],
     (0.92,), (0.98,)),
    ("n_bow: fall of force", lambda x: control.losses(tunnel(lambda n, u: sq(n) * (1.0 - 4.0 * x * u)))[0],
     (1.2e-4,), (0.8e-4,)),
    ("n_bow: sway by orders", lambda x: control.thrusters(tunnel(lambda n, u: x / 16.0 * sq(n))), (1.2e-4,), (0.8e-4,)),
    ("n_bow: force under way", lambda x: control.thrusters(tunnel(
        lambda n, u: sq(n) * np.where(u > 0.9, x, np.where(u > 0.01, 0.5, 1.0)))), (0.1, 0.9), (1.2, -0.2)),
    ("n_bow: force at twice", lambda x: control.thrusters(tunnel(lambda n, u: sign(n) * np.abs(n) ** math.log2(x))),
     (2.8, 5.5), (2.2, 7.0)),
    ("n_bow: force to port", lambda x: control.thrusters(tunnel(lambda n, u: sq(n) * np.where(n < 0, x, 1.0))),
     (0.45, 2.3), (0.35, 2.8)),
]  # fmt: skip

ANGLES = weather._ANGLES


def blown(Y: Any = None, k_X: float = 0.3, lever: float = 0.1, even: float = 0.0, power: float = 1.0, bump: float = 0.0,
          kind: str = "wind") -> Any:  # fmt: skip
    """Findings on forces of once and twice a wind: drag along and across, its centre aft as the wind goes aft."""
    side = -np.sin(ANGLES) if Y is None else Y
    side = side + even - bump * np.sign(np.round(np.sin(ANGLES), 12)) * (np.abs(np.sin(ANGLES)) > 1.0 - 1e-9)
    one = np.column_stack([-k_X * np.cos(ANGLES), side, side * lever * np.cos(ANGLES)])
    return [*weather._from_all_sides(kind, one, 4.0**power * one), *weather._turned(one)]


def least_side(x: float) -> Any:
    """A side force that from 30 deg off the bow or the stern is x of its greatest, to leeward."""
    power = math.log(abs(x) / 0.5) / math.log(0.5)
    here = np.abs(np.abs(np.sin(ANGLES)) - 0.5) < 1e-9
    return -np.sign(np.sin(ANGLES)) * np.abs(np.sin(ANGLES)) ** power * np.where(here, math.copysign(1.0, x), 1.0)


def apparent(x: float) -> Iterable[Finding]:
    """A drag by a power of the apparent wind: of 4 U from ahead and 2 U from astern, less that of the ship's own."""
    power = brentq(lambda q: (4.0**q - 1.0) / (2.0**q + 1.0) - x, 0.5, 5.0)
    return weather._under_way(plain(lambda m: (
        m.n - m.u - 0.01 * sign(m.ahead + m.u) * np.abs(m.ahead + m.u) ** power, -m.aside - m.v, -m.r)))  # fmt: skip


def gusting(x: float, unseeded: bool) -> Iterable[Finding]:
    """Winds of 3 U that differ by x of it from seed to seed, or from call to call."""
    calls: list[int] = []

    class Blown:
        def __init__(self, seed: int) -> None:
            calls.append(seed)
            self.at = len(calls) if unseeded else seed

        def series(self, dt: float, rows: int) -> Any:
            return np.full((rows, 8), 3.0 * U * x * self.at)

    return weather._gusts(replace(plain(surged(lambda m: m.n - m.u)), gusts=lambda base, seed: Blown(seed)))


WEATHER: list[Case] = [
    ("wind: sway to leeward (", lambda x: blown(least_side(x)), (0.06,), (0.04, -0.1)),
    ("waves: sway to leeward (", lambda x: blown(least_side(x), kind="waves"), (-0.018,), (-0.025,)),
    ("wind: greatest surge", lambda x: blown(k_X=x), (0.024,), (0.016,)),
    ("wind: force at twice", lambda x: blown(power=math.log(x, 4.0)), (3.7, 4.3), (3.4, 4.8)),
    ("waves: force at twice", lambda x: blown(power=math.log(x, 4.0), kind="waves"), (3.2, 4.8), (2.6, 5.5)),
    ("wind: difference of the sides", lambda x: blown(even=x / (2.0 - x), lever=0.0), (0.09,), (0.13,)),
    ("wind: change over", lambda x: blown(bump=math.cos(math.radians(5.0)) / (1.0 - x) - 1.0, lever=0.0),
     (0.22,), (0.3,)),
    ("wind: greatest lever", lambda x: blown(lever=x / math.cos(math.radians(30.0))), (0.006, 0.47), (0.004, 0.58)),
    ("wind: travel", lambda x: blown(lever=x / math.sqrt(2.0)), (0.01, 0.2), (-0.01,)),
    ("wind: head wind over tail", apparent, (1.7,), (1.4,)),
    ("wind: surge to leeward under way", lambda x: weather._under_way(plain(
        lambda m: (m.n - m.u - x / 3.0 * m.ahead, -m.aside - m.v, -m.r))), (0.01, 0.3), (-0.01,)),
    ("wind: leeway", lambda x: weather._adrift(plain(
        lambda m: (m.n - m.u, -(m.v + x * m.aside), -m.r))), (0.0024, 0.28), (0.0016, 0.36)),
    ("gusts: two winds of one seed", lambda x: gusting(x, True), (), (0.3,)),
    ("gusts: winds of two seeds", lambda x: gusting(x, False), (0.0012,), (0.0008,)),
]  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Odd(Actuator):
    """A gear that moves `fast` times as fast as its file says and stops at `far` of its limit."""

    fast: float = field(default=1.0)
    far: float = field(default=1.0)

    def target(self, actual: Any, order: Any) -> Any:
        return clip(order, self.far * self.low, self.far * self.high)

    def advance(self, memory: Any, order: Any, dt: Any) -> Any:
        return super().advance(memory, order, self.fast * dt)


def geared(**gear: float) -> Any:
    return plain(steered(lambda m: m.d), gear=Actuators({"rudder": Odd(
        **{"rate": math.radians(2.5), "low": -LIMIT, "high": LIMIT} | gear)}), dt=1.0)  # fmt: skip


GEAR: list[Case] = [
    ("delta: time of nine tenths", lambda x: control.delay(geared(fast=1.0 / x), ("delta",)).findings,
     (0.85, 1.2), (0.7, 1.35)),
    ("delta: from midships", lambda x: control._limited(geared(rate=LIMIT * U / (x * L)), "delta"),
     (0.024, 2.8), (0.016, 3.5)),
    ("delta: end of an order", lambda x: control._limited(geared(far=x), "delta"), (1.0, 0.995), (0.98, 1.1)),
    ("delta: greatest rate measured", lambda x: control._limited(geared(fast=x), "delta"), (1.0, 0.93), (0.87, 1.1)),
    ("delta: greatest angle", lambda x: control._limited(
        geared(low=-math.radians(x), high=math.radians(x)), "delta"), (12.0, 85.0), (9.0, 100.0)),
]  # fmt: skip
CASES = [*RESISTANCE, *STABILITY, *PLAUSIBLE, *TURNING, *ANSWER, *PROPULSION, *THRUSTERS, *WEATHER, *GEAR]

LONGER = {case[0] for case in TURNING} | {
    "head reach", "steady speed at half", "delta: time of nine tenths",
    "rate of turn left 300 L/U after a pull-out from port", "steady speed astern",
    "speed left in a hard turn", "change of the root with speed", "change of the root by half of q",
    "gain of steady speed", "adrift in a current",
}  # fmt: skip


@pytest.mark.parametrize(
    ("begins", "made", "x", "met"),
    [pytest.param(begins, made, x, met, marks=[pytest.mark.slow] if begins in LONGER else [])
     for begins, made, inside, outside in CASES
     for met, figures in ((True, inside), (False, outside)) for x in figures],
    ids=lambda given: f"{given:g}" if isinstance(given, float) else "" if callable(given) else str(given),
)  # fmt: skip
def test_a_figure_on_either_side_of_its_bound_has_its_own_verdict(
    begins: str, made: Callable[[float], Iterable[Finding]], x: float, met: bool
) -> None:
    with np.errstate(all="ignore"):
        found = named(list(made(x)), begins)
    assert found.value == pytest.approx(x, rel=0.01, abs=2e-6)
    assert found.bound is not None
    assert found.holds == met
