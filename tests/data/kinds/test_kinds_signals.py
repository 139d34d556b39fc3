"""What a trial shows of its kind: speeds, headings, held values; each kind on both sides of its bounds."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from seatrial.data import Array, Trial
from seatrial.data.kinds.kind import Kind
from seatrial.data.kinds.signals import Signals, _breaks, _clock, both_ways, filled, signals, smooth
from seatrial.data.kinds.speed import berthing, courses, resting, stopping, straight
from seatrial.data.kinds.steering import _circling, turning, zigzag

DEGREE = math.pi / 180.0
T = np.arange(200.0)
NAN = np.nan


def seen(**given: Any) -> Signals:
    """A ship of 50 m that goes straight on at 1 m/s; what is given is otherwise."""
    still: dict[str, Any] = {"psi": 0.0, "r": 0.0, "u": 1.0, "v_m": 0.0, "delta": None, "n": None, **given}
    wide = {name: value if value is None else np.broadcast_to(np.asarray(value, dtype=np.float64), T.size)
            for name, value in still.items() if name not in ("reach", "L_pp", "clock")}  # fmt: skip
    return Signals(T, reach=given.get("reach"), L_pp=given.get("L_pp", 50.0), clock=given.get("clock", 8.0), **wide)


def part(share: float, first: float, then: float) -> Array:
    """One value for a share of the time, and another after it."""
    return np.where(200.0 * share > T, first, then)


def name(found: Kind | None) -> str:
    return "" if found is None else found.name


def place(extent: float, aside: float = 0.0) -> Array:
    return np.column_stack([np.linspace(0.0, extent, 200), np.linspace(0.0, aside, 200)])


def test_a_place_is_held_within_a_length_and_slowly() -> None:
    root = math.sqrt(9.81 * 50.0)
    assert name(resting(seen(u=0.029 * root, reach=place(49.0)))) == "station"
    assert name(resting(seen(u=0.031 * root, reach=place(49.0)))) == ""
    assert name(resting(seen(u=0.0, v_m=-0.029 * root, reach=place(10.0, 51.0)))) == ""
    assert name(resting(seen(u=4.9e-4 * root, reach=place(4.9)))) == "at rest"
    assert name(resting(seen(u=5.1e-4 * root, reach=place(4.9)))) == "station"
    assert name(resting(seen(u=4.9e-4 * root, reach=place(5.1)))) == "station"
    assert name(resting(seen(u=4.9e-4 * root, reach=place(4.9), n=-0.1))) == "station"
    assert name(resting(seen(u=0.0, reach=place(1.0), L_pp=NAN))) == ""
    for turn, doubts in ((19.0, 0), (21.0, 1)):
        found = resting(seen(u=0.1, reach=place(10.0), psi=np.linspace(0.0, -turn * DEGREE, 200)))
        assert found is not None
        assert len(found.doubts) == doubts
    found = resting(seen(u=0.1, reach=place(10.0)))
    assert found is not None
    assert "positions within 10 m, 0.2 L; speed below 0.1 m/s" in found.evidence[0]


def test_the_way_is_lost_with_the_engine_stopped() -> None:
    def run(last: float, **more: Any) -> Kind | None:
        return stopping(seen(u=np.linspace(1.0, last, 200), **more))

    assert name(stopping(seen(u=part(0.9, 1.0, 0.34)))) == "stopping"
    assert name(stopping(seen(u=part(0.9, 1.0, 0.36)))) == ""
    stopped = part(0.2, 2.0, 0.0)
    found = stopping(seen(u=part(0.9, 1.0, 0.49), n=stopped))  # .15 more where the engine is known
    assert found is not None
    assert found.doubts == ("the ship has not stopped yet",)
    assert name(stopping(seen(u=part(0.9, 1.0, 0.51), n=stopped))) == ""
    assert name(stopping(seen(u=part(0.9, 1.0, 0.2), n=part(0.2, 2.0, 0.59)))) == "stopping"
    assert name(stopping(seen(u=part(0.9, 1.0, 0.2), n=part(0.2, 2.0, 0.61)))) == ""
    astern = stopping(seen(u=part(0.9, 1.0, 0.2), n=part(0.2, 2.0, -0.3)))
    assert astern is not None
    assert "engine astern" in astern.evidence[1]
    found = stopping(seen(u=part(0.9, 1.0, 0.2), n=part(0.2, 2.0, -0.1)))
    assert found is not None
    assert found.evidence[1] == "engine stopped"
    assert "no revolutions are recorded" in (run(0.0) or Kind("")).doubts
    # it begins at six tenths of its speed or more
    late = np.where(T < 20, 0.61, np.where(T < 100, 1.0, 0.0))
    assert name(stopping(seen(u=late))) == "stopping"
    assert name(stopping(seen(u=np.where(T < 20, 0.59, late)))) == ""
    assert name(run(0.0, delta=5.9 * DEGREE)) == "stopping"
    assert name(run(0.0, delta=-6.1 * DEGREE)) == ""
    assert name(run(0.0, delta=part(0.9, 0.0, 5.9 * DEGREE))) == "stopping"
    assert name(run(0.0, delta=part(0.9, 0.0, 6.1 * DEGREE))) == ""
    assert name(run(0.0, delta=part(0.98, 0.0, 20.0 * DEGREE))) == "stopping"  # a fortieth of the samples


def test_a_straight_run_holds_its_heading_and_its_speed() -> None:
    def heading(turn: float) -> Array:
        return np.linspace(0.0, turn * DEGREE, 200)

    assert name(straight(seen(psi=heading(5.9)))) == "straight"
    assert name(straight(seen(psi=heading(-6.1)))) == ""
    still = straight(seen(psi=heading(8.0), delta=0.0))
    assert still is not None
    assert still.doubts == ("the heading drifts by 8 deg",)
    assert name(straight(seen(psi=heading(359.0), delta=0.0))) == "straight"
    assert name(straight(seen(psi=heading(361.0), delta=0.0))) == ""
    assert name(straight(seen(psi=heading(8.0), delta=part(0.5, 0.0, 1.4 * DEGREE)))) == "straight"
    assert name(straight(seen(psi=heading(8.0), delta=part(0.5, 0.0, 1.6 * DEGREE)))) == ""
    for first, kind in ((0.29, "acceleration"), (0.31, "straight")):
        found = straight(seen(u=part(0.1, first, 1.0)))
        assert found is not None
        assert found.name == kind
        assert ("the speed is not steady" in found.doubts) == (kind == "straight")
    assert name(straight(seen(u=np.where(T < 20, 0.2, np.where(T < 150, 1.0, 0.74))))) == "straight"
    assert name(straight(seen(u=np.where(T < 20, 0.2, np.where(T < 150, 1.0, 0.76))))) == "acceleration"
    slow = straight(seen(u=part(0.06, 0.76, 1.0)))
    assert slow is not None
    assert slow.doubts == ()
    assert name(straight(seen(n=part(0.5, 1.0, -0.21)))) == ""
    assert name(straight(seen(n=part(0.5, 1.0, -0.19)))) == "straight"
    assert (straight(seen(u=None)) or Kind("")).doubts == ("no speed is recorded",)


def test_a_berthing_works_its_engine_both_ways_and_ends_slowly() -> None:
    both = part(0.9, 1.0, -0.21)

    def run(**more: Any) -> str:
        return name(berthing(seen(**{"u": part(0.9, 1.0, 0.2), "n": both, **more})))

    assert run() == "berthing"
    assert run(n=part(0.9, 1.0, -0.19)) == ""
    assert run(n=-np.abs(both)) == ""
    assert run(u=part(0.9, 1.0, 0.59)) == "berthing"
    assert run(u=part(0.9, 1.0, 0.61)) == ""
    assert run(psi=np.linspace(0.0, 39.0 * DEGREE, 200)) == "berthing"
    assert run(psi=np.linspace(0.0, -41.0 * DEGREE, 200)) == ""
    swing = np.where((T > 50) & (T < 60), 1.0, 0.0)
    assert run(psi=74.0 * DEGREE * swing) == "berthing"
    assert run(psi=76.0 * DEGREE * swing) == ""
    for last, doubts in ((0.34, 0), (0.36, 1)):
        found = berthing(seen(u=part(0.9, 1.0, last), n=both))
        assert found is not None
        assert len(found.doubts) == doubts


def test_courses_are_held_for_most_of_the_time() -> None:
    def course(*lengths: int) -> Array:
        """Headings 20 deg apart, held so many rows each, and a ramp for the rest."""
        held = np.concatenate([np.full(rows, 20.0 * DEGREE * k) for k, rows in enumerate(lengths)])
        rest = 20.0 * DEGREE * len(lengths) + 3.0 * DEGREE * np.arange(200 - held.size)
        return np.concatenate([held, rest])

    found = courses(seen(psi=course(100, 100)))
    assert found is not None
    assert found.evidence[0].startswith("2 courses held within 4 deg, ")
    assert name(courses(seen(psi=course(123)))) == "course-keeping"
    assert name(courses(seen(psi=course(115)))) == ""
    assert name(courses(seen(psi=course(100, 100), n=part(0.5, 1.0, -1.0)))) == ""
    assert name(courses(seen(psi=course(*[20] * 9, 19)))) == ""  # nine changes
    assert name(courses(seen(psi=course(*[22] * 9)))) == "course-keeping"


def test_a_turn_without_a_rudder_is_steady_over_three_quarters_of_a_circle() -> None:
    def run(turn: float, wave: float = 0.0) -> str:
        r = turn * DEGREE / 199.0 * (1.0 + wave * np.sin(2.0 * np.pi * T / 10.0))
        return name(_circling(seen(psi=np.linspace(0.0, turn * DEGREE, 200), r=r)))

    assert run(271.0) == "turning"
    assert run(-271.0) == "turning"
    assert run(269.0) == ""
    assert run(-300.0, 0.48) == "turning"  # .34 of its mean
    assert run(300.0, 0.51) == ""
    assert (_circling(seen(psi=np.linspace(0.0, -6.0, 200), r=-0.03)) or Kind("")).settings == {"side": -1.0}


def test_a_rudder_held_through_a_circle() -> None:
    delta = np.where(T < 20, 0.0, -20.0 * DEGREE)
    psi = -np.maximum(T - 20, 0) * 2.1 * DEGREE
    found = turning(seen(delta=delta, psi=psi))
    assert found is not None
    assert (found.name, found.doubts) == ("turning", ())
    assert found.settings == {"rudder": pytest.approx(20.0 * DEGREE), "side": -1.0}
    short = turning(seen(delta=delta, psi=0.4 * psi))
    assert short is not None
    assert any("no full circle" in one for one in short.doubts)
    against = turning(seen(delta=delta, psi=-psi))
    assert against is not None
    assert any("is its sign right" in one for one in against.doubts)
    first = turning(seen(delta=delta, psi=0.15 * psi))  # 56 deg
    assert first is not None
    assert first.name == "initial-turning"
    assert first.settings["heading"] == pytest.approx(57.0 * DEGREE, abs=1.1 * DEGREE)


@pytest.mark.parametrize("heading", [10.0, 20.0])
def test_a_zigzag_is_reversed_at_headings_alike(heading: float) -> None:
    def run(headings: list[float]) -> Kind | None:
        """Legs of 20 rows; the heading goes on lines from one reversal to the next."""
        corner = np.array([0.0, *headings]) * DEGREE
        psi = np.interp(T, 20.0 * np.arange(corner.size), corner)
        delta = np.where(np.arange(200) // 20 % 2 == 0, 20.0, -20.0) * DEGREE
        return zigzag(seen(psi=psi, delta=delta, clock=10.0))

    even = [heading, -heading] * 5
    found = run(even)
    assert found is not None
    assert found.settings["heading"] == pytest.approx(0.9 * heading * DEGREE)  # a row before it turns
    assert found.settings["side"] == 1.0
    assert found.doubts == ()
    shifted = run([one + 1.6 * heading for one in even])
    assert shifted is None or any("middle lies" in one for one in shifted.doubts)
    uneven = even.copy()
    uneven[4] = 1.3 * heading
    told = run(uneven)
    assert told is not None
    assert any("differ by" in one for one in told.doubts)
    uneven[4] = 1.7 * heading
    assert run(uneven) is None


# -- signals


def log(t: Array = T, **channels: Any) -> Trial:
    wide = {key: np.broadcast_to(np.asarray(value, dtype=np.float64), t.size) for key, value in channels.items()}
    return Trial("a", t, wide, meta={"L_pp": 50.0})


def test_a_running_mean_is_even_and_narrower_at_the_ends() -> None:
    assert smooth(np.array([0.0, 3.0, 6.0, 0.0]), 3) == pytest.approx([1.5, 3.0, 3.0, 3.0])
    assert smooth(np.array([0.0, 3.0, 6.0, 0.0, 5.0]), 2) == pytest.approx([1.5, 3.0, 3.0, 11 / 3, 2.5])
    assert smooth(np.array([0.0, 3.0]), 1) == pytest.approx([0.0, 3.0])
    assert filled(np.array([NAN, 1.0, NAN, NAN, 4.0, NAN])) == pytest.approx([1.0, 1.0, 2.0, 3.0, 4.0, 4.0])


def test_the_clock_of_a_ship_is_its_length_over_its_speed() -> None:
    t = np.arange(2001.0)
    fast = np.full(2001, 2.0)
    assert _clock(t, fast, 50.0) == pytest.approx(25.0)
    assert _clock(t, fast, 500.0) == pytest.approx(80.0)  # a twenty-fifth
    assert _clock(t, fast, 4.0) == pytest.approx(5.0)  # five rows
    assert _clock(t, None, 50.0) == pytest.approx(80.0)
    assert _clock(t, fast, NAN) == pytest.approx(80.0)
    assert _clock(t, 0.0 * fast, 50.0) == pytest.approx(80.0)


def test_speeds_of_a_track_are_those_ahead_and_to_starboard() -> None:
    psi = 0.8
    x, y = T * (2.0 * math.cos(psi) - 0.3 * math.sin(psi)), T * (2.0 * math.sin(psi) + 0.3 * math.cos(psi))
    found = signals(log(x=x, y=y, psi=psi))
    assert isinstance(found, Signals)
    assert found.u is not None
    assert found.v_m is not None
    assert found.u == pytest.approx(2.0)
    assert found.v_m == pytest.approx(0.3)
    assert found.top == pytest.approx(math.hypot(2.0, 0.3))
    course = signals(log(x=x, y=y))
    assert isinstance(course, Signals)
    assert course.psi == pytest.approx(math.atan2(y[1], x[1]))
    rate = signals(log(r=0.01 * T))
    assert isinstance(rate, Signals)
    assert rate.psi == pytest.approx(0.005 * T**2)
    assert rate.duration == 199.0


def test_several_rudders_and_engines_are_their_mean_and_orders_stand_for_none() -> None:
    found = signals(log(psi=0.01 * T, delta_1=0.1, delta_2=0.3, delta_1_cmd=9.0, n_P=2.0, f_1=9.0, u=1.0))
    assert isinstance(found, Signals)
    assert found.delta is not None
    assert found.n is not None
    assert (found.delta[0], found.n[0]) == pytest.approx((0.2, 2.0))
    orders = signals(log(psi=0.01 * T, delta_cmd=0.4, throttle_port=0.5, throttle_starboard=0.1, u=1.0))
    assert isinstance(orders, Signals)
    assert orders.delta is not None
    assert orders.n is not None
    assert (orders.delta[0], orders.n[0]) == pytest.approx((0.4, 0.3))
    none = signals(log(psi=0.01 * T, u=1.0))
    assert isinstance(none, Signals)
    assert any("no rudder" in one for one in none.doubts)
    assert signals(log(np.arange(19.0), psi=1.0)) == "19 rows are too few"
    assert isinstance(signals(log(np.arange(20.0), psi=1.0)), Signals)
    assert isinstance(signals(log(u=1.0)), str)


def test_an_engine_that_goes_astern_by_a_fifth_is_worked_both_ways() -> None:
    assert both_ways(seen(n=part(0.9, 1.0, -0.21)))
    assert not both_ways(seen(n=part(0.9, 1.0, -0.19)))
    assert not both_ways(seen(n=part(0.985, 1.0, -1.0)))
    assert not both_ways(seen())


def test_a_stretch_ends_where_its_values_lie_wider_and_not_at_a_spike() -> None:
    values = np.array([0.0, 0.5, 1.0, 1.0, 9.0, 1.0, 1.0, 1.1, 1.1, 5.0, 5.0, 5.0])
    assert _breaks(values, 1.05) == [0, 7, 9, 12]
    assert _breaks(values, 1.2) == [0, 9, 12]
    assert _breaks(values, 5.0) == [0, 12]


def test_the_activity_of_a_trial_is_told_in_its_units() -> None:
    ship = replace(seen(n=part(0.5, 1.0, 2.0), delta=part(0.5, -0.1, 0.2)), u=part(0.5, 1.0, 3.0))
    assert "revolutions 1 to 2 1/s" in ship.activity
    assert "speed 1 to 3 m/s" in ship.activity


def test_what_moved_is_said_of_what_was_measured() -> None:
    held = seen(delta=np.where(T[-1] / 2 > T, 0.0, np.deg2rad(10.0)))
    assert any(one.startswith("rudder 0 to 10 deg, ") for one in held.activity)
    assert not any("rudder" in one for one in seen().activity)


def test_a_spike_ends_no_stretch_and_two_rows_do() -> None:
    level = np.zeros(30)
    level[10], level[20:22] = 5.0, 5.0
    assert _breaks(level, 1.0) == [0, 20, 22, 30]
    level[10:12] = -5.0
    assert _breaks(level, 1.0) == [0, 10, 12, 20, 22, 30]


@pytest.mark.parametrize("speed", [0.5, 8.0])
def test_way_at_the_end_of_a_berthing_is_a_share_of_the_greatest(speed: float) -> None:
    both = np.where(T < 100.0, 1.0, -0.5)
    for last, doubts in ((0.34, 0), (0.36, 1)):
        found = berthing(seen(u=part(0.9, speed, last * speed), n=both))
        assert found is not None
        assert found.doubts == ("it still has way at the end",) * doubts
