"""The figures of the requirements, for ships whose rates are written down: each follows by hand from the law."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from seatrial.actuators import Actuator, Actuators
from seatrial.core.parameters import update, values
from seatrial.core.symbolic import cos, magnitude, sin
from seatrial.data import Trial
from seatrial.models import Model, kinematics
from seatrial.ships import Ship
from seatrial.ships.files import load
from seatrial.validate.requirements import (
    Finding,
    Judgement,
    body,
    control,
    hull,
    plausible,
    propulsion,
    steering,
    weather,
)
from seatrial.validate.requirements import thresholds as limit
from seatrial.validate.requirements.draws import _together
from seatrial.validate.requirements.probe import Probe

U, L, N_P = 2.0, 50.0, 1.5
LIMIT = math.radians(35.0)


def toy(law: Callable[..., Any], *names: str, masses: Any = None, file: Any = None, gear: Any = None) -> Probe:
    """A ship whose rates are law(u, v, r, n, delta, ...), without dimension; `names` are controls of its own.

    The law may take the environment's wind in ship axes after the controls.
    """
    controlled = ("n_P", "delta", *names)

    @dataclass(frozen=True)
    class Toy(Model):
        @property
        def controls(self) -> Any:
            return controlled

        def pushed(self, push: Any) -> Any:
            return None if masses is None else tuple(np.linalg.solve(np.array(masses), push).tolist())

        def derivative(self, state: Any, control: Any, around: Any) -> Any:
            _, _, psi, u, v, r = state[:6]
            ahead = around.wind_x * cos(psi) + around.wind_y * sin(psi)
            aside = around.wind_y * cos(psi) - around.wind_x * sin(psi)
            X, Y, N = law(u / U, v / U, r * L / U, control[0] / N_P, *control[1:], ahead / U, aside / U, psi)
            return (*kinematics(psi, u, v, r), X * U * U / L, Y * U * U / L, N * U * U / L / L)

    ship = Ship("toy", Toy(), gear or Actuators(), L_pp=L, speed=U, validity=file or {})
    return Probe(ship, U, N_P, dt=1.0)


def value(findings: Iterable[Finding], begins: str) -> float:
    found = [one.value for one in findings if one.what.startswith(begins)]
    assert len(found) == 1, begins
    return found[0]


@pytest.mark.slow
def test_masses_are_those_that_a_push_meets() -> None:
    M = [[1.07, 0.0, 0.0], [0.0, 1.8, 2.0], [0.0, 1.0, (0.3 * L) ** 2]]
    found = list(body.inertia(toy(lambda *x: (0.0 * x[0],) * 3, masses=M)))
    assert value(found, "mass in surge") == pytest.approx(1.07)
    assert value(found, "mass in sway") == pytest.approx(1.8)
    assert value(found, "radius of gyration") == pytest.approx(0.3)
    assert value(found, "asymmetry") == pytest.approx((2.0 - 1.0) / L / 1.8)


@pytest.mark.slow
def test_a_turn_throws_the_ship_outwards_by_its_own_factor() -> None:
    """Y = -c u r - linear damping, which falls out; X = k v r."""
    for c, k in ((0.8, 1.4), (-0.3, 0.2), (2.0, 5.0)):
        probe = toy(lambda u, v, r, n, d, a, b, p, c=c, k=k: (k * v * r + 0.3 * v - r, -c * u * r - 0.4 * r - v, -r))
        found = list(body.coriolis(probe))
        assert value(found, "sway by turning") == pytest.approx(c, abs=1e-9)
        assert value(found, "surge by drift") == pytest.approx(k, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("c", "worst"), [(0.1, -0.2), (-0.1, 2.0)])
def test_energy_of_even_damping_falls_at_twice_its_rate(c: float, worst: float) -> None:
    """E' / E = -2 c U/L, over the speed: the nearest to a gain is the fastest, of a gain itself the slowest."""
    M = np.diag([1.1, 1.9, (0.3 * L) ** 2]).tolist()
    push = toy(lambda u, v, r, n, d, a, b, p: (n - c * u, -c * v, -c * r), masses=M)
    assert value(body.energy(push), "gain of kinetic energy") == pytest.approx(worst)


@pytest.mark.slow
def test_sides_differ_by_what_is_even_in_a_turn() -> None:
    """N = -r + e r^2: twice the even part over the greater side, greatest at full speed, where r is 0.4."""
    e = 0.5
    found = list(body.sides(toy(lambda u, v, r, n, d, a, b, p: (-r * r + u, v, -r + e * r * r))))
    assert value(found, "yaw: difference") == pytest.approx(2 * e * 0.16 / (0.4 + e * 0.16))
    assert value(found, "sway: difference") == pytest.approx(0.0, abs=1e-12)
    assert value(found, "surge: difference") == pytest.approx(0.0, abs=1e-12)
    crabbed = list(body.sides(toy(lambda u, v, r, n, d, a, b, p: (v * u * u, u * u * d, 0.0 * r))))
    assert value(crabbed, "surge: difference") == pytest.approx(2.0)
    assert value(crabbed, "sway: difference") == pytest.approx(0.0, abs=1e-12)


@pytest.mark.slow
def test_a_heading_that_matters_is_the_one_that_matters_most() -> None:
    found = body.heading(toy(lambda u, v, r, n, d, a, b, p: (0.02 * sin(p), v, 0.0 * r)))
    assert value(found, "rates by heading") == pytest.approx(0.02, rel=1e-6)


@pytest.mark.slow
def test_resistance_is_told_as_the_law_has_it() -> None:
    """0.02 u |u| ahead, half as much astern; damping at the approach is its slope."""

    def law(u: Any, v: Any, r: Any, n: Any, d: Any, a: Any, b: Any, p: Any) -> Any:
        return 0.02 * n - u * (0.015 * magnitude(u) + 0.005 * u), -0.5 * v * (v * v + u * u) ** 0.5, -0.3 * r * u

    found = list(hull._coasting(toy(law)))
    assert value(found, "loss of speed ahead") == pytest.approx(0.02)
    assert value(found, "loss of speed astern") == pytest.approx(0.01)
    assert value(found, "power of speed") == pytest.approx(2.0)
    assert value(found, "resistance astern") == pytest.approx(0.5)
    assert value(found, "damping of surge") == pytest.approx(2 * 0.02 * 0.1, rel=1e-5)
    ahead = toy(law, file={"u": (0.2 * U, 2.0 * U)})
    damped = list(hull._damping(ahead, False))
    assert value(damped, "damping of sway") == pytest.approx(0.5)
    # -0.3 r u over r sqrt(u^2 + r^2): the least of the grid at the slowest, hardest turn
    assert value(damped, "damping of yaw") == pytest.approx(0.3 * 0.25 / math.hypot(0.25, 0.5))
    assert value(hull._coasting(ahead), "loss of speed ahead") == pytest.approx(0.02)


@pytest.mark.parametrize(("ratio", "after", "power"), [(2.0, 8.0, 3.0), (2.0, -8.0, 0.0), (4.0, 2.0, 0.5)])
def test_the_power_of_a_resistance(ratio: float, after: float, power: float) -> None:
    assert hull._power(ratio, 1.0, after) == pytest.approx(power)
    assert hull._power(ratio, -1.0, -after) == pytest.approx(power)


@pytest.mark.slow
def test_the_growth_of_a_disturbance_is_the_larger_root_of_sway_and_yaw() -> None:
    """v' = -a v + c r, r' = d v - b r: the roots of a quadratic, in U/L."""
    a, b, c, d = 0.9, 0.6, -0.4, -1.7
    probe = toy(lambda u, v, r, n, k, x, y, p: (n - u, (-a * v + c * r) * u, (d * v - b * r) * u))
    root = 0.5 * (-(a + b) + math.sqrt((a - b) ** 2 + 4 * c * d))
    assert hull.growth(probe, U) * L / U == pytest.approx(root, rel=1e-6)
    assert hull.growth(probe, 0.25 * U) * L / U == pytest.approx(0.25 * root, rel=1e-6)


RUDDER = toy(lambda u, v, r, n, d, a, b, p: (
    n - u, -0.3 * d * (0.6 * u * magnitude(u) + 0.4 * n * n), d * (0.6 * u * magnitude(u) + 0.4 * n * n)))  # fmt: skip
"""A rudder in an inflow of 0.6 of the square of speed and 0.4 of that of the revolutions, its lever 0.3 L."""


@pytest.mark.slow
def test_the_rudder_lives_on_its_inflow() -> None:
    found = list(steering._inflow(RUDDER))
    assert value(found, "force of the rudder at rest") == pytest.approx(0.0, abs=1e-12)
    assert value(found, "force of the rudder at U") == pytest.approx(0.3 * 0.6)
    assert value(found, "the same at a quarter") == pytest.approx(1.0 / 16.0)
    slowest = replace(RUDDER, ship=replace(RUDDER.ship, validity={"u": (0.4 * U, 2 * U)}))
    assert not [one for one in steering._inflow(slowest) if "quarter" in one.what or "rest" in one.what]
    dead = list(steering._inflow(toy(lambda u, v, r, n, d, a, b, p: (n, 0.1 * d, -0.05 * d + d * u * u))))
    assert value(dead, "force of the rudder at rest") == pytest.approx(0.1 / 0.95)


@pytest.mark.slow
def test_the_race_adds_by_the_square_of_the_revolutions() -> None:
    found = list(steering._race(RUDDER))
    gains = []
    for f in (0.1, 0.25, 0.5, 0.75, 1.0):
        force = [0.6 * f * f + 0.4 * (k * max(f, 0.5)) ** 2 for k in (1.0, 1.3, 1.6)]
        gains += [force[1] / force[0] - 1.0, force[2] / force[1] - 1.0]
    assert value(found, "gain of rudder force") == pytest.approx(min(gains))
    assert value(found, "kick") == pytest.approx(0.4 * 0.25)
    none = list(steering._race(toy(lambda u, v, r, n, d, a, b, p: (n, 0 * v, d * u))))
    assert value(none, "gain of rudder force") == 0.0
    assert not none[0].holds


@pytest.mark.slow
def test_astern_the_rudder_works_the_other_way_and_its_side_force_is_its_lever() -> None:
    assert value(steering._sternway(RUDDER), "yaw by the rudder with sternway") == pytest.approx(-0.6)
    assert value(steering._side_force(RUDDER), "sway by the rudder") == pytest.approx(-0.3)
    angles = steering.rudder_yaw(RUDDER, 0.5 * U, [(N_P, 0.2), (0.0, -0.2), (2 * N_P, 0.1)])
    assert angles == pytest.approx([0.2 * (0.15 + 0.4), 0.2 * 0.15, 0.1 * (0.15 + 1.6)])


@pytest.mark.slow
def test_the_answer_to_the_rudder_changes_as_its_inflow_does() -> None:
    """Without surge and damping the heading goes with the force."""
    still = toy(lambda u, v, r, n, d, a, b, p: (0 * n, v * 0, d * (0.6 * u * magnitude(u) + 0.4 * n * n)))
    found = steering.answer_varies(still).findings
    assert value(found, "change of the answer within 2 L/U, half") == pytest.approx(0.6 * 0.75, rel=1e-6)
    assert value(found, "change of the answer within 2 L/U, 1.3") == pytest.approx(0.4 * 0.69, rel=1e-6)


@pytest.mark.slow
def test_a_moment_and_a_damping_that_fall_alike_are_a_change_with_speed() -> None:
    """r' = 40 u (d - r): the slower ship turns as far in the end, by half of the moment."""
    alike = toy(lambda u, v, r, n, d, a, b, p: (0 * n, v * 0, 40.0 * u * (d - r)))
    change = value(steering.answer_varies(alike).findings, "change of the answer within 2 L/U, half")
    assert change == pytest.approx(0.5, abs=1e-6)


def turned(side: float, drift: float) -> Trial:
    """A run straight ahead for four fifths, then on a circle of 3 L radius, its bow inside by `drift` degrees."""
    t = np.arange(0.0, 100.0)
    late = (t >= 80.0).astype(float)
    beta = math.radians(drift) * late
    return Trial("turn", t, {"u": U * np.cos(beta), "v_m": -side * U * np.sin(beta), "r": side * late * U / (3 * L)})


@pytest.mark.parametrize(("moments", "conventional"), [(("N",), False), ((), True), (("N",), True)])
@pytest.mark.parametrize("drift", [12.0, -1.0, -4.0])
def test_an_ordered_moment_turns_a_hull_about_a_point_near_midship_a_rudder_bow_inside(
    moments: tuple[str, ...], conventional: bool, drift: float
) -> None:
    """On a circle of 3 L the point without sway lies 3 L sin(drift) ahead of midship."""
    p: Any = SimpleNamespace(sways=True, moments=moments, conventional=conventional, ship=SimpleNamespace(L_pp=L))
    (found,) = steering._inside(p, turned(1.0, drift), turned(-1.0, drift))
    if conventional:
        assert found.value == pytest.approx(drift)
        assert found.holds == (drift > 0.5)
    else:
        assert found.value == pytest.approx(3.0 * math.sin(math.radians(drift)))
        assert found.holds == (drift > -2.0)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["otter", "wamv_16", "gunnerus"])
def test_thrusters_called_port_and_starboard_stand_there(name: str) -> None:
    ship = load(name)
    y = {side: values(ship.model)[f"thrusters.{side}.y"] for side in ("port", "starboard")}
    swapped = update(ship.model, {"thrusters.port.y": y["starboard"], "thrusters.starboard.y": y["port"]})
    for model, holds in ((ship.model, True), (swapped, False)):
        found = [one for one in control.places(Probe.of(replace(ship, model=model))) if "across" in one.what]
        assert [one.holds for one in found] == [holds] * 2
        assert abs(found[0].value) == pytest.approx(abs(y["port"]) / ship.L_pp, rel=0.05)


def test_circles_are_read_off_the_last_fifth() -> None:
    for side in (1.0, -1.0):
        assert steering._curvature(turned(side, 12.0)) == pytest.approx(side / (3 * L))
    assert value(steering._inside(RUDDER, turned(1, 12.0), turned(-1, 10.0)), "drift angle") == pytest.approx(10.0)
    assert value(steering._inside(RUDDER, turned(1, 8.0), turned(-1, 10.0)), "drift angle") == pytest.approx(8.0)


SCREW = toy(lambda u, v, r, n, d, a, b, p: (
    0.05 * n * magnitude(n) + 0.01 * n * n - 0.02 * n * u - 0.04 * u * magnitude(u),
    0.003 * n * n - 0.003 * n * magnitude(n) - 0.1 * v,
    0.005 * n * magnitude(n) - 0.005 * n * n + r * 0.0))  # fmt: skip
"""Thrust 0.06 n^2 ahead and 0.04 n^2 astern at rest, less by the advance; a right-handed kick when reversed."""


@pytest.mark.slow
def test_thrust_is_told_as_the_law_has_it() -> None:
    found = list(propulsion._thrust(SCREW))
    assert value(found, "bollard pull (") == pytest.approx(0.06 / 4)
    assert value(found, "bollard pull at twice") == pytest.approx(4.0)
    astern = list(propulsion._astern(SCREW))
    assert value(astern, "bollard pull astern over ahead") == pytest.approx(2.0 / 3.0)
    # at U the advance term pushes ahead by 0.02 |n|: the least pull is -0.04 n^2 + 0.02 |n| of the slowest
    pulls = [
        0.04 * n * n - 0.02 * n * f for f in (0.0, 0.1, 0.25, 0.5, 0.75, 1.0, -0.1, -0.25) for n in (0.3, 0.6, 1.0)
    ]
    assert value(astern, "pull astern of reversed") == pytest.approx(min(pulls))
    gains = [0.04 * (b * b - a * a) - 0.02 * (b - a) * f
             for f in (0.0, 0.1, 0.25, 0.5, 0.75, 1.0) for a, b in ((0.3, 0.6), (0.6, 1.0))]  # fmt: skip
    assert value(astern, "gain of pull astern") == pytest.approx(min(gains))


@pytest.mark.slow
def test_a_reversed_propeller_swings_by_its_law() -> None:
    yaw, sway = propulsion.swing(SCREW)
    assert [at for at, _ in yaw] == [at for at, _ in sway]
    assert {round(x, 9) for at, x in yaw if at.endswith("-1 n_P")} == {-0.01}
    assert {round(x, 9) for at, x in sway if at.endswith("-0.6 n_P")} == {round(0.006 * 0.36, 9)}
    shares = {float(at.split()[0]) for at, _ in yaw}
    assert shares == {-0.5, -0.25, -0.1, 0.0, 0.1, 0.25, 0.5}
    found = {one.what.partition(" (")[0]: one for one in propulsion.wrong_swing(SCREW)}
    handed = found["yaw by the reversed right-handed propeller"], found["side force of it at midship"]
    assert [one.holds for one in handed] == [False, False], "that of a left-handed propeller"
    assert found["side force of it at midship"].value == pytest.approx(-0.006)
    lever = found["lever of the side force of the reversed propeller"]
    # no masses are told: those of usual ships, 1.8 m in sway and 0.1 m L^2 in yaw; the stern is farther aft
    assert lever.value == pytest.approx(-0.01 * 0.1 / (0.006 * 1.8))
    assert not lever.holds


@pytest.mark.slow
def test_speed_and_stop_are_those_of_the_law() -> None:
    """u' = n |n| / 10 - u |u| / 10: speed goes with the revolutions; at half of both stops after L/0.2 ln 2."""
    plain = toy(lambda u, v, r, n, d, a, b, p: (0.1 * (n * magnitude(n) - u * magnitude(u)), -v, -r))
    found = propulsion.speed_by_revolutions(plain).findings
    assert value(found, "steady speed at half") == pytest.approx(0.5, abs=1e-3)
    assert value(found, "gain of steady speed") == pytest.approx(0.25, abs=1e-3)
    assert value(found, "head reach") == pytest.approx(5.0 * math.log(2.0), rel=5e-3)
    assert value(found, "steady speed astern") == pytest.approx(1.0, abs=1e-3)


@pytest.mark.slow
def test_what_is_left_of_a_motion_that_fades_evenly() -> None:
    """All velocities fade by exp(-0.1 t U/L): after 20 L/U e^-2 is left, whatever the start."""
    fading = toy(lambda u, v, r, n, d, a, b, p: (0.1 * (n - u), -0.1 * v, -0.1 * r))
    assert value(plausible._left_alone(fading), "motion left 20") == pytest.approx(math.exp(-2.0), rel=2e-2)
    found, _ = plausible._under_orders(toy(lambda u, v, r, n, d, a, b, p: (1.5 * n - u, -v, 3.0 * d - r)))
    assert value(found, "greatest speed") == pytest.approx(1.5, rel=1e-3)
    assert value(found, "greatest rate of turn") == pytest.approx(3.0 * LIMIT, rel=1e-3)
    pushed = toy(lambda u, v, r, n, d, a, b, p: (n - u, 0.002 - v, -r - 0.003))
    assert value(plausible._by_itself(pushed), "acceleration at rest") == pytest.approx(0.003)


GEAR = [(Actuator(rate=0.04, low=-0.6, high=0.6), 0.0, 0.5), (Actuator(rate=0.04, low=-0.6, high=0.6), 0.5, -0.5),
        (Actuator(lag=4.0, low=-0.6, high=0.6), 0.0, 0.5), (Actuator(lag=4.0, rate=0.04), 0.0, 0.5),
        (Actuator(lag=20.0, rate=0.04), 0.0, 0.5), (Actuator(rate=0.04, dead_time=2.5), -0.2, 0.4)]  # fmt: skip


@pytest.mark.parametrize(("gear", "start", "order"), GEAR)
def test_nine_tenths_of_an_order_take_the_time_of_a_fine_integration(gear: Any, start: float, order: float) -> None:
    """y' = clip((order - y)/lag, -rate, rate) after the dead time, by Euler's method in steps of a thousandth."""
    h, y, t = 1e-3, start, float(gear.dead_time)
    while abs(y - start) < 0.9 * abs(order - start):
        slope = (order - y) / gear.lag if gear.lag else math.copysign(math.inf, order - y)
        y += h * min(max(slope, -gear.rate), gear.rate)
        t += h
    assert control._expected(gear, start, order) == pytest.approx(t, rel=2e-3)
    dt = t / 400.0
    answer = control._answer(gear, start, order, dt, 1.5 * t)
    assert answer[0] == start
    assert len(answer) == pytest.approx(601, abs=2)
    assert dt * np.argmax(np.abs(answer - start) >= 0.9 * abs(order - start)) == pytest.approx(t, rel=0.01)


def test_a_gear_reaches_its_limit_at_its_rate() -> None:
    gear = Actuator(rate=math.radians(2.5), low=math.radians(-35.0), high=math.radians(30.0))
    probe = toy(lambda u, v, r, n, d, a, b, p: (n - u, v, d), gear=Actuators({"rudder": gear}))
    found = list(control._limited(probe, "delta"))
    assert value(found, "delta: greatest angle") == pytest.approx(30.0)
    assert value(found, "delta: greatest rate measured") == pytest.approx(1.0, abs=1e-6)
    assert value(found, "delta: end of an order") == pytest.approx(1.0, abs=1e-9)
    assert value(found, "delta: from midships") == pytest.approx(12.0 * U / L)
    rates = [one for one in found if one.what == "delta: greatest rate"]
    assert [one.value for one in rates] == pytest.approx([2.5])
    for factor in (0.5, 2.0):
        assert not control.limit.RATE.holds(factor), "half or double the rate of the file is another gear"


BOW = toy(
    lambda u, v, r, n, d, m, a, b, p: (n - u, 0.02 * m * magnitude(m) * (1 - 0.5 * u) - v, 0.3 * 0.02 * m * magnitude(m)
                                       * (1 - 0.4 * u) - r), "n_bow",
    file={"u": (0.0, 2.0 * U)}, gear=Actuators({"n_bow": Actuator(low=-4.0, high=4.0)}),
)  # fmt: skip
"""A tunnel that pushes 0.02 m |m| and turns by 0.3 of that at rest, and loses half and 0.4 of it at U."""


@pytest.mark.slow
def test_a_side_thruster_is_told_as_the_law_has_it() -> None:
    found = control.thrusters(BOW)
    assert value(found, "n_bow: sway by orders") == pytest.approx(0.02 * 16.0)
    assert value(found, "n_bow: force at twice") == pytest.approx(4.0)
    assert value(found, "n_bow: force to port") == pytest.approx(1.0)
    kept = [1 - 0.5 * 0.1, 1 - 0.4 * 0.1, 1 - 0.5, 1 - 0.4]
    assert value(found, "n_bow: force under way") in (pytest.approx(max(kept)), pytest.approx(min(kept)))
    lost, plots = control.losses(BOW)

    def left(f: float) -> float:
        return math.hypot(1 - 0.5 * f, 0.3 * (1 - 0.4 * f)) / math.hypot(1.0, 0.3)

    assert value(lost, "n_bow: yaw and sway left") == pytest.approx(left(0.5))
    assert value(lost, "n_bow: fall of force") == pytest.approx(min(1.0 - left(0.25), left(0.25) - left(0.5)))
    np.testing.assert_allclose(plots[0].lines[0][2], [left(f) for f in plots[0].lines[0][1]])


ANGLES = weather._ANGLES


def blown(k_X: float = 0.2, k_Y: float = 1.0, lever: float = 0.1, even: float = 0.0, power: float = 1.0) -> Any:
    """Forces of a wind of strength 1 and 2: cosine and sine of its direction, the centre aft as the wind goes aft."""
    X, Y = -k_X * np.cos(ANGLES), -k_Y * np.sin(ANGLES) + even
    one = np.column_stack([X, Y, Y * lever * np.cos(ANGLES)])
    return one, one * 4.0**power


def test_wind_from_all_sides_is_told_as_the_law_has_it() -> None:
    found = list(weather._from_all_sides("wind", *blown()))
    assert value(found, "wind: sway to leeward") == pytest.approx(0.25)  # sin^2 of 30 deg
    assert value(found, "wind: surge to leeward") == pytest.approx(math.cos(math.radians(25.0)) ** 2)
    assert value(found, "wind: greatest surge") == pytest.approx(0.2 / 1.0)
    assert value(found, "wind: force at twice") == pytest.approx(4.0)
    assert value(found, "wind: difference") == pytest.approx(0.0, abs=1e-12)
    # the yaw moment, sin 2 x, changes most over 5 deg: by 2 sin 5 deg about its zero
    assert value(found, "wind: change over") == pytest.approx(2.0 * math.sin(math.radians(5.0)), rel=0.02)
    assert value(weather._from_all_sides("wind", *blown(lever=0.0, even=0.05)), "wind: difference") == pytest.approx(
        0.1 / 1.05
    )
    assert value(weather._from_all_sides("waves", *blown(power=0.5)), "waves: force at twice") == pytest.approx(2.0)
    against = list(weather._from_all_sides("wind", *blown(k_Y=-1.0)))
    assert value(against, "wind: sway to leeward") == pytest.approx(-1.0)


def test_the_centre_of_pressure_goes_aft_as_the_wind_does() -> None:
    found = list(weather._turned(blown(lever=0.1)[0]))
    assert value(found, "wind: greatest lever") == pytest.approx(0.1 * math.cos(math.radians(30.0)))
    assert value(found, "wind: travel") == pytest.approx(0.1 * 2 * math.cos(math.radians(45.0)))
    assert not list(weather._turned(blown(lever=-0.1)[0]))[1].holds


def law_of_wind(u: Any, v: Any, r: Any, n: Any, d: Any, ahead: Any, aside: Any, psi: Any) -> Any:
    """Drag of the apparent wind along and across (u and v add to what comes from ahead and starboard)."""
    a, s = ahead + u, aside + v
    return (n - u - 0.01 * a * magnitude(a) + 0.01 * u * magnitude(u),
            -0.04 * s * magnitude(s) - 0.05 * v * (25.0), -r)  # fmt: skip


@pytest.mark.slow
def test_the_apparent_wind_and_leeway_are_those_of_the_law() -> None:
    ship = toy(law_of_wind)
    found = list(weather._under_way(ship))
    assert value(found, "wind: head wind over tail") == pytest.approx((16.0 - 1.0) / (4.0 + 1.0))
    assert value(found, "wind: sway to leeward under way") == pytest.approx(0.75, rel=1e-6)  # sin^2 60 deg
    assert value(weather._headings(ship, "wind"), "wind: force at other headings") == pytest.approx(0.0, abs=1e-9)
    # drift v: 0.04 (3 - v)^2 = 1.25 v
    v = min(np.roots([0.04, -0.24 - 1.25, 0.36]).real)
    assert value(weather._adrift(ship), "wind: leeway") == pytest.approx(v / 3.0, rel=1e-3)


@pytest.mark.slow
def test_a_force_that_is_fixed_to_the_earth_is_found_out() -> None:
    fixed = toy(lambda u, v, r, n, d, a, b, p: (n - u - (a * cos(p) - b * sin(p)), -v - b, -r))
    assert not next(iter(weather._headings(fixed, "wind"))).holds


def test_gusts_are_apart_by_what_they_differ() -> None:
    class Blown:
        def __init__(self, seed: int) -> None:
            self.seed = seed

        def series(self, dt: float, rows: int) -> Any:
            return np.full((rows, 8), 0.6 * U * self.seed)

    probe = replace(RUDDER, gusts=lambda base, seed: Blown(seed))
    found = list(weather._gusts(probe))
    assert value(found, "gusts: two winds of one seed") == 0.0
    assert value(found, "gusts: winds of two seeds") == pytest.approx(0.2)
    calls = iter(range(9))
    unseeded = replace(RUDDER, gusts=lambda base, seed: Blown(next(calls)))
    assert not next(iter(weather._gusts(unseeded))).holds


@pytest.mark.slow
def test_a_varied_hull_has_the_root_of_a_ship_with_that_number() -> None:
    ship = load("kvlcc2_l7")
    p = Probe.of(ship)
    numbers = values(ship.model)
    usual = hull.growth(p, p.U)

    def root(path: str, factor: float) -> float:
        return hull.growth(replace(p, ship=ship.moved({path: factor * numbers[path]})), p.U)

    for path in ("hull.N_r", "hull.Y_v"):
        assert hull._varied(p, path, 1.5) == pytest.approx(root(path, 1.5))
    effects = {path: size for size, path in hull._effects(p, usual)}
    assert set(effects) == {path for path, value in numbers.items() if value and path.startswith("hull.")}
    assert effects["hull.N_v"] == pytest.approx(abs(root("hull.N_v", 1.5) - usual))
    said, flipped = hull._flip(p, -1.0, ["hull.N_v"], 0.1)
    path, _, factor = said.partition(" times ")
    assert path == "hull.N_v"
    assert flipped is not None
    assert hull.growth(flipped, p.U) == pytest.approx(root(path, float(factor)))
    assert hull.growth(flipped, p.U) * p.unit_time > 0.1


def test_wind_and_waves_have_bounds_of_their_own() -> None:
    """Drift forces of waves are next to nothing from astern; those of the wind never are."""
    bounds = {kind: next(iter(weather._from_all_sides(kind, *blown()))).bound for kind in ("wind", "waves")}
    assert bounds == {"wind": weather.limit.LEEWARD, "waves": weather.limit.WAVE_LEEWARD}


def test_a_bound_holds_at_its_ends_and_not_beyond_nor_without_a_number() -> None:
    bound = control.limit.Bound(0.5, 2.0, "why")
    assert [bound.holds(x) for x in (0.5, 2.0, 1.0, 0.49, 2.01, math.nan)] == [True, True, True, False, False, False]
    assert str(bound) == "0.5 to 2"
    assert str(control.limit.least(3.0, "")) == "at least 3"
    assert str(control.limit.most(3.0, "")) == "at most 3"
    assert control.limit.least(3.0, "").holds(math.inf)
    assert not control.limit.most(3.0, "").holds(3.1)


def test_findings_of_draws_meet_those_of_the_fitted_ship_by_their_words_and_order() -> None:
    """A worst point lies elsewhere in each draw; the second of two findings of the same words stays the second."""
    fitted = Judgement("pass", "good", (Finding("a (at 1)", 1.0), Finding("a (at 2)", 2.0), Finding("b", 3.0)))
    draws = [Judgement("pass" if k else "fail", "bad" if not k else "good",
                       (Finding(f"a (at {k})", 1.0 + k), Finding("a", 20.0 + k),
                        Finding("b", math.nan if k < 2 else 3.0)))
             for k in range(11)]  # fmt: skip
    found = _together(fitted, draws, 0.8)
    assert found.drawn is not None
    assert found.drawn.bands["a (at 1)"] == pytest.approx((2.0, 10.0))
    assert found.drawn.bands["a (at 2)"] == pytest.approx((21.0, 29.0))
    assert found.drawn.bands["b"] == pytest.approx((3.0, 3.0))
    assert found.drawn.met == pytest.approx(10.0 / 11.0)
    assert found.verdict == "pass"
    assert _together(fitted, draws, 0.95).verdict == "undecided"
    assert "bad" in found.reason
    few = _together(fitted, draws, 0.9).drawn
    assert few is not None
    assert math.isnan(few.bands["b"][0]), "nine of eleven draws give it: less than the level"


@pytest.mark.slow
def test_the_push_of_masses_is_a_surge_a_sway_and_a_yaw() -> None:
    """Of a composed ship the matrix is that of its own body: m + m_x, m + m_y, and the yaw inertia about midship."""
    ship = load("esso_osaka_3m")
    model: Any = ship.model
    M = body.masses(Probe.of(ship))
    assert M is not None
    m = float(model.body.m)
    assert M[0, 0] / m > 1.0
    assert M[1, 1] > M[0, 0]
    assert M[0, 1] == pytest.approx(0.0, abs=1e-9 * m)
    assert M[1, 2] == pytest.approx(M[2, 1], rel=1e-6, abs=1e-9 * m)
    assert 0.2 < math.sqrt(M[2, 2] / m) / ship.L_pp < 0.45


def test_a_turned_thruster_has_its_thrust_at_any_speed_and_a_rudder_has_not() -> None:
    """What changes with speed is then the hull's damping alone, which may be little."""
    bounds = {}
    for name in ("milliampere", "kvlcc2"):
        found = {one.what: one for one in steering.answer_varies(Probe.of(load(name))).findings}
        bounds[name] = [found[f"change of the answer within 2 L/U, {what}"].bound
                        for what in ("half the speed", "1.3 times the revolutions")]  # fmt: skip
    assert bounds == {"milliampere": [None, limit.NOTICEABLE], "kvlcc2": [limit.NOTICEABLE] * 2}
