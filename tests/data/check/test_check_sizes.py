"""What is told of a fitted cause: from which size on, its sign, its unit, its remedy."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest

from seatrial.data import Trial
from seatrial.data.check.relations import CAUSES, Window
from seatrial.data.check.repairs import Suspect, gross, step
from seatrial.data.check.sizes import FITTED, length
from seatrial.data.check.suspects import (
    Judged,
    Named,
    Normal,
    _astray,
    _pivot,
    _rms,
    _squares,
    _thinned,
    _turning_most,
)
from seatrial.data.prepare import Remedy

DEGREE = math.pi / 180.0
MAKERS = {columns + ((make.__name__,) if make.__name__ == "_sway_lever" else ()): make for columns, make in FITTED}


def ship(rows: int = 120, dt: float = 1.0, L: float = 98.1, **channels: float) -> Trial:
    t = dt * np.arange(float(rows))
    motion = {"x": 4.0 * t, "y": 0.1 * t, "psi": 0.01 * t, "u": 4.0 + 0.001 * t, "v_m": 0.01 * t, "r": 0.01 + 1e-5 * t}
    return Trial("a", t, {**motion, **{name: np.full(rows, value) for name, value in channels.items()}},
                 meta={"L_pp": L})  # fmt: skip


def told(columns: Sequence[str], *sizes: float, trial: Trial | None = None, error: float = 1e-3) -> Suspect | None:
    return MAKERS[tuple(columns)]([trial or ship()], list(sizes), [error] * len(sizes))


def amounts(found: Suspect | None) -> list[tuple[float, ...]]:
    assert found is not None
    return [one.amount for one in found.remedy.steps]


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_heading_bias_counts_from_four_tenths_of_a_degree(side: float) -> None:
    assert told(("heading_bias",), side * 0.39 * DEGREE) is None
    found = told(("heading_bias",), side * 0.41 * DEGREE)
    assert amounts(found) == [(pytest.approx(-side * 0.41),)]
    assert found is not None
    assert f"heading bias of {side * 0.41:+.2f} deg" in found.what
    assert f"lies {-side * 0.41:+.2f} +- 0.06 deg" in found.evidence
    assert found.remedy.steps[0].unit == "deg"


@pytest.mark.parametrize(("cause", "name"), [("north_stretch", "x"), ("east_stretch", "y")])
def test_a_direction_that_is_stretched_is_divided_by_its_excess_and_grave_from_four_hundredths(
    cause: str, name: str
) -> None:
    assert told((cause,), 0.019) is None
    for size, grave in ((0.03, False), (-0.039, False), (0.041, True), (0.2207746, True)):
        found = told((cause,), size)
        assert found is not None
        assert (found.key, found.channels, found.kind, found.grave) == ("stretch", (name,), "scale", grave)
        assert amounts(found) == [(pytest.approx(1.0 / (1.0 + size), rel=1e-5),)]
    assert ("35 deg of latitude" in found.evidence) == (name == "y")  # 1 / cos 35 deg = 1.2207746


@pytest.mark.parametrize(("cause", "name"), [("log_scale", "u"), ("gyro_scale", "r")])
def test_a_scale_counts_from_two_hundredths_and_is_grave_and_a_unit_beyond(cause: str, name: str) -> None:
    assert told((cause,), 0.019) is None
    assert told((cause,), -0.019) is None
    for size, kind, last in ((0.021, "quality", False), (-0.14, "quality", False), (0.16, "scale", False),
                             (-0.29, "scale", False), (0.31, "scale", True), (-0.31, "scale", True)):  # fmt: skip
        found = told((cause,), size)
        assert found is not None
        assert (found.kind, found.grave, found.last) == (kind, kind == "scale", last)
        assert found.channels[0] == name
        assert amounts(found) == [(pytest.approx(1.0 / (1.0 + size), rel=1e-5),)]
        assert f"{100 * size:+.1f} %" in found.what
        assert f"{100 * size:+.2f} +- 0.10 %" in found.evidence


def test_a_bias_of_the_log_counts_from_a_hundredth_of_the_speed() -> None:
    top = float(np.quantile(ship()["u"], 0.9))
    for columns, names in ((("log_bias",), ("u",)), (("log_bias", "sway_bias"), ("u", "v_m"))):
        small, large = [0.0] * len(names), [0.0] * len(names)
        small[-1], large[-1] = -0.0099 * top, -0.0101 * top
        assert told(columns, *small) is None
        found = told(columns, *large)
        assert found is not None
        assert [one.channels for one in found.remedy.steps] == [(name,) for name in names]
        assert amounts(found)[-1] == (pytest.approx(0.0101 * top, rel=1e-3),)
        assert not found.grave


@pytest.mark.parametrize(("ahead", "aside", "words"), [
    (2.9, 1.0, "2.9 m ahead, 1 m to starboard"), (-2.9, -1.0, "2.9 m abaft, 1 m to port"),
])  # fmt: skip
def test_an_antenna_counts_from_three_hundredths_of_the_length(ahead: float, aside: float, words: str) -> None:
    lever = ("lever_ahead", "lever_aside")
    assert told(lever, 2.0, 2.1) is None  # 2.9 m of 98.1
    found = told(lever, ahead, aside)
    assert found is not None
    assert words in found.what
    assert found.remedy.steps[0].channels == ("x", "y")
    assert amounts(found) == [(ahead, aside)]
    # the velocities of a point there say the same with the other sign
    assert told((*lever, "_sway_lever"), 2.0, 2.1) is None
    other = told((*lever, "_sway_lever"), -ahead, -aside)
    assert other is not None
    assert other.remedy.steps[0].channels == ("u", "v_m")
    assert amounts(other) == [(ahead, aside)]
    assert told((*lever, "_sway_lever"), 9.0, 9.0, trial=ship().having(r=np.zeros(120))) is None


@pytest.mark.parametrize(("cause", "names"), [
    ("lag_x", ("x", "y")), ("lag_psi", ("psi",)), ("lag_u", ("u", "v_m")), ("lag_r", ("r",)),
])  # fmt: skip
def test_a_lag_counts_from_a_part_of_the_step_and_of_the_ships_time(cause: str, names: tuple[str, ...]) -> None:
    # ship time of 98.1 m: 3.162 s, a twentieth of it .158 s
    quick = ship(dt=0.1)
    assert told((cause,), 0.155, trial=quick) is None
    assert told((cause,), 0.29) is None
    for lag, trial in ((0.162, quick), (0.31, ship())):
        found = told((cause,), lag, trial=trial)
        assert found is not None
        assert amounts(found) == [(-lag,)]
        assert f"late by {lag:.2g} s" in found.what
        assert found.channels == names
    early = told((cause,), -0.5)
    assert early is not None
    assert amounts(early) == [(0.5,)]
    assert early.remedy.steps[0].channels == names
    assert early.channels == (("x", "y", "u", "v_m") if cause == "lag_x" else names)


@pytest.mark.parametrize(("north", "east", "towards"), [(0.0, 0.1, 90.0), (-0.1, 0.0, 180.0), (0.1, -0.1, 315.0)])
def test_speeds_through_the_water_count_from_a_part_of_the_speed(north: float, east: float, towards: float) -> None:
    top = float(np.quantile(ship()["u"], 0.9))
    water = ("water_north", "water_east")
    assert told(water, 0.0149 * top, 0.0) is None
    assert told(water, 0.0, -0.0151 * top) is not None
    found = told(water, north, east)
    assert amounts(found) == [(pytest.approx(math.hypot(north, east), rel=1e-3), pytest.approx(towards))]
    assert found is not None
    assert f"towards {towards:.0f} deg" in found.what


def test_a_bias_of_the_rate_counts_in_ship_times_and_is_told_per_minute() -> None:
    assert told(("gyro_bias",), 0.99e-3 / math.sqrt(98.1 / 9.81)) is None
    size = -1.01e-3 / math.sqrt(98.1 / 9.81)
    found = told(("gyro_bias",), size)
    assert amounts(found) == [(pytest.approx(-size / DEGREE * 60.0, rel=1e-3),)]
    assert found is not None
    assert found.remedy.steps[0].unit == "deg/min"
    assert f"{size / DEGREE * 60.0:+.3g} deg/min" in found.what


def test_a_time_scale_counts_from_four_thousandths_where_heading_and_rate_are_there() -> None:
    assert told(("time_scale",), 0.0039) is None
    assert told(("time_scale",), 0.1, trial=ship().having(r=np.full(120, np.nan))) is None
    for size, grave, last in ((0.0041, False, False), (-0.039, False, False), (0.041, True, False), (0.31, True, True)):
        found = told(("time_scale",), size, trial=ship(dt=0.5))
        assert found is not None
        assert (found.grave, found.last, found.kind) == (grave, last, "step")
        assert amounts(found) == [(pytest.approx(1.0 / (1.0 + size), rel=1e-5),)]
        assert f"{0.5 / (1.0 + size):.4g} s instead of 0.5 s" in found.remedy.text


def test_a_length_that_is_not_known_is_a_hundred_metres() -> None:
    assert length([ship(L=70.0), ship()]) == 70.0
    assert length([Trial("a", np.arange(3.0), {})]) == 100.0


def test_each_wrong_unit_is_mended_by_its_own_factor() -> None:
    """A value of one in the unit that was meant, over that in the unit that was read."""
    meant = {
        ("psi", "deg"): DEGREE, ("psi", "rad, converted from deg"): 1.0 / DEGREE, ("r", "deg/s"): DEGREE,
        ("r", "rad/s, converted from deg/s"): 1.0 / DEGREE, ("r", "deg/min, taken as deg/s"): 1.0 / 60.0,
        ("r", "deg/s, taken as deg/min"): 60.0, ("r", "deg/min"): DEGREE / 60.0,
        ("r", "rad/s, taken as deg/min"): 60.0 / DEGREE, ("x, y", "ft"): 0.3048, ("x, y", "km"): 1000.0,
        ("x, y", "NM"): 1852.0, ("x, y", "mm"): 1e-3, ("x, y", "cm"): 1e-2, ("u, v_m", "kn"): 1852.0 / 3600.0,
        ("u, v_m", "km/h"): 1.0 / 3.6, ("u, v_m", "cm/s"): 0.01, ("u, v_m", "m/s, taken as kn"): 3600.0 / 1852.0,
        ("u, v_m", "m/s, taken as km/h"): 3.6, ("u", "kn"): 1852.0 / 3600.0, ("u", "km/h"): 1.0 / 3.6,
        ("v_m", "kn"): 1852.0 / 3600.0, ("v_m", "km/h"): 1.0 / 3.6, ("t", "ms"): 1e-3, ("t", "us"): 1e-6,
        ("t", "min"): 60.0, ("t", "h"): 3600.0,
    }  # fmt: skip
    found = {(", ".join(one.channels), one.what.split(" in ", 1)[1]): one for one in gross([ship()])
             if one.key == "unit"}  # fmt: skip
    assert {key: one.remedy.steps[0].amount[0] for key, one in found.items()} == pytest.approx(meant, rel=1e-5)
    assert {one.remedy.steps[0].do for key, one in found.items() if key[0] == "t"} == {"clock"}
    heading = Trial("a", np.arange(30.0), {"psi": np.arange(30.0)})
    assert {one.channels for one in gross([heading])} == {("psi",), ("t",)}


def test_a_remedy_is_rounded_to_the_digits_that_are_printed() -> None:
    assert step("multiply", "u", amount=(1.23456789,)).steps[0].amount == (1.23457,)
    assert step("clock", amount=(1.23456789,)).steps[0].amount == (1.23457,)
    assert step("add", "u", amount=(1.23456789, -0.000123456)).steps[0].amount == (1.235, -0.0001235)


# -- the fit of causes


def window(rng: np.random.Generator, n: int = 30) -> Window:
    columns = {name: rng.normal(size=(n, 3)) for name in CAUSES}
    return Window(rng.normal(size=(n, 3)), np.ones((n, 3)), columns)


def test_sizes_of_causes_are_those_of_least_squares_without_rows_that_lack() -> None:
    now = window(np.random.default_rng(0))
    now.left[:4, 0] = np.nan
    names = ["log_bias", "sway_bias"]
    left, matrix = now.left.ravel(), np.column_stack([now.columns[name].ravel() for name in names])
    good = np.isfinite(left)
    size, *_ = np.linalg.lstsq(matrix[good], left[good], rcond=None)
    rest = left[good] - matrix[good] @ size
    rms = math.sqrt(float(np.mean(rest**2)))
    back = np.linalg.inv(matrix[good].T @ matrix[good])
    found = Normal.of(now).fit(names)
    assert found is not None
    assert found[0] == pytest.approx(size)
    assert found[1] == pytest.approx(2.0 * rms * np.sqrt(np.diag(back)))  # windows overlap by three quarters
    assert found[2] == pytest.approx(rms)
    exact = Normal.of(Window(3.0 * now.columns["log_bias"], now.moved, now.columns)).fit(["log_bias"])
    assert exact is not None
    assert exact[0] == pytest.approx([3.0])
    assert exact[1] == pytest.approx([1.0 / math.sqrt(float(np.sum(now.columns["log_bias"] ** 2)))])  # at least half
    assert exact[2] == pytest.approx(0.0, abs=1e-6)


def test_causes_that_nothing_shows_or_that_are_alike_are_not_fitted() -> None:
    now = window(np.random.default_rng(1))
    flat = {**now.columns, "lag_x": 0.0 * now.left, "lag_u": 2.0 * now.columns["lag_r"]}
    normal = Normal.of(Window(now.left, now.moved, flat))
    assert normal.fit(["lag_x"]) is None
    assert normal.fit(["lag_u", "lag_r"]) is None
    assert normal.fit(["lag_u"]) is not None
    few = Window(now.left.copy(), now.moved, now.columns)
    few.left.ravel()[20:] = np.nan
    assert Normal.of(few).fit(["lag_u"]) is not None
    few.left.ravel()[19:] = np.nan
    assert Normal.of(few).fit(["lag_u"]) is None


def test_squares_and_their_root_are_of_the_values_that_are_there() -> None:
    left = np.array([[3.0, np.nan], [4.0, np.nan]])
    assert _rms(left) == pytest.approx(math.sqrt(12.5))
    assert _squares(left) == pytest.approx(12.55)
    assert (_rms(left[:, 1:]), _squares(left[:, 1:])) == (0.0, 0.05)


@pytest.mark.parametrize(("track", "turn", "yes"), [
    (0.041, 0.0, True), (0.039, 0.0, False), (0.0, 0.251, True), (0.0, 0.249, False),
])  # fmt: skip
def test_what_is_left_over_is_astray_as_a_part_of_what_was_moved(track: float, turn: float, yes: bool) -> None:
    left = np.tile([100.0 * track, -100.0 * track, 100.0 * turn], (5, 1))
    assert _astray(Window(left, np.full((5, 3), -100.0), {})) == yes


def test_a_cause_is_shared_where_it_is_as_large_and_sure() -> None:
    rng = np.random.default_rng(2)
    now = window(rng, 200)
    nothing = Remedy()

    def named(size: float) -> Named:
        return Named(None, nothing.repair, {"log_bias": size})  # type: ignore[arg-type]

    def shows(size: float, noise: float = 0.05) -> Window:
        return Window(size * now.columns["log_bias"] + noise * now.left, now.moved, now.columns)

    assert named(1.0).shared_by(shows(1.25))
    assert named(-1.0).shared_by(shows(-0.75))
    assert not named(1.0).shared_by(shows(1.35))
    assert not named(1.0).shared_by(shows(0.65))
    assert not named(1.0).shared_by(shows(-1.0))
    # sizes of .1 by 600 values: an error of .5 at least in each, twice that over its root
    error = 1.0 / math.sqrt(float(np.sum(now.columns["log_bias"] ** 2)))
    assert named(4.1 * error).shared_by(shows(4.1 * error, 0.0))
    assert not named(3.9 * error).shared_by(shows(3.9 * error, 0.0))
    assert not named(1.0).shared_by(None)
    assert not Named(None, None, {}).shared_by(shows(1.0))  # type: ignore[arg-type]


def test_trials_differ_that_fit_half_as_well_again_as_the_others() -> None:
    def left(track: float, turn: float) -> Window:
        return Window(np.tile([track, -track, turn], (6, 1)), np.ones((6, 3)), {})

    def differing(*pairs: tuple[float, float] | None) -> list[int]:
        return Judged([], [], [None if one is None else left(*one) for one in pairs]).differing

    assert differing((2.0, 0.1), (2.0, 0.1), (3.1, 0.1)) == [2]
    assert differing((2.0, 0.1), (2.0, 0.1), (2.9, 0.1)) == []
    assert differing((0.1, 2.0), (0.1, 3.1), (0.1, 2.0)) == [1]
    assert differing((0.1, 0.1), (1.4, 0.1), (0.1, 1.6)) == [2]
    assert differing(None, (2.0, 2.0), (3.1, 3.1), (2.0, 2.0)) == [2]


def test_the_pivot_of_a_turn_is_where_there_is_no_sway() -> None:
    t = np.arange(60.0)
    r = np.where(t < 30, 0.02, 0.009)
    trial = Trial("a", t, {"r": -r, "v_m": np.where(t < 30, -30.0, 80.0) * -r})
    assert _pivot(trial) == pytest.approx(30.0)  # the slow rows do not count
    assert _pivot(trial.having(r=np.where(t < 30, 0.02, 0.011))) != pytest.approx(30.0)
    assert _pivot(trial.rows(slice(9, 60))) == pytest.approx(30.0)
    assert _pivot(trial.rows(slice(10, 60))) is None  # 20 rows


def test_few_rows_and_windows_are_enough_for_signs() -> None:
    trial = ship(6000, 0.25)  # windows of 31.6 s
    thin = _thinned(trial)
    assert thin.dt == pytest.approx(7 * 0.25)
    assert len(thin) == min(math.ceil(6000 / 7), 60 * 16)
    far = _thinned(ship(16000, 0.25))
    assert len(far) == 960


def test_the_trials_that_turn_most_are_looked_at() -> None:
    t = np.arange(30.0)
    trials = [Trial(str(k), t, {"psi": -0.01 * k * t + 50.0 * (k == 2)}) for k in range(8)]
    assert [one.name for one in _turning_most(trials)] == ["7", "6", "5", "4", "3", "2"]
