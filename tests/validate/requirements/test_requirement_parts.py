"""Items of the requirements, their words and the figures that they rest on, for ships whose rates are written down."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from plain_ships import LIMIT, L, U, plain

from seatrial.actuators import Actuator, Actuators
from seatrial.core.parameters import update, values
from seatrial.ships.files import load
from seatrial.validate.requirements import (
    Finding,
    body,
    control,
    hull,
    judged,
    propulsion,
    scopes,
    steering,
    weather,
    worst,
)
from seatrial.validate.requirements import thresholds as limit
from seatrial.validate.requirements.probe import Probe
from seatrial.validate.requirements.thresholds import Bound, least, most


def names(found: Any, *, wrong: bool) -> set[str]:
    return {one.what.partition(" (")[0] for one in found if one.holds != wrong}


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [((), "good"), (("a",), "a"), (("a", "b", "a"), "a; b"), (("a", "b", "c"), "a; b; c"),
     (("a", "b", "c", "d"), "a; b; c; and 1 more"), (("a", "b", "c", "d", "e"), "a; b; c; and 2 more")],
)  # fmt: skip
def test_three_reasons_are_told_and_the_rest_counted(wrong: tuple[str, ...], reason: str) -> None:
    found = judged("good", [Finding("x", 1.0, "-", most(2.0, ""), "never"), Finding("shown", 9.0)]
                   + [Finding(one, 3.0, "-", most(2.0, ""), one) for one in wrong])  # fmt: skip
    assert (found.verdict, found.reason) == ("fail" if wrong else "pass", reason)
    with pytest.raises(ValueError, match="without a bound"):
        judged("good", [Finding("shown", 9.0)])


def test_the_worst_point_is_the_one_with_least_room() -> None:
    points = [("a", 1.4), ("b", 0.3), ("c", 1.9)]
    between = worst("x", points, Bound(0.0, 2.0, ""), "at {at}")
    assert (between.what, between.value, between.wrong) == ("x (c)", 1.9, "at c")
    assert worst("x", points, least(0.0, ""), "").value == 0.3
    assert worst("x", points, most(2.0, ""), "").value == 1.9
    assert worst("x", [*points, ("d", 2.5), ("e", -0.1)], Bound(0.0, 2.0, ""), "").what == "x (d)"
    assert math.isnan(worst("x", [("d", 2.5), ("n", math.nan)], Bound(0.0, 2.0, ""), "").value)
    assert worst("x", [("", 1.0)], most(2.0, ""), "").what == "x"


STEADY = lambda m: (0.5 * (m.n - m.u), -m.v, 2.0 * m.d - m.r)  # noqa: E731


@pytest.mark.slow
@pytest.mark.parametrize(("dt", "holds"), [(2.5, True), (62.5, False)])
def test_the_error_of_a_step_is_the_distance_from_a_quarter_of_it(dt: float, holds: bool) -> None:
    p = plain(STEADY, dt=dt)
    found = scopes._step(p)
    greatest = 0.0
    for n, delta in ((1.0, LIMIT), (1.0, -LIMIT), (-1.0, 0.0)):
        coarse, fine = (p.run(n * p.n_P, delta, 15 * L / U, dt=dt / k) for k in (1, 4))
        shared = [int(np.argmin(np.abs(fine.t - t))) for t in coarse.t]
        away = np.hypot(coarse["x"] - fine["x"][shared], coarse["y"] - fine["y"][shared]) / L
        greatest = max(greatest, float(away.max()))
    told = [one for one in found.findings if one.what.startswith("track error")]
    assert [one.what.split(" of ")[1].split(" over")[0] for one in told] == [
        "a hard turn to starboard", "a hard turn to port", "a crash stop"]  # fmt: skip
    assert max(one.value for one in told) == pytest.approx(greatest)
    assert all(one.holds for one in told) == holds
    evidence = found.evidence
    assert evidence["time step"] == (dt, "s")
    assert evidence["in time of one ship length"][0] == pytest.approx(dt * U / L)


@pytest.mark.slow
@pytest.mark.parametrize("factor", [0.9, 1.2, 40.0])
def test_a_ship_computed_faster_than_the_clock_passes(factor: float) -> None:
    """A hundred lengths of 25 s each, in as many seconds by the clock over the factor."""
    now = [0.0]

    def clock() -> float:
        now[0] += 100 * L / U / factor
        return now[0]

    found = scopes._real_time(replace(plain(STEADY), clock=clock))
    assert found.evidence["real-time factor, one ship"][0] == pytest.approx(factor)
    assert found.verdict == ("pass" if factor > 1.0 else "fail")
    assert found.evidence["time per step"][0] == pytest.approx(1e6 * 12.5 / factor)
    assert found.evidence["step"][0] == pytest.approx(12.5e6)


@pytest.mark.parametrize(
    ("damping", "words"),
    [(0.5, "stable on course"), (0.015, "stable, next to neutral, on course"),
     (-0.015, "unstable, next to neutral, on course"), (-0.5, "unstable on course")],
)  # fmt: skip
@pytest.mark.slow
def test_a_course_is_called_what_its_root_says(damping: float, words: str) -> None:
    found = hull.stability(plain(lambda m: (m.n - m.u, -3.0 * m.v, (m.d - (damping + m.q * m.u) * m.r
                                            - m.r**3)), q=0.01 * damping))  # fmt: skip
    root = [one.value for one in found.findings if one.what.startswith("growth of a disturbance to")]
    assert root == pytest.approx([-1.01 * damping] * 2, rel=1e-3)
    assert f"{words} at 2 m/s" in found.reason or found.verdict == "fail"
    quarter = [one.value for one in found.findings if one.what == "the same at a quarter of the speed"]
    assert quarter == pytest.approx([-damping * 1.0025], rel=1e-3)


@pytest.mark.slow
def test_a_kink_has_a_root_for_each_side_and_each_side_answers_to_its_own() -> None:
    """Damped to starboard, growing to port up to where the cube holds it, r^2 = .08; their mean is no root."""
    kinked = plain(lambda m: (m.n - m.u, -3.0 * m.v, m.d - 0.08 * np.abs(m.r) - m.r**3))
    found = hull.stability(kinked)
    shown = {one.what: one.value for one in found.findings}
    assert shown["growth of a disturbance to starboard at the approach"] == pytest.approx(-0.08, rel=1e-3)
    assert shown["growth of a disturbance to port at the approach"] == pytest.approx(0.08, rel=1e-3)
    assert hull._state((-0.08, 0.08)) == "unstable to port and stable to starboard, next to neutral,"
    left = [one for one in found.findings if one.what.startswith("rate of turn left")]
    assert [one.holds for one in left] == [True, True]
    assert left[1].value == pytest.approx(math.sqrt(0.08), rel=1e-3)


@pytest.mark.slow
def test_the_loop_of_a_spiral_is_that_of_the_law() -> None:
    """r = 3 delta - r + x sign(r) turns on to starboard above delta = -x/3, to port below x/3."""
    for x in (0.05, 0.2):
        width = hull.loop(plain(lambda m, x=x: (m.n - m.u, -m.v, 3.0 * m.d - m.r + x * np.sign(m.r))))
        assert width == pytest.approx(2.0 * x / 3.0, abs=math.radians(0.1))
    assert hull.loop(plain(STEADY)) == 0.0


MOVED = ("hull.N_r", "hull.N_v", "hull.Y_v", "hull.Y_r", "rudder.A_R", "rudder.a_H")
VARIANTS = [{}, *({path: factor} for path in MOVED for factor in (0.9, 1.1))]


@pytest.mark.slow
@pytest.mark.parametrize("change", VARIANTS, ids=str)
def test_a_ship_near_neutral_is_not_failed_for_it(change: dict[str, float]) -> None:
    """KVLCC2 with one number a tenth off: its roots to the two sides are -.07 and +.07, and so are its pull-outs."""
    ship = load("kvlcc2")
    numbers = values(ship.model)
    ship = replace(ship, model=update(ship.model, {path: f * numbers[path] for path, f in change.items()}))
    found = hull.stability(Probe.of(ship))
    assert found.verdict == "pass", found.reason


KVLCC2 = load("kvlcc2_l7")


@pytest.mark.parametrize(
    ("numbers", "pushes"),
    [
        ({}, set()),
        ({"hull.R_0": -0.02}, {"sign of the hull's own force against surge"}),
        ({"hull.Y_v": 0.1}, {"sign of the hull's own force against sway"}),
        ({"hull.Y_vvv": 30.0}, {"sign of the hull's own force against sway"}),
        ({"hull.N_r": 0.01, "hull.N_rrr": 0.001}, {"sign of the hull's own force against yaw"}),
        ({"hull.N_rrr": 3.0}, {"sign of the hull's own force against yaw"}),
        ({"rudder.l_R": 0.71}, {"sign of the rudder amidships against yaw"}),
        ({"rudder.gamma_Rp": -0.64}, {"sign of the rudder amidships against sway"}),
    ],
)
def test_the_hull_and_the_rudder_amidships_are_judged_each_by_itself(numbers: Any, pushes: set[str]) -> None:
    from seatrial.core.parameters import update

    probe = Probe(replace(KVLCC2, model=update(KVLCC2.model, numbers)), KVLCC2.speed, 10.4)
    found = list(hull._bare(probe))
    assert len(found) == 5
    assert {one.bound for one in found} == {limit.HULL}
    pushed = names(found, wrong=True)
    assert pushes <= pushed
    assert pushes or not pushed
    assert {name.partition(" against")[0] for name in pushed} <= {name.partition(" against")[0] for name in pushes}
    assert {one.value for one in found} <= {-1.0, 0.0, 1.0}


# --- surroundings --------------------------------------------------------------------------------------------------


def test_wind_and_waves_are_tried_by_vectors_of_their_own_size() -> None:
    p = plain(STEADY)
    angles = np.radians([0.0, 90.0, 210.0])
    wind, waves = weather._around(p, "wind", angles, 2.0), weather._around(p, "waves", angles, 2.0)
    assert wind[:, 0] == pytest.approx(2.0 * 3.0 * U * np.cos(angles))
    assert wind[:, 1] == pytest.approx(2.0 * 3.0 * U * np.sin(angles))
    assert (wind[:, 2:] == 0.0).all()
    assert waves[:, 4] == pytest.approx(2.0 * 0.02 * L * np.cos(angles))
    assert waves[:, 5] == pytest.approx(2.0 * 0.02 * L * np.sin(angles))
    # waves of half a length in deep water: g T^2 / 2 pi = L / 2
    assert 9.81 * waves[:, 6] ** 2 / (2.0 * math.pi) == pytest.approx(0.5 * L)
    assert (waves[:, [0, 1, 2, 3, 7]] == 0.0).all()


@pytest.mark.parametrize("rests", [True, False])
def test_forces_are_accelerations_times_masses_of_a_usual_ship_where_its_own_are_unknown(rests: bool) -> None:
    """1.07 m, 1.8 m and .1 m L^2; at rest where the file claims that, else at the approach."""
    file = None if rests else {"u": (0.5 * U, 2.0 * U)}
    p = plain(lambda m: (m.n - m.u - 0.01 * m.ahead * (1.0 + m.u), -0.04 * m.aside, 0.02 * m.aside), file=file)
    force = weather._forces(p, "wind", 1.0)
    angles = weather._ANGLES
    assert force[:, 0] == pytest.approx(-0.01 * 3.0 * np.cos(angles) * 1.07 * (1.0 if rests else 2.0))
    assert force[:, 1] == pytest.approx(-0.04 * 3.0 * np.sin(angles) * 1.8)
    assert force[:, 2] == pytest.approx(0.02 * 3.0 * np.sin(angles) * 0.1)
    known = plain(lambda m: (m.n - m.u - 0.01 * m.ahead, -0.04 * m.aside, 0.02 * m.aside), file=file,
                  masses=np.diag([1.2, 2.0, 0.09 * L * L]))  # fmt: skip
    force = weather._forces(known, "wind", 1.0)
    displaced = float(known.ship.model.displaced) or 1.2
    assert force[:, 0] == pytest.approx(-0.03 * np.cos(angles) * 1.2 / displaced)
    assert force[:, 1] == pytest.approx(-0.12 * np.sin(angles) * 2.0 / displaced)
    assert force[:, 2] == pytest.approx(0.06 * np.sin(angles) * 0.09 / displaced)


def blown(X: float = 0.01, Y: float = 0.04, lever: float = 0.15) -> Any:
    """A ship in the apparent wind, whose centre of pressure goes aft as the wind does; still air makes no force."""

    def law(m: Any) -> Any:
        a, s = m.ahead + m.u, m.aside + m.v
        size = np.hypot(a, s)
        side = -Y * s * size
        turn = lever * np.where(size > 0, a / np.where(size > 0, size, 1.0), 0.0) * side
        own = X * m.u * np.hypot(m.u, m.v)
        return m.n - m.u - X * a * size + own, side - 30.0 * Y * m.v, turn - m.r

    return plain(law, dt=6.25)


@pytest.mark.slow
def test_a_ship_that_meets_all_of_the_wind_passes_and_one_of_each_fault_fails_by_its_name() -> None:
    assert weather.wind(blown()).verdict == "pass"
    assert "carries the ship to leeward" in weather.wind(blown()).reason
    both = weather.wind_and_waves(blown())
    assert both.verdict == "fail"
    assert "no [waves] force" in both.reason
    for ship, words in ((blown(Y=-0.04), "to windward"), (blown(X=-0.01), "in surge"), (blown(lever=0.0), "yaw moment"),
                        (blown(lever=-0.15), "reversed"), (plain(STEADY), "no [wind] force")):  # fmt: skip
        with np.errstate(all="ignore"):  # one of them is blown away
            found = weather.wind(ship)
        assert found.verdict == "fail"
        assert any(words in one.wrong for one in found.findings if not one.holds), words


# --- the sides, the masses -----------------------------------------------------------------------------------------


def test_differences_of_the_sides_are_told_by_axis() -> None:
    """An even part beside an odd one in each rate: twice the even part over the greater side."""
    for axis in range(3):

        def law(m: Any, axis: int = axis) -> Any:
            odd = [m.u * 0.0, -m.v, -m.r]
            odd[axis] = odd[axis] + (0.2 * m.v * m.u if axis == 0 else 0.5 * (m.v if axis == 1 else m.r) ** 2)
            return tuple(odd)

        found = {one.what.partition(":")[0]: one.value for one in body.sides(plain(law))}
        # sway of .4 U and yaw of .4 (or 1, of the rudder's rows none) at most, of the full speed
        sway, yaw = 2.0 * 0.5 * 0.16 / (0.4 + 0.5 * 0.16), 2.0 * 0.5 * 0.16 / (0.4 + 0.5 * 0.16)
        expected = [2.0, sway, yaw][axis]
        assert found[("surge", "sway", "yaw")[axis]] == pytest.approx(expected)
        assert all(found[name] == pytest.approx(0.0, abs=1e-12) for k, name in enumerate(("surge", "sway", "yaw"))
                   if k != axis)  # fmt: skip


def test_a_gear_is_judged_by_what_its_file_holds() -> None:
    def gear(**numbers: float) -> Any:
        return plain(STEADY, gear=Actuators({"rudder": Actuator(**numbers)}))

    full = {"rate": math.radians(2.5), "low": -LIMIT, "high": LIMIT}
    assert control.limits(gear(**full)).verdict == "pass"
    assert "no greatest rate" in control.limits(gear(low=-LIMIT, high=LIMIT)).reason
    assert "no greatest angle" in control.limits(gear(rate=0.04)).reason
    assert control.delay(gear(**full), ("delta",)).verdict == "pass"
    at_once = control.delay(gear(low=-LIMIT, high=LIMIT), ("n_P", "delta"))
    assert at_once.verdict == "fail"
    assert "n_P, delta obey at once" in at_once.reason or "n_P and delta obey at once" in at_once.reason
    slow_shaft = plain(STEADY, gear=Actuators({"propeller": Actuator(lag=3.0)}))
    assert control.delay(slow_shaft, ("n_P",)).verdict == "pass"
    assert control.delay(slow_shaft, ("n_P", "delta")).verdict == "fail", "the steering gear has to wait"
    assert control.delay(slow_shaft, ()).verdict == "not applicable"


@pytest.mark.parametrize(("rate", "unit_time", "holds"), [
    (65.0 / 28.0, 3.0, True),  # a boat of 15 m at 5 m/s: 15.1 s are five lengths, and what SOLAS asks of every gear
    (2.3, 3.0, False),
    (2.3, 6.0, True),  # slower than SOLAS, but 2.5 lengths: a model, or a ship that is not bound to it
    (600.0, 3.0, False),  # a fiftieth of a length
])  # fmt: skip
def test_a_gear_that_solas_allows_is_one_however_far_the_ship_sails_meanwhile(
    rate: float, unit_time: float, holds: bool
) -> None:
    probe: Any = SimpleNamespace(unit_time=unit_time, limit=LIMIT)
    servo = Actuator(rate=math.radians(rate), low=-math.radians(35.0), high=math.radians(35.0))
    found = list(control._steering_gear(probe, "delta", servo))
    assert all(one.holds for one in found) == holds


@pytest.mark.parametrize(("angle", "due"), [(2.0 * LIMIT, 9.0), (-LIMIT, 9.0)])
def test_what_a_rudder_takes_is_nine_tenths_of_the_step_over_its_rate(angle: float, due: float) -> None:
    servo = Actuator(rate=0.1 * abs(angle), dead_time=2.0)
    assert control._expected(servo, 0.0, angle) == pytest.approx(due + 2.0)


def test_the_swing_is_the_change_by_reversed_revolutions_over_the_stopped_ones() -> None:
    """Yaw .24 n^2 and sway -.03 n^2 of reversed revolutions, at rest and at half the speed at most."""
    p = plain(lambda m: (m.n - m.u, np.where(m.n < 0, -0.03 * m.n**2, 0.0) - m.v + 0.1,
                         np.where(m.n < 0, 0.24 * m.n**2, 0.0) - m.r + 0.2))  # fmt: skip
    yaw, sway = propulsion.swing(p)
    for (at, turn), (_, side) in zip(yaw, sway, strict=True):
        n = float(at.split("-")[-1].split()[0])
        assert n in (0.6, 1.0)
        assert turn == pytest.approx(0.24 * n * n)
        assert side == pytest.approx(-0.03 * n * n)
    assert propulsion.reversing(p).verdict == "pass"
    assert "to starboard" in propulsion.reversing(p).reason
    left = plain(lambda m: (m.n - m.u, np.where(m.n < 0, 0.03, 0.0) - m.v, np.where(m.n < 0, -0.02, 0.0) - m.r))
    assert "right-handed propeller swings the stern to port" in propulsion.reversing(left).reason
    assert propulsion.reversing(plain(STEADY)).reason.startswith("a reversed propeller makes no side force")


def test_a_run_without_drift_or_rudder_is_told_so() -> None:
    still = plain(lambda m: (m.n - m.u, 0.0 * m.v, m.d - m.r))
    assert not still.sways
    assert steering.lateral(still).reason == "turns without drift: it has no sway"
    drifting = plain(lambda m: (m.n - m.u, -0.5 * m.d - m.v, m.d - m.r))
    assert steering.lateral(drifting).verdict == "pass"
    assert steering.lateral(plain(lambda m: (m.n - m.u, 0.5 * m.d - m.v, m.d - m.r))).verdict == "fail"
    assert propulsion.speed_by_revolutions(plain(lambda m: (-m.u, -m.v, m.d - m.r))).reason.endswith("no propeller")
