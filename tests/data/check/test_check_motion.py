"""Drift, track, wind, clocks, gaps and stillness: formulas by motions of known answer, bounds from both sides."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from seatrial.data import Array, Trial
from seatrial.data.check.drift import _Leg, _leg, _of_legs, _rate, _steady, circle, drift_faults
from seatrial.data.check.relations import length_of, noise_of, slides_unseen, window_of
from seatrial.data.check.rows.still import _digit, _lasts, _matters, _runs, _same, still_faults
from seatrial.data.check.sensors import (
    Fault,
    _every,
    _Holes,
    _resolution,
    beyond_faults,
    gap_faults,
    gaps_of,
    sensor_faults,
    stretches,
    wind_faults,
)
from seatrial.data.check.track import _distance_ratio, track_faults
from seatrial.data.prepare import Remedy

DEGREE = math.pi / 180.0
NAN = np.nan


def log(t: Array, length: float | None = 98.0665, name: str = "a", **channels: Any) -> Trial:
    wide = {key: np.broadcast_to(np.asarray(value, dtype=np.float64), t.size) for key, value in channels.items()}
    return Trial(name, t, wide, meta={} if length is None else {"L_pp": length})


def turn(north: float, east: float, side: float = 1.0, rounds: float = 1.6, **more: Any) -> Trial:
    """A steady turn with drift angle in a current: 5 m/s ahead, .5 to the outside, 1 deg/s."""
    t = np.arange(0.0, 360.0 * rounds, 1.0)
    psi = 0.4 + side * DEGREE * t
    u, v = np.full(t.size, 5.0), np.full(t.size, -side * 0.5)
    # the integral of turned steady speeds, in closed form
    x = (u * np.sin(psi) + v * np.cos(psi)) / (side * DEGREE) + north * t
    y = (-u * np.cos(psi) + v * np.sin(psi)) / (side * DEGREE) + east * t
    return log(t, x=x - x[0], y=y - y[0], psi=psi, u=u, v_m=v, **more)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_whole_circle_tells_the_current(side: float) -> None:
    drift = circle(turn(0.3, -0.4, side))
    assert drift is not None
    assert (drift.north, drift.east, drift.speed) == pytest.approx((0.3, -0.4, 0.5), abs=2e-3)
    assert drift.towards == pytest.approx(360.0 - math.degrees(math.atan2(0.4, 0.3)), abs=0.3)
    assert drift.side == side
    assert drift.error < 1e-3
    ground = turn(0.3, -0.4, side)  # speeds over ground tell the same without positions
    c, s = np.cos(ground["psi"]), np.sin(ground["psi"])
    only = log(ground.t, psi=ground["psi"], u=ground["u"] + 0.3 * c - 0.4 * s, v_m=ground["v_m"] - 0.3 * s - 0.4 * c)
    other = circle(only)
    assert other is not None
    assert (other.north, other.east) == pytest.approx((0.3, -0.4), abs=2e-3)


def test_a_circle_begins_a_sixth_of_a_turn_after_the_ship_began_to_turn() -> None:
    assert circle(turn(0.3, 0.0, rounds=1.18)) is not None
    assert circle(turn(0.3, 0.0, rounds=1.15)) is None
    assert circle(turn(0.3, 0.0, rounds=0.9)) is None


def test_a_circle_is_steady_where_no_quarter_of_the_time_turns_much_less() -> None:
    t = np.arange(101.0)
    for slow, steady in ((0.42, True), (0.38, False)):
        rate = np.where(t < 25, slow, 1.0)
        psi = np.concatenate([[0.0], np.cumsum(rate[:-1])])
        assert _steady(-psi, t, -1.0) == steady
        assert _steady(psi, t, 1.0) == steady


def keys(*trials: Trial) -> list[str]:
    return [one.key for one in drift_faults(trials)]


def test_a_drift_is_told_beyond_a_part_of_the_speed_of_the_wind_and_what_is_on_record() -> None:
    assert keys(turn(0.0, 0.09)) == []  # a fiftieth of 5 m/s
    assert keys(turn(0.0, 0.11)) == ["current"]
    assert keys(turn(0.0, 0.3), turn(0.0, 0.3, -1.0)) == ["current"]
    assert keys(turn(0.0, 0.5, U_T=6.3, gamma_T=0.0)) == []
    assert keys(turn(0.0, 0.5, U_T=6.2, gamma_T=0.0)) == ["current"]
    assert keys(turn(-0.3, 0.3, U_C=math.hypot(0.3, 0.3), gamma_C=135.0 * DEGREE)) == []
    assert keys(turn(-0.3, 0.3, U_C=math.hypot(0.3, 0.3), gamma_C=45.0 * DEGREE)) == ["current"]
    (fault,) = drift_faults([turn(0.0, 0.3)])
    assert isinstance(fault.remedy, Remedy)
    assert fault.remedy.nuisance == (("current", 0.3),)
    assert "a drifts 0.3 +- " in fault.evidence
    assert "m/s towards 90 deg" in fault.evidence


def turns_in_wind(to_lee: float, wind: float, length: float = 100.0) -> list[str]:
    """Turns to either side that drift to leeward of a wind from the north-east."""
    angle = 45.0 * DEGREE
    drift = -to_lee * math.cos(angle), -to_lee * math.sin(angle)
    return keys(*(
        log(one.t, length, name=str(one["psi"][-1]), **dict(one.channels))
        for one in (turn(*drift, side, U_T=wind, gamma_T=angle) for side in (1.0, -1.0))
    ))  # fmt: skip


def test_turns_that_drift_to_windward_have_their_wind_turned_round() -> None:
    assert turns_in_wind(0.3, 10.0) == []
    assert turns_in_wind(-0.29, 10.0) == ["wind_to"]
    assert turns_in_wind(-0.31, 10.0) == []  # farther than the wind drives a ship
    assert turns_in_wind(-0.9, 10.0) == ["current"]
    assert turns_in_wind(-0.08, 3.1) == ["wind_to"]
    assert turns_in_wind(-0.08, 2.9) == []  # 3 m/s for 100 m
    assert turns_in_wind(-0.08, 3.1, 120.0) == []
    assert turns_in_wind(-0.08, 2.9, 90.0) == ["wind_to"]
    one = turn(0.3, 0.0, U_T=10.0, gamma_T=0.0)
    assert "wind_to" not in keys(one)  # to one side only
    felt = [turn(0.2, 0.0, side, U_T=10.0, gamma_T=0.0, U_A=12.0, gamma_A=0.1) for side in (1.0, -1.0)]
    assert "wind_to" not in keys(*felt)  # the apparent wind is the witness


def legs(sway: float, north: float, east: float, headings: tuple[float, ...] = (0, 90, 180, 270)) -> list[_Leg]:
    """Straight legs at 5 m/s that drift to one side and in a current."""
    return [_Leg(h * DEGREE, 5.0, sway - north * math.sin(h * DEGREE) + east * math.cos(h * DEGREE), 0.01)
            for h in headings]  # fmt: skip


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_drift_to_one_side_on_every_heading_is_the_compass(side: float) -> None:
    fault = _of_legs(legs(side * 0.1, 0.0, 0.0))
    assert fault is not None
    assert fault.key == "heading_bias"
    off = math.degrees(0.02)
    assert f"heading bias of {-side * off:+.2f} deg" in fault.what
    assert isinstance(fault.remedy, Remedy)
    assert [one.amount for one in fault.remedy.steps] == [(pytest.approx(side * off, abs=5e-3),)] * 2
    assert _of_legs(legs(side * 0.061, 0.0, 0.0)) is not None  # .0122 of the speed
    assert _of_legs(legs(side * 0.059, 0.0, 0.0)) is None


def test_drift_to_one_point_of_the_earth_is_a_current() -> None:
    fault = _of_legs(legs(0.0, -0.3, 0.3))
    assert fault is not None
    assert (fault.key, "towards 135 deg" in fault.evidence) == ("current", True)
    assert f"{math.hypot(0.3, 0.3):.3g} +-" in fault.evidence
    assert _of_legs(legs(0.0, 0.0, 0.11)) is not None
    assert _of_legs(legs(0.0, 0.0, 0.09)) is None  # a fiftieth of 5 m/s
    assert _of_legs(legs(0.0, -0.3, 0.3)[:3]) is None
    assert _of_legs(legs(0.0, 0.0, 0.3, (0.0, 58.0, 0.0, 58.0))) is None  # 29 deg either way: a mean of .875
    assert _of_legs(legs(0.0, 0.0, 0.3, (0.0, 68.0, 0.0, 68.0))) is not None  # 34 deg: .829
    assert _of_legs(legs(0.1, 0.1, 0.0)) is None  # both alike


def leg_and_turn(bias: float, north: float = 0.0, east: float = 0.0, **more: Any) -> Trial:
    """A minute straight ahead, then a turn, in a current, by a compass that is off by so many degrees."""
    hand = np.random.default_rng(3)
    behind = turn(north, east, rounds=1.3)
    t = np.arange(-60.0, behind.t[-1] + 1.0)
    going = t >= 0.0
    psi = np.where(going, 0.4 + DEGREE * t, 0.4)
    c, s = np.cos(psi), np.sin(psi)
    v = np.where(going, -0.5, 0.0)
    over = np.array([5.0 * c - v * s + north, 5.0 * s + v * c + east])
    read = psi - bias * DEGREE + hand.normal(0.0, 1e-4, t.size)
    c, s = np.cos(read), np.sin(read)
    x = np.concatenate([(5.0 * math.cos(0.4) + north) * t[:60], behind["x"]])
    y = np.concatenate([(5.0 * math.sin(0.4) + east) * t[:60], behind["y"]])
    return log(t, x=x, y=y, psi=read, u=over[0] * c + over[1] * s, v_m=over[1] * c - over[0] * s, **more)


@pytest.mark.parametrize(("north", "east"), [(0.0, 0.0), (-0.3, 0.4)])
@pytest.mark.parametrize("bias", [6.0, -4.0])
def test_one_leg_tells_the_compass_where_a_closed_turn_tells_the_water(bias: float, north: float, east: float) -> None:
    (fault,) = drift_faults([leg_and_turn(bias, north, east)])
    assert fault.key == "heading_bias"
    assert f"heading bias of {-bias:+.1f}" in fault.what
    assert isinstance(fault.remedy, Remedy)
    assert fault.remedy.steps[0].amount == pytest.approx((bias,), abs=0.1)


def test_a_leg_beside_a_turn_is_silent_for_a_sound_compass() -> None:
    assert keys(leg_and_turn(0.0)) == []
    assert keys(leg_and_turn(2.5)) == []  # what a propeller or a wind may do
    assert keys(leg_and_turn(0.0, -0.3, 0.4)) == ["current"]
    assert keys(leg_and_turn(6.0, U_T=10.0, gamma_T=0.0)) == []  # a wind that may do it
    assert keys(leg_and_turn(5.0, 0.6, -0.8)) == ["current"]  # a wind may drift the ship 1 m/s: .44 are its half
    assert keys(leg_and_turn(6.0), leg_and_turn(0.0)) == []  # the compass was sound in one of them
    assert keys(leg_and_turn(6.0), leg_and_turn(-6.0)) == []


def test_a_leg_is_found_by_the_heading_where_no_gyro_tells_the_rate() -> None:
    t = np.arange(60.0)
    straight = {"v_m": 0.3 + 0.01 * np.sin(t), "u": 5.0 + 1e-3 * t}
    found = _leg(log(t, psi=0.7 + 1e-4 * np.sin(t), **straight))
    assert found is not None
    assert found.sway == pytest.approx(0.3, abs=0.01)
    assert _rate(log(t, psi=0.7 + 1.2e-3 * t, **straight), 6.0) == pytest.approx(1.2e-3)  # also at the ends
    assert _leg(log(t, psi=0.7 + 1.2e-3 * t, **straight)) is None
    assert _leg(log(t, psi=0.7 - 1.2e-3 * t, **straight)) is None


def test_a_leg_is_the_straight_stretch_at_the_beginning() -> None:
    t = np.arange(60.0)
    rng = np.random.default_rng(0)
    v = 0.05 + rng.normal(0.0, 0.02, 60)

    def leg(straight: int, rate: float = 2e-4, **more: Any) -> _Leg | None:
        bent = t >= straight
        r = np.where(bent, 0.01, rate * (1 + 0.1 * np.sin(t)))
        given = {"psi": 0.7 + 0.01 * np.maximum(t - straight, 0) + 1e-4 * np.sin(t), "v_m": v, "r": r,
                 "u": 5.0 + 1e-3 * t, "delta": np.where(bent, 0.2, 0.0), **more}  # fmt: skip
        return _leg(log(t, **given))

    found = leg(30)
    assert found is not None
    assert found.psi == pytest.approx(0.7, abs=1e-3)
    assert found.speed == pytest.approx(5.0145, abs=1e-3)
    assert found.sway == pytest.approx(float(np.mean(v[:30])))
    assert found.error == pytest.approx(max(float(np.std(v[:30])) / math.sqrt(30), 0.002 * found.speed))
    assert leg(11) is None
    assert leg(12) is not None
    assert leg(30, 0.9e-3) is not None  # r L/u of .0177
    assert leg(30, 1.15e-3) is None  # .0226
    assert leg(30, -1.15e-3) is None
    assert leg(30, delta=3.9 * DEGREE) is not None
    assert leg(30, delta=-4.1 * DEGREE) is None
    found = leg(30, U_C=0.5, gamma_C=0.7 + 0.5 * math.pi)  # a current to starboard
    assert found is not None
    assert found.sway == pytest.approx(float(np.mean(v[:30])) - 0.5, abs=1e-3)


def sailed(kind: str, wind: float = 8.0, scatter: float = 0.0) -> Trial:
    """A turn in a steady wind from 60 deg, logged as the true, the apparent one or from the bow."""
    one = turn(0.0, 0.0, rounds=2.0)
    psi, u, v = one["psi"], one["u"], one["v_m"]
    north, east = wind * math.cos(60 * DEGREE), wind * math.sin(60 * DEGREE)
    north = north + scatter * np.sin(one.t)
    ahead, aside = north * np.cos(psi) + east * np.sin(psi), east * np.cos(psi) - north * np.sin(psi)
    a, b = {"true": (north, east + 0.0 * psi), "apparent": (ahead + u, aside + v), "bow": (ahead, aside)}[kind]
    return one.having(U_T=np.hypot(a, b), gamma_T=np.arctan2(b, a) + 0.0 * psi)


def test_a_true_wind_that_follows_the_bow_is_the_apparent_one() -> None:
    assert keys(sailed("true", scatter=0.5)) == []
    (fault,) = drift_faults([sailed("apparent")])
    assert isinstance(fault.remedy, Remedy)
    assert (fault.key, fault.remedy.steps[0].do, fault.remedy.steps[0].names) == (
        "apparent_as_true", "rename", ("U_A", "gamma_A")
    )  # fmt: skip
    (fault,) = drift_faults([sailed("bow")])
    assert isinstance(fault.remedy, Remedy)
    assert fault.remedy.steps[0].do == "from_bow"
    assert "scatters by 8 m/s" in fault.evidence  # the root of two halves of its square


# -- the wind by two instruments


def winds(true_to: bool = False, felt_to: bool = False, off: float = 0.0) -> list[Fault]:
    t = np.arange(60.0)
    psi, u, v, speed, angle = 0.02 * t, 5.0, 0.3, 8.0, 1.0 + 0.0 * t
    ahead, aside = speed * np.cos(angle - psi) + u, speed * np.sin(angle - psi) + v
    felt = np.arctan2(aside, ahead) + (math.pi if felt_to else 0.0)
    return list(wind_faults(log(t, U_A=np.hypot(ahead, aside) + off, gamma_A=felt, U_T=speed,
                                gamma_T=angle + (math.pi if true_to else 0.0), psi=psi, u=u, v_m=v)))  # fmt: skip


@pytest.mark.parametrize(("true_to", "felt_to", "channels"), [
    (True, False, "gamma_T"), (False, True, "gamma_A"), (True, True, "gamma_T and gamma_A"),
])  # fmt: skip
def test_winds_that_are_told_by_where_they_go(true_to: bool, felt_to: bool, channels: str) -> None:
    assert not winds()
    (fault,) = winds(true_to, felt_to)
    assert (fault.where, fault.key, fault.severity) == (channels, "wind_to", "error")
    assert isinstance(fault.remedy, Remedy)
    assert (fault.remedy.steps[0].amount, fault.remedy.steps[0].unit) == ((180.0,), "deg")


@pytest.mark.parametrize(("off", "told"), [(3.8, False), (4.0, True)])
def test_winds_disagree_by_three_tenths_of_wind_and_speed(off: float, told: bool) -> None:
    assert [one.key for one in winds(off=off)] == ["wind_disagree"] * told  # .3 (8 + 5)


# -- the clock


def clock(t: Array, **more: Any) -> list[Fault]:
    return [one for one in sensor_faults(log(t, u=1.0, **more)) if one.where == "t"]


def test_what_a_clock_can_be() -> None:
    even = np.arange(100.0)
    assert not clock(even)
    (again,) = clock(np.repeat(even[:50], 2))
    assert (again.key, "50 of 99 steps, 50 distinct" in again.evidence) == ("time_repeats", True)
    (back,) = clock(np.concatenate([even[:50], even[40:90]]))
    assert back.key == "time_back"
    (both,) = clock(np.concatenate([even[:50], even[49:60], even[40:79]]))
    assert both.key == "time_back"
    for leap, told in ((1.4, False), (1.6, True)):
        steps = np.ones(99)
        steps[20] = leap
        found = clock(np.concatenate([[0.0], np.cumsum(steps)]))
        assert [one.key for one in found] == ["missing_rows"] * told
    for share, told in ((4, False), (6, True)):  # in a hundred
        steps = np.ones(99)
        steps[:share] = 1.12
        assert [one.key for one in clock(np.concatenate([[0.0], np.cumsum(steps)]))] == ["uneven_steps"] * told
    assert not clock(np.concatenate([[0.0], np.cumsum(np.where(even[:99] % 2, 1.0, 1.09))]))


def test_a_clock_in_whole_seconds_is_quantised_and_rows_that_lack_are_told_by_the_way_of_the_ship() -> None:
    t = np.floor(1.2 * np.arange(100.0))
    (fault,) = clock(t)
    assert fault.key == "time_quantised"
    assert isinstance(fault.remedy, Remedy)
    assert fault.remedy.steps[0].amount == (pytest.approx(t[-1] / 99),)
    lost = np.delete(np.arange(120.0), np.arange(5, 115, 6))
    (fault,) = clock(lost, x=2.0 * lost, y=0.0)
    assert fault.key == "missing_rows"
    (fault,) = clock(t, x=2.4 * np.arange(100.0), y=0.0)
    assert fault.key == "time_quantised"


# -- values, angles, steps


def test_values_beyond_everything_and_angles_in_degrees() -> None:
    t = np.arange(60.0)
    assert not list(beyond_faults(log(t, u=np.where(t == 5, -0.9e15, 1.0))))
    (fault,) = beyond_faults(log(t, u=np.where(t == 5, -1.1e15, 1.0)))
    assert (fault.key, fault.channels) == ("sentinel", ("u",))

    def angle(name: str, value: float) -> list[str]:
        found = [one for one in sensor_faults(log(t, **{name: value * np.sin(t)})) if one.where == name]
        return [f"{one.severity} {one.key}".strip() for one in found]

    top = float(np.max(np.abs(np.sin(t))))
    assert angle("delta", 1.61 / top) == ["error unit"]
    assert angle("delta", 1.59 / top) == []
    assert angle("gamma_T", 6.4 / top) == ["info unit"]
    assert angle("gamma_T", 6.2 / top) == []
    assert angle("gamma_A", 31.0 / top) == ["error unit"]
    assert angle("gamma_C", 29.0 / top) == ["info unit"]


@pytest.mark.parametrize(("top", "step", "slow", "wrong"), [
    (31.0, 0.0, 10.0, True), (29.0, 0.0, 10.0, False), (20.0, 6.6, 10.0, True), (20.0, 6.4, 10.0, False),
    (20.0, 0.0, 0.045, True), (20.0, 0.0, 0.055, False),
])  # fmt: skip
def test_a_thruster_beyond_a_turn_is_in_degrees_where_it_leaps_or_spins(
    top: float, step: float, slow: float, wrong: bool
) -> None:
    """It goes round by a fifth of a radian a row, but for one leap."""
    t = slow * np.arange(101.0)
    alpha = (top - step) * np.arange(101.0) / 99.0 if step > 1.0 else top * np.arange(101.0) / 100.0
    alpha[50:] += step - alpha[1] if step > 1.0 else 0.0
    for name, found in (("alpha_1", wrong), ("alpha_1_cmd", wrong and slow > 1.0)):  # an order may leap
        (fault,) = [one for one in sensor_faults(log(t, **{name: -alpha})) if one.where == name]
        assert (fault.severity == "error") == found


def test_headings_that_wrap_leap_by_a_turn() -> None:
    t = np.arange(60.0)
    psi = np.mod(0.3 * t, 2.0 * math.pi)
    (fault,) = [one for one in sensor_faults(log(t, psi=psi)) if one.key == "wraps"]
    assert (fault.severity, fault.evidence) == ("info", "2 leaps of about 6.283 rad")
    (fault,) = [one for one in sensor_faults(log(t, psi=np.degrees(psi))) if one.key == "wraps"]
    assert fault.severity == "error"
    assert isinstance(fault.remedy, Remedy)
    assert [one.do for one in fault.remedy.steps] == ["multiply", "unwrap"]
    for part, told in ((0.79, False), (0.81, True), (1.19, True), (1.21, False)):
        leap = np.where(t < 30, 0.0, part * 2.0 * math.pi)
        assert bool([one for one in sensor_faults(log(t, psi=leap)) if one.key == "wraps"]) == told


def test_the_steps_of_ordinary_instruments_by_the_length_of_the_ship() -> None:
    t = np.arange(3.0)
    for length, ratio in ((200.0, 1.0), (20.0, 1.0), (5.0, 0.25)):
        trial = log(t, length, psi=0.0, u=0.0, r=0.0, x=0.0)
        assert _resolution(trial, "psi") == pytest.approx(DEGREE)
        assert _resolution(trial, "x") == pytest.approx(0.186 * ratio)
        assert _resolution(trial, "u") == pytest.approx(0.0515 * math.sqrt(ratio))
        assert _resolution(trial, "r") == pytest.approx(DEGREE / 60.0 / math.sqrt(ratio))
    assert _resolution(log(t, None, x=0.0), "x") == pytest.approx(0.186)
    whole = {"y": 0.186, "v_m": 0.0515, "phi": 0.1 * DEGREE, "p": 0.1 * DEGREE, "U_T": 0.515, "U_A": 0.515,
             "gamma_T": DEGREE, "gamma_A": DEGREE, "depth": 0.0}  # fmt: skip
    assert {name: _resolution(log(t, **{name: 0.0}), name) for name in whole} == pytest.approx(whole)


@pytest.mark.parametrize(("step", "key"), [(0.0515, "steps"), (0.0525, "coarse")])
def test_steps_beyond_those_of_instruments_are_coarse(step: float, key: str) -> None:
    t = np.arange(200.0)
    u = step * np.round(1.0 * np.sin(0.05 * t) / step)
    assert [one.key for one in sensor_faults(log(t, u=u))] == [key]
    assert not [*sensor_faults(log(t[:49], u=u[:49]))]
    fine = 0.0015 * np.round(1.0 * np.sin(0.05 * t) / 0.0015)
    assert not [*sensor_faults(log(t, u=fine))]


# -- gaps


def test_an_instrument_slower_than_the_rows_is_complete_where_its_steps_are_even() -> None:
    t = np.arange(200.0)

    def every(*rows: int) -> float:
        values = np.full(200, NAN)
        values[list(rows)] = 1.0
        return _every(t, values)

    assert every(*range(0, 200, 4)) == 4.0
    assert every(*range(0, 200, 18)) == 18.0  # eleven steps
    assert every(*range(0, 200, 20)) == 0.0  # nine
    assert every(*(k for k in range(0, 200, 4) if k != 100)) == 0.0  # one is missing
    assert every(*range(0, 200, 1)) == 0.0
    assert every(*range(5, 200, 4)) == 4.0
    assert every(*range(6, 200, 4)) == 0.0  # it begins a step and a row late
    assert every(*range(0, 195, 4)) == 0.0
    assert every(*(4 * k + k % 2 for k in range(50))) == 5.0  # by five and by three in turn
    assert every(*(4 * k + 2 * (k % 2) for k in range(50))) == 0.0


def test_gaps_are_longer_than_the_step_of_a_channel_and_alike_within_it() -> None:
    t = 0.5 * np.arange(40.0)
    values = np.ones(40)
    values[10:14] = NAN
    values[39] = NAN
    found = _Holes.of(t, values)
    assert found.spans == ((4.5, 7.0), (19.0, 20.0))
    assert (found.usual, found.missing) == (0.5, 5)
    assert found.words(40) == "5 of 40 samples in 2 gaps of up to 2.5 s, the first after t = 4.5 s"
    other = np.ones(40)
    other[11:14] = NAN
    other[39] = NAN
    assert found.same(_Holes.of(t, other))
    other[12:15] = NAN
    other[11] = 1.0
    assert not found.same(_Holes.of(t, other))  # it begins two rows later
    assert not found.same(_Holes.of(t, np.ones(40)))
    first = np.ones(40)
    first[:3] = NAN
    assert _Holes.of(t, first).spans == ((0.0, 1.5),)


def test_short_gaps_of_a_control_are_filled_and_those_of_the_motion_whole() -> None:
    t = np.arange(100.0)
    values = np.where((t > 10) & (t < 20), NAN, 1.0)  # ten steps from one value to the next
    values[50:61] = NAN  # twelve
    trial = log(t, delta=values, u=values)
    (delta,) = [one for one in gap_faults(log(t, delta=values)) if one.key == "gaps"]
    assert isinstance(delta.remedy, Remedy)
    assert [(one.do, one.where, one.amount) for one in delta.remedy.steps] == [
        ("cut", ((50.0, 60.0),), ()), ("fill", (), (10.01,))
    ]  # fmt: skip
    (motion,) = [one for one in gap_faults(log(t, u=values)) if one.key == "gaps"]
    assert motion.severity == "info"  # a fifth of the rows
    assert (delta.severity, len([*gap_faults(trial)])) == ("warning", 1)
    more = np.where((t > 10) & (t < 36), NAN, 1.0)
    (motion,) = [one for one in gap_faults(log(t, u=more)) if one.key == "gaps"]
    assert motion.severity == "warning"
    assert isinstance(motion.remedy, Remedy)
    assert motion.remedy.steps[0].amount == (26.03,)


def test_rows_without_data_at_the_end_and_slow_channels_are_told() -> None:
    t = np.arange(100.0)
    end = np.where(t < 97, 1.0, NAN)
    found = {one.what: one for one in gap_faults(log(t, u=end, psi=end))}
    assert found["rows without data at the end"].evidence == "the last 3 of 100 rows"
    (empty,) = gap_faults(log(t, u=NAN))
    assert (empty.severity, empty.what) == ("error", "no data")
    slow = np.where(t % 4 == 0, 1.0, NAN)
    (fault,) = gap_faults(log(t, u=1.0, depth=slow))
    assert (fault.key, fault.what) == ("slow", "sampled at 0.25 Hz")


def test_gaps_of_an_input_are_filled_and_their_stretches_have_both_ends() -> None:
    t = 0.5 * np.arange(20.0)
    rows = np.zeros(20, dtype=bool)
    rows[[3, 4, 5, 10]] = True
    trial = log(t, delta=1.0, u=1.0)
    assert stretches(t, rows) == ((1.5, 2.5), (5.0, 5.0))
    assert [(one.do, one.amount) for one in gaps_of(trial, rows, "delta").steps] == [("gaps", ()), ("fill", (2.0,))]
    assert [one.do for one in gaps_of(trial, rows, "u").steps] == ["gaps"]


# -- relations


def test_windows_are_ten_ship_times_within_the_trial() -> None:
    t = np.arange(1001.0)
    assert window_of(log(t)) == pytest.approx(10.0 * math.sqrt(10.0))
    assert window_of(log(t, None)) == pytest.approx(50.0)
    assert window_of(log(t, 98100.0)) == pytest.approx(200.0)
    assert window_of(log(t, 0.1)) == pytest.approx(10.0)
    assert length_of(log(t, -5.0)) is None
    assert length_of(log(t, 5.0)) == 5.0


def test_sway_is_unseen_where_it_is_constant_in_a_turn() -> None:
    t = np.arange(40.0)
    assert slides_unseen(log(t, psi=0.3 * t / 39.0, v_m=0.0))
    assert not slides_unseen(log(t, psi=0.15 * t / 39.0, v_m=0.0))
    assert not slides_unseen(log(t, psi=0.3 * t / 39.0, v_m=0.01 * t))
    assert not slides_unseen(log(t, psi=0.3 * t / 39.0))


def test_the_noise_of_a_channel_is_three_tenths_of_its_steps_at_least() -> None:
    t = np.arange(400.0)
    assert noise_of(np.round(0.02 * t)) == pytest.approx(0.3)
    noise = np.random.default_rng(0).normal(0.0, 0.5, 4000)
    assert noise_of(noise) == pytest.approx(0.5, rel=0.05)
    assert noise_of(noise[:19]) == 0.0
    assert noise_of(noise[:20]) > 0.0


# -- stillness


def test_decimal_steps_of_values_and_runs_that_repeat() -> None:
    for step in (1.0, 0.1, 0.01, 1e-3, 1e-4, 1e-5):
        assert _digit(step * np.array([1.0, 7.0, 12.0, NAN])) == pytest.approx(step)
    assert _digit(np.array([0.1234567])) == 0.0
    flags = np.zeros(60, dtype=bool)
    flags[5:25] = flags[30:49] = True
    assert _runs(flags) == [(5, 20)]
    t = 0.5 * np.arange(60.0)
    trial = log(t, u=np.where(t < 10, 0.19, 1.0), psi=1.0, U_T=5.0)
    assert _lasts(trial, 4, 20) == 10.0
    same = _same(trial, "psi", np.abs(trial["u"]))
    assert same is not None
    assert same.sum() == 40  # steps into the rows below a fifth of the speed do not count
    assert _same(trial, "U_T", None) is None
    assert _same(trial, "psi", None) is not None


def test_a_run_matters_where_it_lasts_and_another_channel_varies() -> None:
    t = 0.1 * np.arange(100.0)
    trial = log(t, psi=1.0, r=np.sin(t), u=1.0)
    assert _matters(trial, "psi", 0, 21)
    assert not _matters(trial, "psi", 0, 19)
    assert not _matters(trial, "r", 0, 40)
    rows = np.arange(100)
    assert not _matters(trial.having(r=np.maximum(rows // 2, 2)), "psi", 1, 39)  # 19 values in 39 steps
    assert _matters(trial.having(r=np.maximum(rows // 2, 1)), "psi", 1, 39)
    long = log(10.0 * t, psi=1.0, r=np.sin(t))
    assert not _matters(long, "psi", 0, 0)


@pytest.mark.parametrize(("value", "key"), [(0.0, "zeros"), (0.4, "frozen")])
def test_a_frozen_sensor_is_told_with_when_it_froze(value: float, key: str) -> None:
    t = np.arange(200.0)
    r = 0.01 * np.sin(0.1 * t)
    psi = 0.1 * (1.0 - np.cos(0.1 * t))
    rng = np.random.default_rng(0)
    good = {"r": r + rng.normal(0, 1e-4, 200), "u": 3.0 + rng.normal(0, 0.01, 200), "psi": psi}
    stuck = np.where((t >= 50) & (t <= 120), value, psi + rng.normal(0, 1e-3, 200) + 0.5)
    found, clean = still_faults(log(t, **{**good, "psi": stuck}))
    (fault,) = found
    assert (fault.key, fault.channels) == (key, ("psi",))
    assert "for 70 s from t = 50 s" in fault.evidence
    assert np.flatnonzero(np.isnan(clean["psi"])).tolist() == list(range(50, 121))


# -- positions against speed over ground


def ratio(stretched: float, noise: float = 0.0, rows: int = 100) -> Trial:
    t = np.arange(float(rows))
    speed = 4.0 + np.sin(0.05 * t)
    way = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]))])
    rng = np.random.default_rng(0)
    x, y = (0.6 * way + rng.normal(0, noise, rows) * (noise > 0)), 0.8 * way + rng.normal(0, noise, rows) * (noise > 0)
    return log(t, x=stretched * x, y=stretched * y, U_G=speed)


@pytest.mark.parametrize(("stretched", "key"), [
    (1.03, None), (0.97, None), (1.05, "time_scale"), (0.95, "time_scale"), (1.33, "time_scale"), (1.36, "unit"),
    (0.755, "time_scale"), (0.735, "unit"),
])  # fmt: skip
def test_distances_and_speed_over_ground_differ_by_a_clock_or_a_unit(stretched: float, key: str | None) -> None:
    trial = ratio(stretched)
    assert _distance_ratio(trial) == pytest.approx(stretched, rel=1e-3)
    found = list(track_faults(trial))
    assert [one.key for one in found] == ([key] if key else [])
    if key == "time_scale":
        assert isinstance(found[0].remedy, Remedy)
        assert found[0].remedy.steps[0].amount == (pytest.approx(stretched, rel=1e-3),)


@pytest.mark.parametrize(("clock", "scale", "datum", "turns", "key"), [
    (1.0, 1.0, True, 0.5, "log_scale"), (1.0, 1.0, False, 0.5, "time_scale"), (1.0, 1.0, True, 0.05, "time_scale"),
    (1.1, 1.0, True, 0.5, "time_scale"), (1.0, 1.1, True, 0.5, "time_scale"), (1.0, 1.02, True, 0.5, "log_scale"),
])  # fmt: skip
def test_of_a_clock_places_and_a_speed_the_speed_is_off_where_the_others_are_seen_to_be_right(
    clock: float, scale: float, datum: bool, turns: float, key: str
) -> None:
    """Heading and rate know the clock, places in latitude and longitude are no stretched ones; a gyro may be off."""
    trial = ratio(1.1)
    psi, r = turns * np.sin(0.05 * trial.t), clock * turns * 0.05 * np.cos(0.05 * trial.t) * scale
    meta = {"datum": {"latitude": 54.0, "longitude": 10.0}} if datum else {}
    whole = Trial("a", trial.t, {**trial.channels, "psi": psi, "r": r}, {}, {**trial.meta, **meta})
    [found] = [one for one in track_faults(whole) if one.where != "psi, gamma_G"]
    assert found.key == key
    assert found.severity == ("warning" if key == "log_scale" else "error")
    if key == "log_scale":
        assert found.where == "U_G"
        assert "-9.1%" in found.what
        assert isinstance(found.remedy, Remedy)
        assert found.remedy.steps[0].amount == (pytest.approx(1.1, rel=1e-3),)


def test_a_trial_that_turns_too_little_takes_the_clock_of_another_whose_speed_is_as_far_off() -> None:
    """One logger has one clock; another with another ratio says nothing of this one."""
    datum = {"datum": {"latitude": 54.0, "longitude": 10.0}}

    def log(name: str, stretched: float, turns: float, clock: float = 1.0) -> Trial:
        trial = ratio(stretched)
        psi, r = turns * np.sin(0.05 * trial.t), clock * turns * 0.05 * np.cos(0.05 * trial.t)
        return Trial(name, trial.t, {**trial.channels, "psi": psi, "r": r}, {}, {**trial.meta, **datum})

    straight, turning, other, slow = log("a", 0.92, 0.05), log("b", 0.92, 0.5), log("c", 1.1, 0.5), \
        log("d", 0.92, 0.5, 1.08)  # fmt: skip
    keys = [[one.key for one in track_faults(straight, among) if one.where != "psi, gamma_G"]
            for among in ((), (straight,), (straight, turning), (straight, other), (straight, slow))]  # fmt: skip
    assert keys == [["time_scale"], ["time_scale"], ["log_scale"], ["time_scale"], ["time_scale"]]


def test_distances_need_some_fixes_and_are_not_those_of_noise() -> None:
    assert _distance_ratio(ratio(1.2, 0.3, 400)) == pytest.approx(1.2, abs=0.03)
    assert math.isfinite(_distance_ratio(ratio(1.2, rows=20)))
    assert math.isnan(_distance_ratio(ratio(1.2, rows=19)))


@pytest.mark.parametrize(("heading", "course", "told"), [
    (0.069, 0.1, True), (0.071, 0.1, False), (0.0, 0.4 * DEGREE, False), (0.0, 0.6 * DEGREE, True),
])  # fmt: skip
def test_a_heading_that_follows_the_track_better_than_the_course_is_the_course(
    heading: float, course: float, told: bool
) -> None:
    t = np.arange(60.0)
    trial = log(t, x=3.0 * t, y=0.0, psi=heading, gamma_G=-course)
    assert [one.key for one in track_faults(trial)] == ["course_as_heading"] * told
