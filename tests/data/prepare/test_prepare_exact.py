"""Steps that mend a log, the smoother and plain geometry, by closed forms and round trips."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.data import Array, DataError, Trial
from seatrial.data.geodesy import E2, SEMI_AXIS, Datum
from seatrial.data.prepare import (
    BREAK,
    Remedy,
    Step,
    between_readings,
    cut,
    derivable,
    froude_scaled,
    interpolate_gaps,
    mended,
    read_steps,
    resample,
    shifted,
    split,
    steps_text,
    true_wind,
    turns,
    unbroken,
    without,
)
from seatrial.data.prepare.smooth import _model, sensor_noise, smooth
from seatrial.data.prepare.steps import OPERATIONS
from seatrial.data.units import KNOWN, conversion, of_thruster, standard_unit

DEGREE = math.pi / 180.0
NAN = np.nan


def log(rows: int = 40, dt: float = 0.5, **channels: Any) -> Trial:
    wide = {key: np.broadcast_to(np.asarray(value, dtype=np.float64), rows) for key, value in channels.items()}
    return Trial("a", 100.0 + dt * np.arange(float(rows)), wide, meta={"L_pp": 50.0})


def one(step: Step, trial: Trial) -> Trial:
    (found,) = mended(trial, [step])
    return found


def test_every_unit_is_worth_what_its_definition_says() -> None:
    d, knot = DEGREE, 1852.0 / 3600.0
    worth = {
        "s": 1, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60, "h": 3600, "d": 86400,
        "m": 1, "mm": 1e-3, "cm": 1e-2, "km": 1e3, "NM": 1852,
        "nmi": 1852, "ft": 0.3048, "yd": 0.9144, "mrad": 1e-3, "cdeg": d / 100, "gon": math.pi / 200,
        "mil": math.tau / 6400, "ft/s": 0.3048, "mph": 1609.344 / 3600, "rad": 1, "mm/s": 1e-3,
        "deg": d, "°": d, "m/s": 1, "cm/s": 1e-2, "km/h": 1 / 3.6, "0.1 kn": 0.1 * (knot), "kn": knot,
        "kt": knot, "kts": knot, "knot": knot, "knots": knot, "rad/s": 1, "deg/s": d, "°/s": d, "deg/min": d / 60,
        "rad/min": 1 / 60, "1/s": 1, "rps": 1, "Hz": 1, "rpm": 1 / 60, "1/min": 1 / 60, "m/s^2": 1, "m/s2": 1,
        "rad/s^2": 1, "deg/s^2": d, "N": 1, "kN": 1e3, "MN": 1e6, "N m": 1, "Nm": 1, "N*m": 1, "kN m": 1e3, "kNm": 1e3,
        "W": 1, "kW": 1e3, "MW": 1e6, "V": 1, "A": 1, "Pa": 1, "kPa": 1e3, "hPa": 1e2, "bar": 1e5, "kg": 1, "t": 1e3,
        "kg/m^3": 1, "kg/m3": 1, "degC": 1, "°C": 1, "-": 1, "1": 1, "%": 1e-2,
    }  # fmt: skip
    assert {symbol: factor for symbol, (_, factor) in KNOWN.items()} == pytest.approx(worth, rel=1e-14)


def test_a_channel_has_the_unit_of_its_stem_and_refuses_others() -> None:
    assert [standard_unit(name) for name in ("delta_2", "n_P_1_cmd", "x_sd", "psi", "odd")] == [
        "rad", "1/s", "m", "rad", None
    ]  # fmt: skip
    assert [of_thruster(name) for name in ("n_1", "alpha_2_cmd", "f_3_sd", "n_P", "n_bow", "x_1")] == [
        True, True, True, False, False, False
    ]  # fmt: skip
    assert conversion("psi", "deg") == ("rad", pytest.approx(DEGREE))
    assert conversion("n_1", "rpm") == ("1/s", pytest.approx(1 / 60))
    assert conversion("alpha_bow", "deg") == ("rad", pytest.approx(DEGREE))
    assert conversion("odd", "kn") == ("kn", 1.0)
    assert conversion("n_satellites", "m") == ("m", 1.0)
    for name, unit in (("psi", "m"), ("n_1", "rad"), ("alpha_1", "m/s"), ("throttle_1", "1/s"), ("u", "furlong")):
        with pytest.raises(DataError):
            conversion(name, unit)


def test_velocities_of_an_antenna_and_of_midship_are_those_of_one_body() -> None:
    """Positions moved from the antenna give the velocities that are moved from it."""
    t = np.arange(400.0) * 0.05
    psi = 0.3 + 0.2 * t + 0.05 * np.sin(t)
    r = 0.2 + 0.05 * np.cos(t)
    x, y = 3.0 * t, 0.5 * t**2
    ahead, aside = 4.0, -1.5
    far = {"x": x + ahead * np.cos(psi) - aside * np.sin(psi), "y": y + ahead * np.sin(psi) + aside * np.cos(psi)}
    trial = log(400, 0.05, **far, psi=psi, r=r)
    back = one(Step(do="move", channels=("x", "y"), amount=(ahead, aside)), trial)
    assert back["x"] == pytest.approx(x)
    assert back["y"] == pytest.approx(y)
    u, v = 3.0 * np.cos(psi) + t * np.sin(psi), t * np.cos(psi) - 3.0 * np.sin(psi)
    there = log(400, 0.05, u=u - aside * r, v_m=v + ahead * r, psi=psi, r=r)
    found = one(Step(do="move", channels=("u", "v_m"), amount=(ahead, aside)), there)
    assert found["u"] == pytest.approx(u)
    assert found["v_m"] == pytest.approx(v)
    assert Step(do="move", channels=("x", "y"), amount=(4.0, -1.5)).words == (
        "move x, y to midship: x -4 cos psi -1.5 sin psi, y -4 sin psi +1.5 cos psi"
    )
    assert Step(do="move", channels=("u", "v_m"), amount=(4.0, -1.5)).words == (
        "move u, v_m to midship: v_m -4 r, u -1.5 r"
    )


def test_offsets_factors_and_sides() -> None:
    trial = log(3, psi=[1.0, 2.0, NAN], delta=[-0.2, 0.0, 0.4])
    assert one(Step(do="add", channels=("psi",), amount=(-90.0,), unit="deg"), trial)["psi"][0] == pytest.approx(
        1.0 - math.pi / 2
    )
    twice = one(Step(do="multiply", channels=("delta",), amount=(-2.0,)), trial)
    assert twice["delta"] == pytest.approx([0.4, 0.0, -0.8])
    assert one(Step(do="multiply_port", channels=("delta",), amount=(3.0,)), trial)["delta"] == pytest.approx(
        [-0.6, 0.0, 0.4]
    )
    assert one(Step(do="multiply_starboard", channels=("delta",), amount=(3.0,)), trial)["delta"] == pytest.approx(
        [-0.2, 0.0, 1.2]
    )
    assert one(Step(do="from_bow", channels=("delta",)), trial)["delta"][:2] == pytest.approx([0.8, 2.0])
    turned = one(Step(do="rotate", channels=("u", "v_m"), amount=(30.0,)), log(2, u=2.0, v_m=0.0))
    assert (turned["u"][0], turned["v_m"][0]) == pytest.approx((math.sqrt(3.0), -1.0))  # axes turned clockwise


def test_a_clock_keeps_its_origin_and_a_current_its_direction() -> None:
    trial = log(5, psi=0.5 * math.pi, u=2.0, v_m=0.1, x=0.0)
    assert one(Step(do="clock", amount=(1.2,)), trial).t == pytest.approx(100.0 + 0.6 * np.arange(5))
    assert one(Step(do="even", amount=(0.3,)), trial).t == pytest.approx(100.0 + 0.3 * np.arange(5))
    there = one(Step(do="to_ground", channels=("u", "v_m"), amount=(0.5, 90.0)), trial)  # a current to the east, astern
    assert (there["u"][0], there["v_m"][0]) == pytest.approx((2.5, 0.1))
    assert (there["U_C"][0], there["gamma_C"][0]) == pytest.approx((0.5, 0.5 * math.pi))
    logged = one(Step(do="current", amount=(0.5, 180.0)), trial)
    assert (logged["u"][0], logged["U_C"][0], abs(logged["gamma_C"][0])) == pytest.approx((2.0, 0.5, math.pi))


def test_stretches_are_cut_and_gaps_made_with_both_ends_to_half_a_millisecond() -> None:
    trial = log(120, 1.0, u=1.0)
    parts = mended(trial, [Step(do="cut", where=((140.0004, 149.9996),))])
    assert [(part.t[0], part.t[-1], part.name) for part in parts] == [(100.0, 139.0, "a_1"), (151.0, 219.0, "a_2")]
    gaps = one(Step(do="gaps", channels=("u",), where=((140.0004, 141.9996), (150.0006, 151.0))), trial)
    assert (np.flatnonzero(np.isnan(gaps["u"])) + 100).tolist() == [140, 141, 142, 151]
    short = mended(trial, [Step(do="cut", where=((119.0, 120.0),))])
    assert [len(part) for part in short] == [99]  # 19 rows before it cannot be judged
    assert [len(part) for part in mended(trial, [Step(do="cut", where=((120.0, 121.0),))])] == [20, 98]


def test_only_the_steps_of_a_trial_are_taken() -> None:
    trial = log(3, u=1.0)
    assert one(Step(do="multiply", channels=("u",), amount=(2.0,), trials=("b",)), trial)["u"][0] == 1.0
    assert one(Step(do="multiply", channels=("u",), amount=(2.0,), trials=("a",)), trial)["u"][0] == 2.0
    with pytest.raises(DataError, match="no channel 'w'"):
        mended(trial, [Step(do="multiply", channels=("w",), amount=(2.0,))])
    assert derivable(log(3, x=0.0, y=0.0, psi=0.0), ["u", "r", "w"]).startswith("; the track tells u, r:")
    assert derivable(log(3, x=0.0, y=0.0), ["u"]) == ""
    assert derivable(log(3, x=0.0, y=0.0, psi=0.0), ["n_P"]) == ""


def test_a_remedy_says_three_steps_and_how_many_more() -> None:
    steps = tuple(Step(do="multiply", channels=("u",), amount=(float(k),)) for k in range(2, 8))
    assert str(Remedy(steps=steps[:4])).count("multiply") == 4
    assert str(Remedy(steps=steps[:5])).endswith(", and 2 more steps")
    where = ((1.0, 2.0), (3.0, 3.0), (5.0, 6.0), (7.0, 8.0))
    assert Step(do="cut", where=where[:2]).words == "cut out t = 1 to 2 s, t = 3 s"
    assert Step(do="cut", where=where[:3]).words.endswith("and in 1 more stretch")
    assert Step(do="cut", where=where).words.endswith("and in 2 more stretches")
    assert str(Remedy("or so", steps[:1], (("current", 0.123456),))) == (
        "estimate it with the fit: [nuisance] current = 0.123 in the study; or multiply u by 2; or or so"
    )


def test_a_servo_follows_its_orders_at_its_rate_to_either_side() -> None:
    trial = log(9, 0.5, delta=np.array([0, 4, 4, 4, 4, 4, -1, -1, -1]) * DEGREE)
    found = one(Step(do="follow", channels=("delta",), amount=(3.0,)), trial)
    assert found["delta"] / DEGREE == pytest.approx([0, 1.5, 3, 4, 4, 4, 2.5, 1, -0.5])
    assert found["delta_cmd"] == pytest.approx(trial["delta"])


def test_a_heading_is_rebuilt_of_its_rate_whatever_the_bias_of_that() -> None:
    t = 0.5 * np.arange(400.0)
    psi = 0.2 * np.sin(0.1 * t) + 0.01 * t
    rough = DEGREE * np.round(psi / DEGREE)
    r = 0.02 * np.cos(0.1 * t) + 0.01 + 0.003
    found = one(Step(do="rebuild", channels=("psi",)), log(400, 0.5, psi=rough, r=r))
    assert found["psi"] == pytest.approx(psi, abs=0.25 * DEGREE)


# -- times


def test_lines_bridge_gaps_of_a_length_and_no_longer() -> None:
    values = np.arange(12.0)
    values[[2, 3, 6, 7, 8, 11]] = NAN
    filled = interpolate_gaps(log(12, 0.5, u=values, psi=values), 1.5, ("u",))
    assert filled["u"][:6] == pytest.approx(np.arange(6.0))  # 1.5 s from one value to the next
    assert np.isnan(filled["u"][[6, 7, 8, 11]]).all()
    assert np.isnan(filled["psi"][2])
    wrap = interpolate_gaps(log(3, 0.5, psi=[6.2, NAN, 0.1]), 1.0)
    assert math.cos(wrap["psi"][1] - 0.5 * (6.2 + 0.1 + 2 * math.pi)) == pytest.approx(1.0)


def test_readings_at_other_times_are_on_lines_or_held() -> None:
    t, values = np.arange(5.0), np.array([1.0, NAN, 3.0, NAN, 7.0])
    new = np.array([-1.0, 0.5, 2.0, 3.0, 9.0])
    assert between_readings("u", t, values, new, held=False) == pytest.approx([1.0, 1.5, 3.0, 5.0, 7.0])
    assert between_readings("u", t, values, new, held=True) == pytest.approx([1.0, 1.0, 3.0, 3.0, 7.0])
    assert turns("psi")
    assert turns("alpha_2")
    assert not turns("delta")


def test_a_shift_moves_channels_to_earlier_times_and_drops_the_end() -> None:
    trial = log(20, 0.5, u=np.arange(20.0), r=np.arange(20.0))
    found = shifted(trial, 1.25, "u")
    assert len(found) == 17
    assert found["u"] == pytest.approx(np.arange(17.0) + 2.5)
    assert found["r"] == pytest.approx(np.arange(17.0))
    early = shifted(trial, -1.0, "u")
    assert early.t[0] == 101.0
    assert early["u"] == pytest.approx(np.arange(18.0))
    for lag in (9.1, -9.1, math.inf):
        with pytest.raises(DataError):
            shifted(trial, lag, "u")


def test_even_steps_begin_at_the_first_row_and_end_within_the_trial() -> None:
    trial = log(11, 1.0, u=np.arange(11.0) ** 2)
    found = resample(trial, 0.4)
    assert found.t == pytest.approx(100.0 + 0.4 * np.arange(26))
    assert found["u"][[0, 1, 5]] == pytest.approx([0.0, 0.4, 4.0])
    assert len(resample(trial, 10.0)) == 2
    for dt in (0.0, -1.0, 10.1, math.nan):
        with pytest.raises(DataError):
            resample(trial, dt)


def test_parts_of_a_trial() -> None:
    trial = Trial("a", np.array([0.0, 1.0, 2.0, 12.4, 13.4, 25.0, 26.0]), {"u": np.arange(7.0)})
    assert [len(part) for part in unbroken(trial, BREAK)] == [5, 2]
    assert [len(part) for part in unbroken(trial, 10.3)] == [3, 2, 2]
    assert unbroken(trial, 20.0) == (trial,)
    rows = np.array([False, True, False, False, True, False, False])
    assert [part["u"].tolist() for part in without(trial, rows, 2)] == [[2.0, 3.0], [5.0, 6.0]]
    assert cut(trial, 1.0, 13.4)["u"].tolist() == [1.0, 2.0, 3.0, 4.0]
    with pytest.raises(DataError):
        cut(trial, 3.0, 12.4)
    names = [Trial(name, trial.t, trial.channels) for name in ("turn_1", "turn_2", "zigzag")]
    parts = split(names, ["turn_2"], ["zig*"])
    assert [[one.name for one in part] for part in (parts.train, parts.validation, parts.test)] == [
        ["turn_1"], ["turn_2"], ["zigzag"]
    ]  # fmt: skip
    with pytest.raises(DataError, match="keep it in one"):
        split(names, ["turn_2"], ["turn*"])


# -- scale, wind, noise, smoothing


def test_a_ship_four_times_as_long_is_twice_as_fast_and_turns_half_as_quickly() -> None:
    trial = Trial("a", np.arange(5.0), {name: np.ones(5) for name in ("x", "psi", "u", "r", "n_P", "delta", "thrust")},
                  {"thrust": "N"}, {"L_pp": 3.0, "scale": 100.0})  # fmt: skip
    found = froude_scaled(trial, 4.0)
    assert {name: float(found[name][0]) for name in found.channels} == {
        "x": 4.0, "psi": 1.0, "u": 2.0, "r": 0.5, "n_P": 0.5, "delta": 1.0
    }  # fmt: skip
    assert (found.t[-1], found.meta["L_pp"], found.meta["scale"]) == (8.0, 12.0, 25.0)


def test_the_true_wind_is_the_apparent_one_less_the_headwind() -> None:
    psi, u, v, wind, angle = 0.8, 5.0, -0.4, 9.0, 2.2
    ahead, aside = wind * math.cos(angle - psi) + u, wind * math.sin(angle - psi) + v
    given = [np.array([one]) for one in (math.hypot(ahead, aside), math.atan2(aside, ahead), psi, u, v)]
    north, east = true_wind(*given)
    assert (north[0], east[0]) == pytest.approx((wind * math.cos(angle), wind * math.sin(angle)))


def test_the_noise_of_a_smooth_signal_is_that_of_its_third_differences() -> None:
    t = np.arange(20000.0)
    noise = np.random.default_rng(1).normal(0.0, 0.3, t.size)
    assert sensor_noise(5.0 * np.sin(0.01 * t) + noise) == pytest.approx(0.3, rel=0.03)
    assert sensor_noise(t**2) == pytest.approx(0.0, abs=1e-6)
    assert math.isnan(sensor_noise(t[:3]))


@pytest.mark.parametrize("s", [0.1, 2.0])
def test_white_jerk_blurs_by_the_integrals_of_its_response(s: float) -> None:
    """Covariance of the integral of (tau^2/2, tau, 1) dW, by a sum over small steps."""
    move, blur = _model(s, 1.7)
    tau = (np.arange(4000) + 0.5) * s / 4000
    response = np.stack([0.5 * tau**2, tau, np.ones_like(tau)])
    assert blur == pytest.approx(1.7 * response @ response.T * s / 4000, rel=1e-5)
    assert move @ np.array([1.0, 2.0, 3.0]) == pytest.approx([1.0 + 2.0 * s + 1.5 * s**2, 2.0 + 3.0 * s, 3.0])


def circle(rows: int = 160) -> tuple[Array, Trial]:
    t = 0.5 * np.arange(float(rows))
    psi = 0.1 * t
    return t, log(rows, 0.5, x=40.0 * np.sin(psi) - 3.0 * np.cos(psi), y=-40.0 * np.cos(psi) - 3.0 * np.sin(psi),
                  psi=psi)  # fmt: skip


@pytest.mark.slow
def test_speeds_of_a_smoothed_circle_are_those_of_the_ship() -> None:
    """4 m/s ahead and .3 to port: (4 cos + .3 sin, 4 sin - .3 cos)."""
    _, trial = circle()
    found = smooth(trial, {"x": 0.02, "y": 0.02, "psi": 1e-3})
    middle = slice(20, -20)
    assert found["u"][middle] == pytest.approx(4.0, abs=0.02)
    assert found["v_m"][middle] == pytest.approx(-0.3, abs=0.02)
    assert found["r"][middle] == pytest.approx(0.1, abs=1e-3)
    assert (found["x_sd"] < 0.02 + 1e-9).all()
    gap = trial.having(x=np.where(np.arange(160) == 80, NAN, trial["x"]))
    assert np.isnan(smooth(gap, {"x": 0.02, "y": 0.02, "psi": 1e-3})["u"]).nonzero()[0].tolist() == [80]


def test_what_smoothing_refuses() -> None:
    _, trial = circle(30)
    with pytest.raises(DataError, match="needs at least 8"):
        smooth(trial.having(x=np.where(np.arange(30) < 7, trial["x"], NAN)))
    for noise in ({"psi": 0.51}, {"r": 0.51}, {"x": 0.0}, {"x": math.inf}):
        with pytest.raises(DataError, match="noise of"):
            smooth(trial, noise)


# -- the plane


@pytest.mark.parametrize("latitude", [0.0, 35.0, -60.0, 80.0])
def test_small_ways_on_the_plane_are_those_of_the_radii_of_curvature(latitude: float) -> None:
    here = Datum(latitude, 139.0)
    w = 1.0 - E2 * math.sin(math.radians(latitude)) ** 2
    meridian, across = SEMI_AXIS * (1.0 - E2) / w**1.5, SEMI_AXIS / math.sqrt(w)
    north, east = here.north_east(latitude + 1e-4, 139.0 + 1e-4)
    assert north == pytest.approx(meridian * math.radians(1e-4), rel=1e-4, abs=1e-3)
    assert east == pytest.approx(across * math.cos(math.radians(latitude)) * math.radians(1e-4), rel=1e-4)
    track = here.track(np.array([latitude + 1e-4, NAN]), np.array([139.0 + 1e-4, 1.0]))
    assert (track[0][0], track[1][0]) == pytest.approx((north, east))
    assert np.isnan(track[0][1])
    place = here.place(20_000.0, -30_000.0)
    assert here.north_east(*place) == pytest.approx((20_000.0, -30_000.0), abs=1e-5)
    seen = Datum.seeing(latitude, 139.0, 5000.0, -7000.0)
    assert seen.north_east(latitude, 139.0) == pytest.approx((5000.0, -7000.0), abs=1e-5)


def test_a_datum_is_on_the_earth() -> None:
    assert Datum(89.0, 180.0).latitude == -Datum(-89.0, -180.0).latitude
    for latitude, longitude in ((89.1, 0.0), (-89.1, 0.0), (0.0, 180.1), (math.nan, 0.0)):
        with pytest.raises(DataError):
            Datum(latitude, longitude)
    assert Datum(0.0, 179.99).place(0.0, 5000.0)[1] == pytest.approx(-179.965, abs=1e-3)
    with pytest.raises(DataError, match="beyond the earth"):
        Datum(0.0, 0.0).place(6.5e6, 0.0)


def test_each_step_takes_so_many_numbers() -> None:
    one = ("add", "multiply", "multiply_starboard", "multiply_port", "shift", "rotate", "clock", "even", "resample",
           "fill", "split", "follow", "constant")  # fmt: skip
    assert {name: what.amounts for name, what in OPERATIONS.items()} == {
        name: 2 if name in ("move", "to_ground", "current") else int(name in one) for name in OPERATIONS
    }
    assert {name for name, what in OPERATIONS.items() if not what.needs} == {"constant", "current", "derive"}


def test_a_file_of_steps_comes_back_with_what_is_left_out_first(tmp_path: Path) -> None:
    steps = (Step(do="follow", channels=("delta",), amount=(2.32,)), Step(do="cut", where=((1.0, 2.0),)),
             Step(do="gaps", channels=("u",), where=((3.0, 3.0),), trials=("a",)))  # fmt: skip
    path = tmp_path / "a.toml"
    path.write_text(steps_text([("why", steps)]))
    assert read_steps(path) == (*steps[1:], steps[0])
    for wrong in ('do = "follow"\nchannels = ["delta"]\namount = [0.0]', 'do = "cut"\nwhere = [[2.0, 1.0]]',
                  'do = "follow"\nchannels = ["a", "b"]\namount = [1.0]', 'do = "exchange"\nchannels = ["a"]',
                  'do = "multiply"\nchannels = ["a"]\namount = [0.0]', 'do = "rename"\nchannels = ["a"]',
                  'do = "add"\nchannels = ["psi"]\namount = [1.0]\nunit = "m"', 'do = "move"\nchannels = ["x", "y"]',
                  'do = "mvoe"'):  # fmt: skip
        path.write_text(f'schema = "seatrial-steps/1"\n[[steps]]\n{wrong}\n')
        with pytest.raises(DataError, match=r"a\.toml: "):
            read_steps(path)
