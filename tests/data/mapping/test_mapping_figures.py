"""A mapping by its parts: angles, cells, joined values, places aboard, clocks; tables of text and of captive tests."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import polars as pl
import pytest

from seatrial.data import DataError
from seatrial.data.captive import OTHER_LOAD, Captive, _at_midship, _dimensional, _once_each, _plausible
from seatrial.data.mapping.angles import LATITUDE, LONGITUDE, degrees
from seatrial.data.mapping.clocks import NEVER, Stamps, moment
from seatrial.data.mapping.clocks.calendar import days, leap_seconds, offset_of
from seatrial.data.mapping.joining import Series, in_order, joined, reach, single
from seatrial.data.mapping.measured import measured
from seatrial.data.mapping.numbers import lettered, numbers
from seatrial.data.mapping.places import Midship
from seatrial.data.mapping.schema import Apparent, Channel, Ground, Heading, Log, Position, Sensor
from seatrial.data.mapping.tables import Table
from seatrial.data.table import check_time, continued, decimal, disorder, split_row
from seatrial.data.table import numbers as plain_numbers

DEGREE, KNOT, NAN = math.pi / 180.0, 1852.0 / 3600.0, math.nan


def table(decimal: str = ".", **columns: Any) -> Table:
    frame = pl.DataFrame(columns)
    return Table(Path("a.csv"), frame, np.arange(2, 2 + frame.height), frame.width, decimal=decimal,
                 missing=frozenset({"--", ""}))  # fmt: skip


# -- angles and cells


@pytest.mark.parametrize(("cell", "format", "kind", "value"), [
    ("63.5 N", "deg", LATITUDE, 63.5), ("S 63.5", "deg", LATITUDE, -63.5), ("-63.5", "deg", LATITUDE, -63.5),
    ("10.25° W", "deg", LONGITUDE, -10.25), ("6330.0N", "ddmm.mmm", LATITUDE, 63.5),
    ("-01015.0", "ddmm.mmm", LONGITUDE, -10.25), ("63 30", "dms", LATITUDE, 63.5),
    ("63° 30' 36\" S", "dms", LATITUDE, -63.51), ("90", "deg", LATITUDE, 90.0), ("180.0", "deg", LONGITUDE, 180.0),
    ("5959.999", "ddmm.mmm", LATITUDE, 59.0 + 59.999 / 60.0),
])  # fmt: skip
def test_an_angle_in_any_writing(cell: str, format: str, kind: Any, value: float) -> None:
    assert degrees(table(a=[cell, "--"]), "a", None, format, kind) == pytest.approx([value, NAN], nan_ok=True)


@pytest.mark.parametrize(("cell", "format", "kind", "said"), [
    ("90.1", "deg", LATITUDE, "exchanged with longitude"), ("180.1", "deg", LONGITUDE, "in degrees and minutes"),
    ("180.1", "deg", LATITUDE, "in degrees and minutes"), ("6360.0", "ddmm.mmm", LATITUDE, "60 minutes"),
    ("63 60", "dms", LATITUDE, "60 minutes"), ("63 10 60", "dms", LATITUDE, "60 minutes or seconds"),
    ("63.5 E", "deg", LATITUDE, "are latitude and longitude exchanged"), ("63.5 Q", "deg", LATITUDE, "letter"),
    ("north", "deg", LATITUDE, "is no latitude such as 63.4412"),
])  # fmt: skip
def test_what_is_no_angle_is_refused_with_its_row(cell: str, format: str, kind: Any, said: str) -> None:
    with pytest.raises(DataError) as caught:
        degrees(table(a=["1.0" if format != "dms" else "1 0", cell]), "a", None, format, kind)
    assert said in str(caught.value)
    assert "a.csv: column 'a', line 3" in str(caught.value)


def test_letters_are_factors_and_a_zero_needs_none() -> None:
    known = {"P": -1.0, "S": 1.0}
    assert lettered(table(a=["12.5 P", "s 3", "0", "--"]), "a", known, None) == pytest.approx(
        [-12.5, 3.0, 0.0, NAN], nan_ok=True
    )
    assert lettered(table(a=[1.0, 2.0], b=["S", "P"]), "a", known, "b") == pytest.approx([1.0, -2.0])
    for cells, said in ((["1 P", "2"], "no letter"), (["1 P", "2 Q"], "no letter 'q'"), (["x y z"], "is no number")):
        with pytest.raises(DataError, match=said):
            lettered(table(a=cells), "a", known, None)
    assert numbers(table(",", a=["1,5", "--"]), "a") == pytest.approx([1.5, NAN], nan_ok=True)
    assert numbers(table(a=[True, False, None]), "a") == pytest.approx([1.0, 0.0, NAN], nan_ok=True)
    for cells, said, mark in ((["1,5"], 'decimal = ","', "."), (["1.5"], "has a dot", ","), (["inf"], "infinite", "."),
                              (["10:30"], 'format = "iso"', "."), (["3 P"], "give letters", ".")):  # fmt: skip
        with pytest.raises(DataError, match=said):
            numbers(table(mark, a=cells), "a")


# -- channels


def channel(name: str, values: list[float], **more: Any) -> list[float]:
    given = {"unit": "rad", **more}
    return measured(table(a=values), f"channels.{name}", Channel("a", **given))[name].tolist()


def test_a_channel_is_sign_scale_column_and_offset_times_unit() -> None:
    assert channel("psi", [10.0], unit="deg", sign=-1.0, scale=2.0, offset=5.0) == pytest.approx([-15.0 * DEGREE])
    for name, most, unit in (("r", 2 * math.pi, "rad/s"), ("delta", math.pi, "rad"), ("u", 60.0, "m/s"),
                             ("U_G", 60.0, "m/s"), ("v_m", 60.0, "m/s"), ("U_C", 15.0, "m/s"), ("U_T", 120.0, "m/s"),
                             ("U_A", 150.0, "m/s"), ("n_P", 300.0, "1/s"), ("phi", math.pi, "rad"),
                             ("n_P_2", 300.0, "1/s"), ("delta_1_cmd", math.pi, "rad")):  # fmt: skip
        assert channel(name, [0.999 * most], unit=unit) == [0.999 * most]
        with pytest.raises(DataError, match="is the column in another unit"):
            channel(name, [0.0, -1.001 * most], unit=unit)
    for leap, wrong in ((341.0, True), (339.0, False), (-379.0, True), (381.0, False)):
        if wrong:
            with pytest.raises(DataError, match="another unit"):
                channel("psi", [0.0, leap])
        else:
            assert channel("psi", [0.0, leap]) == [0.0, leap]
    assert channel("psi", [0.0, 350.0], unit="deg") == pytest.approx([0.0, 350.0 * DEGREE])


def test_instruments_give_their_channels_in_si() -> None:
    data = table(s=[10.0], c=[90.0], n=[3.0], e=[4.0])
    ground = measured(data, "ground", Ground(speed="s", course="c", unit="kn"))
    assert {name: float(one[0]) for name, one in ground.items()} == pytest.approx(
        {"U_G": 10 * KNOT, "gamma_G": 0.5 * math.pi, "north": 0.0, "east": 10 * KNOT}, abs=1e-12
    )
    parts = measured(data, "ground", Ground(north="n", east="e"))
    assert {name: float(one[0]) for name, one in parts.items()} == {"north": 3.0, "east": 4.0}
    log = measured(data, "log", Log("s", "c", "kn"))
    assert {name: float(one[0]) for name, one in log.items()} == pytest.approx(
        {"u_w": 10 * KNOT, "gamma_w": 0.5 * math.pi}
    )
    assert [*measured(data, "log", Log("s"))] == ["u_w"]
    wind = measured(data, "apparent", Apparent("s", "c", unit="kn", direction_unit="deg", towards=True, sign=-1))
    assert {name: float(one[0]) for name, one in wind.items()} == pytest.approx(
        {"U_A": 10 * KNOT, "gamma_A": 0.5 * math.pi}
    )
    place = measured(table(a=[63.5], b=[-10.0]), "position", Position("a", "b"))
    assert {name: float(one[0]) for name, one in place.items()} == {"latitude": 63.5, "longitude": -10.0}


# -- to midship


def aboard(**channels: float) -> Midship:
    t = np.arange(5.0)
    wide = {"psi": 0.7 + 0.02 * t, "r": np.full(5, 0.02)}
    return Midship(t, {**wide, **{name: np.full(5, value) for name, value in channels.items()}})


def mapping(**more: Any) -> Any:
    return SimpleNamespace(**{"frame": SimpleNamespace(velocity="body"), "position": None, "ground": None, "log": None,
                              "apparent": None, **more})  # fmt: skip


def test_a_log_and_a_mast_off_midship_are_brought_there() -> None:
    """A point forward and to starboard moves by r times its lever: less ahead to starboard, more aside forward."""
    one = aboard(u_w=4.0 - 0.02 * 3.0, u=9.0)
    one.bring(mapping(log=Log("s", place=(40.0, 3.0))))
    assert (one.channels["u_w"][0], one.channels["u"][0]) == pytest.approx((4.0, 9.0))
    two = aboard(u_w=math.hypot(4.0, 1.0), gamma_w=0.0)
    two.channels["gamma_w"] = two.channels["psi"] + math.atan2(1.0, 4.0)
    two.bring(mapping(log=Log("s", "c", place=(40.0, 3.0))))
    assert (two.channels["u"][0], two.channels["v_m"][0]) == pytest.approx((4.0 + 0.06, 1.0 - 0.8))
    three = aboard(u=5.0, v_m=0.2)
    psi = three.channels["psi"]
    north, east = 6.0, -3.0  # where the wind comes from
    ahead = north * np.cos(psi) + east * np.sin(psi) + 5.0 - 0.02 * 2.0
    aside = east * np.cos(psi) - north * np.sin(psi) + 0.2 + 0.02 * (-30.0)
    three.channels |= {"U_A": np.hypot(ahead, aside), "gamma_A": np.arctan2(aside, ahead) + 2.0 * math.pi}
    three.bring(mapping(apparent=Apparent("s", "d", mast=(-30.0, 2.0))))
    assert three.channels["U_T"] == pytest.approx(math.hypot(6.0, 3.0))
    assert three.channels["gamma_T"] == pytest.approx(2.0 * math.pi - math.atan2(3.0, 6.0))
    assert three.channels["gamma_A"] == pytest.approx(np.arctan2(aside, ahead))


def test_fixes_and_speeds_of_an_antenna_are_brought_to_midship() -> None:
    one = aboard(x=100.0, y=50.0)
    psi = one.channels["psi"]
    one.channels["x"] = 100.0 + 20.0 * np.cos(psi) + 4.0 * np.sin(psi)
    one.channels["y"] = 50.0 + 20.0 * np.sin(psi) - 4.0 * np.cos(psi)
    u, v = 5.0 + 0.02 * 4.0, 0.3 + 0.02 * 20.0  # 20 m ahead and 4 m to port
    one.channels |= {"north": u * np.cos(psi) - v * np.sin(psi), "east": u * np.sin(psi) + v * np.cos(psi)}
    del one.channels["r"]
    one.bring(mapping(position=Position("a", "b", antenna=(20.0, -4.0)), ground=Ground(antenna=(20.0, -4.0))))
    assert one.channels["x"] == pytest.approx(100.0)
    assert one.channels["y"] == pytest.approx(50.0)
    assert one.channels["u"] == pytest.approx(5.0)
    assert one.channels["v_m"] == pytest.approx(0.3)
    assert one.channels["r"] == pytest.approx(0.02)
    assert "r by central differences of psi" in one.steps
    earth = aboard(u=3.0, v_m=4.0)
    earth.bring(mapping(frame=SimpleNamespace(velocity="earth")))
    assert earth.channels["u"][0] == pytest.approx(3.0 * math.cos(0.7) + 4.0 * math.sin(0.7))
    assert earth.channels["v_m"][0] == pytest.approx(4.0 * math.cos(0.7) - 3.0 * math.sin(0.7))


# -- joining


def series(t: list[float], **values: list[float]) -> Series:
    return Series(np.array(t), {name: np.array(one) for name, one in values.items()}, np.arange(len(t)))


def test_rows_are_put_in_order_and_repeated_ones_left_out_or_averaged() -> None:
    found, words = in_order(series([2.0, 1.0, 1.0, 1.0], u=[5.0, 3.0, 3.0, 4.0], v=[NAN, NAN, NAN, NAN]))
    assert (found.t.tolist(), found.channels["u"].tolist(), found.rows.tolist()) == (
        [1.0, 1.0, 2.0], [3.0, 4.0, 5.0], [1, 3, 0]
    )  # fmt: skip
    assert words == "sorted by time, 1 rows that repeat others left out"
    for which, value, row in (("first", 3.0, 0), ("last", 4.0, 1), ("mean", 3.5, 1)):
        one, again = single(found, which)
        assert (one.t.tolist(), one.channels["u"].tolist(), again) == ([1.0, 2.0], [value, 5.0], 1)
        assert one.rows[0] == found.rows[row]
    gaps = single(series([1.0, 1.0, 2.0, 2.0], psi=[6.2, 0.2, NAN, 3.0]), "mean")[0].channels["psi"]
    assert gaps == pytest.approx([0.5 * (6.2 + 0.2 + 2 * math.pi), 3.0 + 2 * math.pi * round((gaps[1] - 3) / 6.283)])


def test_values_reach_two_and_a_half_steps_and_held_ones_a_second() -> None:
    one = series([0.0, 0.2, 0.4, 2.0], u=[0.0, 1.0, 2.0, NAN])
    assert reach(one, "u", Sensor()) == pytest.approx(0.5)
    assert reach(one, "u", Sensor(interpolate="hold")) == 1.0
    assert reach(one, "u", Sensor(limit=7.0)) == 7.0
    assert reach(series([0.0, 2.0, 4.0], u=[0.0, 1.0, 2.0]), "u", Sensor(interpolate="hold")) == 5.0
    rows = np.array([-0.1, 0.0, 0.1, 0.3, 0.9, 1.0])
    line = joined(one, "u", Sensor(), rows)
    assert line == pytest.approx([NAN, 0.0, 0.5, 1.5, NAN, NAN], nan_ok=True)
    assert joined(one, "u", Sensor(interpolate="hold"), rows) == pytest.approx([NAN, 0, 0, 1, 2, 2], nan_ok=True)
    assert joined(one, "u", Sensor(interpolate="nearest"), rows + 0.01) == pytest.approx(
        [0.0, 0.0, 1.0, 2.0, NAN, NAN], nan_ok=True
    )
    assert joined(one, "u", Sensor(lag=0.1), np.array([0.0, 0.2])) == pytest.approx([0.5, 1.5])
    with pytest.raises(DataError, match=r"no row within 0\.5 s of a value"):
        joined(one, "u", Sensor(), np.array([9.0, 10.0]))


# -- clocks


def test_the_calendar_its_leap_seconds_and_zones() -> None:
    from datetime import date

    some = [date(1970, 1, 1), date(2000, 2, 29), date(2024, 3, 1), date(2100, 2, 28), date(1999, 12, 31)]
    found = days(*(np.array([getattr(one, part) for one in some]) for part in ("year", "month", "day")))
    assert found.tolist() == [(one - date(1970, 1, 1)).days for one in some]
    gps = np.array([315_964_800, 1_483_228_816, 1_483_228_817, 1_483_228_818]) * 10**9  # the last leap, of 2017
    assert leap_seconds(gps).tolist() == [0, 17, 17, 18]
    hour = 3600 * 10**9
    assert [offset_of(zone) for zone in ("Z", "utc", "+02:00", "-0530", "+14", "+15:00", "+01:60", "Europe/Oslo")] == [
        0, 0, 2 * hour, -5 * hour - hour // 2, 14 * hour, None, None, None
    ]  # fmt: skip


def test_a_time_that_a_person_wrote_is_on_the_first_day_of_the_log() -> None:
    day, second = 86_400 * 10**9, 10**9
    noon = 20_000 * day + 43_200 * second
    utc = Stamps("utc", np.array([noon, noon + second]), 2 * 3600 * second)
    assert moment("14:00:05", utc, noon) == 5.0  # of its zone
    assert moment("2024-10-04T12:00:03Z", utc, noon) == 3.0
    assert moment("2024-10-04T13:00:03+01:00", utc, noon) == 3.0
    of_day = Stamps("day", np.array([3600 * second]))
    assert moment("01:00:30", of_day, 3600 * second) == 30.0
    with pytest.raises(DataError, match="is no time"):
        moment("noon", utc, noon)
    with pytest.raises(DataError, match="is no number"):
        moment("01:00:30", Stamps("plain", np.array([0.0])), 0)
    late = Stamps("day", np.array([NEVER, 10 * second])).days_from(Stamps("day", np.array([day + 5 * second])))
    assert late.values.tolist() == [NEVER, day + 10 * second]
    assert late.zero == day + 10 * second
    assert late.seconds(day) == pytest.approx([NAN, 10.0], nan_ok=True)
    assert Stamps("utc", np.array([1_234_567])).zero == 1_234_000


# -- tables of text


def test_times_rise_and_are_within_three_hundred_years() -> None:
    for t, row, said in (([0.0, NAN], 1, "no time"), ([0.0, 1.1e10], 1, "is it in ms or us"),
                         ([1.0, 1.0], 1, "repeats"),
                         ([0.0, 2.0, 1.0], 2, "goes back (2 then 1)")):  # fmt: skip
        found = disorder(np.array(t))
        assert found is not None
        assert found[0] == row
        assert said in found[1]
    assert disorder(np.array([-9.9e9, 9.9e9])) is None
    with pytest.raises(DataError, match="1 row of numbers; a trial needs at least 2"):
        check_time("a", "t", np.zeros(1), [2])
    with pytest.raises(DataError, match="line 7"):
        check_time("a", "t", np.array([1.0, 1.0]), [5, 7])


def test_padding_at_the_end_goes_on_at_the_median_step() -> None:
    rows = np.array([[0.0, 1.0], [0.5, 1.0], [1.5, 1.0], [2.0, 1.0], [NAN, NAN], [NAN, NAN]])
    found, steps = continued(rows, 0)
    assert found[:, 0].tolist() == [0.0, 0.5, 1.5, 2.0, 2.5, 3.0]
    assert steps == ["time continued over 2 empty rows at the end"]
    assert continued(rows[:4], 0)[1] == []
    assert split_row(' "a" , b ', ",") == ["a", "b"]
    assert decimal("1e3") == 1000.0
    values, lines = plain_numbers("a", ["h,k", "1,2", "", "nan,--"], 1, ["h", "k"], ",", {"--"})
    assert values == pytest.approx(np.array([[1.0, 2.0], [NAN, NAN]]), nan_ok=True)
    assert lines == [2, 4]
    for text, said in (("1", "line 2 has 1 cells, not 2"), ("1,inf", "'k', line 2: infinite"),
                       ("1,x", "'k', line 2: 'x'")):  # fmt: skip
        with pytest.raises(DataError, match=said):
            plain_numbers("a", ["h,k", text], 1, ["h", "k"], ",")


# -- captive tests


def runs(**columns: list[float]) -> Captive:
    count = len(next(iter(columns.values())))
    given = {"U": [2.0] * count, "n_P": [10.0] * count, "X": [0.0] * count, **columns}
    motion, loads = _dimensional({name: np.array(one) for name, one in given.items()}, 5.0, 1000.0, None)
    return Captive("a", motion, loads, 5.0, 1000.0)


def test_the_kind_of_a_run_is_what_moves_by_a_thousandth() -> None:
    assert runs(beta=[0.0, 0.0011, 0.0009]).kinds == ("straight", "drift", "straight")
    assert runs(r=[0.0, 0.0011 * 2 / 5, -0.0009 * 2 / 5]).kinds == ("straight", "yaw", "straight")
    assert runs(delta=[0.0, -0.0011, 0.0009]).kinds == ("straight", "rudder", "straight")
    for name, size in (("u_dot", 4 / 5), ("v_dot", 4 / 5), ("r_dot", 4 / 25)):
        assert runs(**{name: [0.0, 0.0011 * size, -0.0009 * size]}).kinds == ("straight", "PMM", "straight")
    assert runs(beta=[0.1] * 3, r=[0.1] * 3).kinds == ("drift + yaw",) * 3
    assert runs(n_P=[10.0, 10.0, 10.0, 10.49, 9.49]).kinds[3:] == ("straight", "straight" + OTHER_LOAD)
    one = runs(beta=[0.2])
    assert (one.column("u")[0], one.column("v_m")[0]) == pytest.approx((2 * math.cos(0.2), -2 * math.sin(0.2)))
    assert (one.U[0], one.beta[0]) == pytest.approx((2.0, 0.2))


@pytest.mark.parametrize(("over", "across"), [("L^2", 5.0), ("L d", 0.4)])
def test_primed_loads_and_rates_become_newtons_and_radians(over: str, across: float) -> None:
    said: Any = SimpleNamespace(over=over, d=0.4)
    given = {"U": np.array([2.0]), "r'": np.array([0.3]), "Y'": np.array([0.01]), "N'": np.array([0.02])}
    motion, loads = _dimensional(given, 5.0, 1000.0, said)
    force = 0.5 * 1000.0 * 5.0 * across * 4.0
    assert motion[0, 2] == pytest.approx(0.3 * 2.0 / 5.0)
    assert (loads["Y"][0], loads["N"][0]) == pytest.approx((0.01 * force, 0.02 * force * 5.0))


def test_moments_are_moved_to_midship_and_runs_count_once() -> None:
    loads = {"Y": np.array([10.0]), "N": np.array([-3.0])}
    assert _at_midship(loads, 2.5, 5.0)["N"][0] == pytest.approx(22.0)
    for x, given in ((2.51, loads), (0.1, {"N": loads["N"]}), (0.1, {"Y": loads["Y"]})):
        with pytest.raises(DataError):
            _at_midship(given, x, 5.0)
    motion = np.array([[1.0, 2.0], [3.0, 4.0], [1.0, 2.0], [1.0, 2.0]])
    kept, held, repeated = _once_each(motion, {"X": np.array([NAN, 1.0, NAN, 5.0])})
    assert (kept.tolist(), repeated) == ([[1.0, 2.0], [3.0, 4.0], [1.0, 2.0]], 1)
    assert held["X"] == pytest.approx([NAN, 1.0, 5.0], nan_ok=True)


def test_signs_that_no_hull_has_are_refused() -> None:
    _plausible(runs(beta=[-0.1, 0.1], Y=[-5.0, 5.0]))
    _plausible(runs(delta=[-0.1, 0.1], N=[-5.0, 5.0]))
    _plausible(runs(beta=[0.1], Y=[-5.0]))
    with pytest.raises(DataError, match="Y falls with beta over 2 runs of drift"):
        _plausible(runs(beta=[-0.1, 0.1], Y=[5.0, -5.0]))
    with pytest.raises(DataError, match="N falls with delta over 2 runs of rudder"):
        _plausible(runs(delta=[-0.1, 0.1], N=[105.0, 95.0]))


@pytest.mark.parametrize(("size", "good"), [(0.9905, True), (1.0095, True), (0.9895, False), (1.0105, False)])
def test_a_quaternion_is_of_size_one_to_a_hundredth(size: float, good: bool) -> None:
    """Of the square of its size; by two axes of the earth."""
    yaw = 0.4
    parts = {"x": [0.0], "y": [0.0], "z": [math.sqrt(size) * math.sin(0.2)], "w": [math.sqrt(size) * math.cos(0.2)]}
    for frame, psi in (("ned", yaw), ("enu", 0.5 * math.pi - yaw)):
        heading = Heading(quaternion=("x", "y", "z", "w"), frame=frame, offset=10.0)  # type: ignore[arg-type]
        if good:
            assert measured(table(**parts), "heading", heading)["psi"][0] == pytest.approx(psi + 10.0 * DEGREE)
            continue
        with pytest.raises(DataError, match="a quaternion of size"):
            measured(table(**parts), "heading", heading)
