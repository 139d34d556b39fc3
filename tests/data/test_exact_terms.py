"""Each term of causes, steps, instruments and thresholds by itself, against closed forms and motions by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray
from turning_log import table, trials

from seatrial.data import Trial
from seatrial.data.check.relations import CAUSES, left_over
from seatrial.data.check.rows.outliers import outlier_faults
from seatrial.data.check.sensors import wind_faults
from seatrial.data.check.track import surge_faults, track_faults
from seatrial.data.geodesy import Datum
from seatrial.data.guess.helm import read_revolutions
from seatrial.data.guess.roles import Signal
from seatrial.data.prepare import integral, nearest_rows, resample, shifted
from seatrial.data.prepare.steps import Step, mended
from seatrial.environment.chart import Bank, Chart, Quay
from seatrial.environment.fenders import CURVES, Fender
from seatrial.environment.grid import Size, between, grid_of, suction

Array = NDArray[np.float64]


def winding(t: Array) -> dict[str, Array]:
    """A motion in closed form but for its track, which is summed in steps of five milliseconds."""
    def motion(s: Array) -> dict[str, Array]:
        psi = 0.4 * np.sin(0.06 * s) + 0.015 * s
        return {"psi": psi, "r": 0.024 * np.cos(0.06 * s) + 0.015, "u": 5.0 + 0.4 * np.sin(0.05 * s),
                "v_m": 0.5 * np.cos(0.06 * s)}  # fmt: skip

    fine = np.linspace(0.0, float(t[-1]) + 2.0, 80_001) - 1.0
    at = motion(fine)
    north = at["u"] * np.cos(at["psi"]) - at["v_m"] * np.sin(at["psi"])
    east = at["u"] * np.sin(at["psi"]) + at["v_m"] * np.cos(at["psi"])
    sums = [np.concatenate([[0.0], np.cumsum(0.5 * (one[1:] + one[:-1]) * np.diff(fine))]) for one in (north, east)]
    return {**motion(t), "x": np.interp(t, fine, sums[0]), "y": np.interp(t, fine, sums[1])}


@cache
def sailed() -> Trial:
    t = np.arange(0.0, 400.0, 0.25)
    return Trial("winding", t, winding(t), {}, {"L_pp": 30.0})


E = 1e-3


def caused(cause: str) -> Trial:
    """The log as a small fault of an instrument would have it, of size E in its unit."""
    t = np.arange(0.0, 400.0, 0.25)
    true, late = sailed().channels, winding(t - E) if cause.startswith("lag") else sailed().channels
    c, s = np.cos(true["psi"]), np.sin(true["psi"])
    spoilt = {
        "heading_bias": {"psi": true["psi"] + E},
        "deviation_north": {"psi": true["psi"] + E * c},
        "deviation_east": {"psi": true["psi"] + E * s},
        "log_scale": {"u": true["u"] * (1 + E), "v_m": true["v_m"] * (1 + E)},
        "log_bias": {"u": true["u"] + E},
        "sway_bias": {"v_m": true["v_m"] + E},
        "lever_ahead": {"x": true["x"] + E * c, "y": true["y"] + E * s},
        "lever_aside": {"x": true["x"] - E * s, "y": true["y"] + E * c},
        "lag_x": {"x": late["x"], "y": late["y"]},
        "lag_psi": {"psi": late["psi"]},
        "lag_u": {"u": late["u"], "v_m": late["v_m"]},
        "lag_gnss": {name: late[name] for name in ("x", "y", "u", "v_m")},
        "lag_r": {"r": late["r"]},
        "water_north": {"u": true["u"] - E * c, "v_m": true["v_m"] + E * s},
        "water_east": {"u": true["u"] - E * s, "v_m": true["v_m"] - E * c},
        "gyro_bias": {"r": true["r"] + E},
        "gyro_scale": {"r": true["r"] * (1 + E)},
        "north_stretch": {"x": true["x"] * (1 + E)},
        "east_stretch": {"y": true["y"] * (1 + E)},
    }
    trial = sailed()
    return replace(trial, t=t * (1 + E)) if cause == "time_scale" else trial.having(**spoilt[cause])


@pytest.mark.parametrize("cause", CAUSES)
def test_a_cause_leaves_over_its_column_times_its_size(cause: str) -> None:
    """A column is a derivative: here it is the difference of two logs."""
    clean, spoilt = left_over([sailed()]), left_over([caused(cause)])
    assert clean is not None
    assert spoilt is not None
    # (channels are smoothed over five rows before they are late, fewer at the ends)
    found = (spoilt.left - clean.left)[1:-1] / E
    wanted = clean.columns[cause][1:-1]
    size = np.abs(wanted).max(axis=0)
    assert size.max() > 0.0
    for k in range(3):
        # the weights move with the fault too, by a part of E, and a lag of a sampled channel by the square of its step
        assert np.abs(found[:, k] - wanted[:, k]).max() <= 0.03 * size[k] + 0.02 * size.max(), ["x", "y", "psi"][k]


NOISES = {"psi": ({"psi": 0.02}, 2), "r": ({"r": 0.02}, 2), "x": ({"x": 2.0, "y": 2.0}, 0),
          "u": ({"u": 0.5, "v_m": 0.5}, 1)}  # fmt: skip


@pytest.mark.parametrize("name", NOISES)
def test_what_noise_leaves_over_is_one_in_its_own_unit(name: str) -> None:
    """White noise of one instrument, by far the largest: what is left over has a variance of one."""
    sigmas, column = NOISES[name]
    rng = np.random.default_rng(4)
    trial = sailed()
    noisy = trial.having(**{one: trial[one] + sigma * rng.standard_normal(len(trial)) for one, sigma in sigmas.items()})
    found = left_over([noisy])
    assert found is not None
    left = found.left[:, column]
    # windows overlap by three quarters: a quarter of them are independent
    assert float(np.mean(left**2)) == pytest.approx(1.0, abs=4.0 * math.sqrt(2.0 * 4.0 / left.size))


def test_an_air_that_hardly_moves_comes_from_no_side() -> None:
    """In a calm the wind felt is the headwind, and the sign of the true wind is noise: nobody may be accused."""
    trial = sailed()
    for seed in range(12):
        rng = np.random.default_rng(seed)
        gamma_T = rng.uniform(0.0, 2.0 * math.pi)
        air = {"U_T": np.full(len(trial), 0.05), "gamma_T": np.full(len(trial), gamma_T)}
        u, v = (trial[one] + 0.1 * rng.standard_normal(len(trial)) for one in ("u", "v_m"))
        felt = {"U_A": np.hypot(u, v), "gamma_A": np.arctan2(v, u)}
        assert not list(wind_faults(trial.having(**air, **felt)))


def test_the_speed_over_ground_is_no_surge_and_a_log_that_reads_too_much_is_none() -> None:
    """U, taken for u, exceeds it by the drift alone; a log that is 1 % high exceeds it on a straight course as well."""
    trial = sailed()
    drifting = trial["v_m"] + 60.0 * trial["r"]
    psi = trial["psi"]
    rates = trial["u"] * np.cos(psi) - drifting * np.sin(psi), trial["u"] * np.sin(psi) + drifting * np.cos(psi)
    x, y = (integral(trial.t, one) for one in rates)
    for u, keys in ((trial["u"], []), (1.01 * trial["u"], []), (np.hypot(trial["u"], drifting), ["speed_as_surge"])):
        log = trial.having(x=x, y=y, u=u, v_m=np.zeros(len(trial)))
        assert [one.key for one in surge_faults([log])] == keys


def test_a_course_that_swings_about_the_track_is_a_heading() -> None:
    """Where the ship drifts to and fro, the course over ground is along the track and the heading beside it."""
    trial = sailed()
    course = trial["psi"] + np.arctan2(trial["v_m"], trial["u"])
    heading = course + 0.3 * np.sin(0.05 * trial.t)
    for psi, gamma_G, keys in ((heading, course, []), (course, heading, ["course_as_heading"])):
        log = trial.having(psi=psi, gamma_G=gamma_G)
        assert [one.key for one in track_faults(log)] == keys
    # standing still for a while, its fixes go anywhere
    sailing = np.where(trial.t < 100.0, trial.t, np.maximum(trial.t - 80.0, 100.0))
    rng = np.random.default_rng(0)
    rests = {name: np.interp(sailing, trial.t, trial[name]) + 0.02 * rng.standard_normal(len(trial)) for name in "xy"}
    turned = {name: np.interp(sailing, trial.t, one) for name, one in (("psi", course), ("gamma_G", heading))}
    assert [one.key for one in track_faults(trial.having(**rests, **turned))] == ["course_as_heading"]


@pytest.mark.parametrize(("shown", "unit"), [(2.0, "1/s"), (120.0, "rpm")])
def test_a_propeller_advances_a_fortieth_of_a_length_in_a_turn(shown: float, unit: str) -> None:
    """A ship of 100 m at 5 m/s turns by half a radian a length: at 2 turns a second it goes 2.5 m in each."""
    values = np.full(100, shown)
    column = SimpleNamespace(unit="", said="'REV'", where="header", letters={})
    keys, answer = read_revolutions(Signal("n_P", column, values), np.full(100, 5.0), np.full(100, 0.025), 3.0)  # pyright: ignore
    assert keys["unit"] == f'"{unit}"'
    assert not answer.doubts


def step(do: str, *channels: str, amount: tuple[float, ...] = (), **more: object) -> Trial:
    [found] = mended(sailed(), [Step(do=do, channels=channels, amount=amount, **more)])  # pyright: ignore
    return found


def test_speeds_of_a_point_ahead_and_aside_are_those_of_a_rigid_body() -> None:
    trial = sailed()
    ahead, aside = 12.0, -3.0
    spoilt = trial.having(u=trial["u"] - aside * trial["r"], v_m=trial["v_m"] + ahead * trial["r"])
    [found] = mended(spoilt, [Step(do="move", channels=("u", "v_m"), amount=(ahead, aside))])
    assert np.allclose(found["u"], trial["u"])
    assert np.allclose(found["v_m"], trial["v_m"])


def test_turned_axes_of_velocities_are_turned_back() -> None:
    """Axes turned clockwise by 10 deg: a ship that goes straight ahead seems to go to port in them."""
    found = step("rotate", "u", "v_m", amount=(10.0,))
    trial = sailed()
    angle = np.arctan2(found["v_m"], found["u"]) - np.arctan2(trial["v_m"], trial["u"])
    assert np.allclose(np.degrees(angle), -10.0)
    assert np.allclose(np.hypot(found["u"], found["v_m"]), np.hypot(trial["u"], trial["v_m"]))


def test_courses_wind_clocks_and_currents() -> None:
    trial = sailed()
    drift = np.arctan2(trial["v_m"], trial["u"])
    [compass] = mended(trial.having(psi=trial["psi"] + drift), [Step(do="from_course", channels=("psi",))])
    assert np.allclose(compass["psi"], trial["psi"])
    relative = trial.having(gamma_T=1.0 - trial["psi"])
    [wind] = mended(relative, [Step(do="from_bow", channels=("gamma_T",))])
    assert np.allclose(wind["gamma_T"], 1.0)
    late = replace(trial, t=100.0 + 3.0 * trial.t)
    [clock] = mended(late, [Step(do="clock", amount=(1.0 / 3.0,))])
    assert np.allclose(clock.t, 100.0 + trial.t)
    [even] = mended(late, [Step(do="even", amount=(0.5,))])
    assert np.allclose(even.t, 100.0 + 0.5 * np.arange(len(trial)))
    towards = step("current", amount=(0.7, 250.0))
    assert np.allclose(towards["U_C"], 0.7)
    assert np.allclose(np.exp(1j * towards["gamma_C"]), np.exp(1j * math.radians(250.0)))


def test_a_servo_follows_at_its_rate_and_no_faster() -> None:
    """From an order of 10 deg at once, at 2 deg/s: two degrees a second for five seconds, then held."""
    t = np.arange(0.0, 20.0)
    order = np.radians(np.where(t < 3.0, 0.0, 10.0))
    [found] = mended(Trial("a", t, {"delta": order}), [Step(do="follow", channels=("delta",), amount=(2.0,))])
    assert np.allclose(np.degrees(found["delta"]), np.clip(2.0 * (t - 2.0), 0.0, 10.0))
    assert np.array_equal(found["delta_cmd"], order)


def test_a_stretch_has_both_of_its_ends() -> None:
    found = step("gaps", "r", where=((10.0, 20.0),))
    gone = np.isnan(found["r"])
    assert float(found.t[gone][0]) == 10.0
    assert float(found.t[gone][-1]) == 20.0


@pytest.mark.parametrize("lag", [-7.3, 4.1])
def test_what_came_late_is_put_where_it_belongs(lag: float) -> None:
    t = np.arange(0.0, 100.0, 0.5)
    true = Trial("a", t, {"u": t, "r": 3.0 * (t - lag)})
    found = shifted(true, lag, "r")
    assert np.allclose(found["r"], 3.0 * found.t)
    assert float(found.t[0]) == (0.0 if lag > 0 else math.ceil(-2.0 * lag) / 2.0)
    assert float(found.t[-1]) == (t[-1] if lag < 0 else math.floor(2.0 * (t[-1] - lag)) / 2.0)


def test_values_go_to_their_nearest_rows() -> None:
    rng = np.random.default_rng(3)
    rows, times = np.sort(rng.uniform(0.0, 100.0, 40)), np.sort(rng.uniform(0.0, 100.0, 25))
    values, reach = rng.standard_normal(25), 1.5
    found, far = nearest_rows(rows, times, values, reach)
    wanted, moved = np.full(40, np.nan), 0.0
    for row in range(40):
        mine = [k for k in range(25) if int(np.argmin(np.abs(rows - times[k]))) == row]
        mine = [k for k in mine if abs(rows[row] - times[k]) <= reach]
        moved = max([moved, *(abs(rows[row] - times[k]) for k in mine)])
        if mine:
            wanted[row] = values[min(mine, key=lambda k: abs(rows[row] - times[k]))]
    assert np.array_equal(found, wanted, equal_nan=True)
    assert far == pytest.approx(moved)


def test_longer_steps_average_noise_and_do_not_fold_it() -> None:
    """White noise over ten rows at a time has a tenth of its variance; a coarse sample alone would keep all."""
    rng = np.random.default_rng(0)
    trial = Trial("a", 0.1 * np.arange(40_001), {"u": rng.standard_normal(40_001)})
    found = resample(trial, 1.0)["u"][1:-1]
    assert found.size == 3999
    assert float(np.var(found)) == pytest.approx(1.0 / 11.0, rel=5.0 * math.sqrt(2.0 / 3999))  # 11 rows, both ends


# -- single rows


def test_a_spike_is_told_by_its_neighbours_and_half_as_large_a_step_is_none() -> None:
    trial = sailed()
    rng = np.random.default_rng(0)
    noisy = trial.having(x=trial["x"] + 0.1 * rng.standard_normal(len(trial)),
                         y=trial["y"] + 0.1 * rng.standard_normal(len(trial)))  # fmt: skip
    for rows, size in (((400,), 5.0), ((300, 900), -8.0)):
        x = noisy["x"].copy()
        x[list(rows)] += size
        found, clean = outlier_faults(noisy.having(x=x))
        assert [one.key for one in found] == ["spike"]
        assert np.flatnonzero(np.isnan(clean["x"])).tolist() == list(rows)
    stepped = noisy.having(x=noisy["x"] + np.where(trial.t > 200.0, 5.0, 0.0))
    assert not outlier_faults(stepped)[0]


# -- instruments of a mapping

TIME = 'time = { column = "t", unit = "s" }\n'


def imported(path: Path, columns: dict[str, Array], text: str) -> Trial:
    listed = {"t": sailed().t.tolist(), **{name: values.tolist() for name, values in columns.items()}}
    [found] = trials(table(path, listed), TIME + text)
    return found


HEADING = '[channels.psi]\ncolumn = "h"\nunit = "rad"\n'


def test_a_log_off_midship_is_brought_there_by_the_turning(tmp_path: Path) -> None:
    """A log 20 m ahead and 4 m to starboard moves with u - 4 r ahead and v + 20 r aside; its course is that of both."""
    trial = sailed()
    u, v = trial["u"] - 4.0 * trial["r"], trial["v_m"] + 20.0 * trial["r"]
    columns = {"h": trial["psi"], "ROT": trial["r"], "STW": np.hypot(u, v), "CTW": trial["psi"] + np.arctan2(v, u)}
    text = ('[channels.r]\ncolumn = "ROT"\nunit = "rad/s"\n[log]\nspeed = "STW"\nunit = "m/s"\ncourse = "CTW"\n'
            'course_unit = "rad"\nplace = [20.0, 4.0]\n')  # fmt: skip
    found = imported(tmp_path / "a.csv", columns, HEADING + text)
    assert np.allclose(found["u"], trial["u"], atol=1e-6)
    assert np.allclose(found["v_m"], trial["v_m"], atol=1e-6)


def test_an_offset_is_in_the_unit_of_its_column_after_the_sign(tmp_path: Path) -> None:
    """psi = -HDG + 30 deg: the number that stands in the mapping is in the unit that stands there."""
    columns = {"h": sailed()["psi"], "RUD": 10.0 * np.sin(sailed().t)}
    text = '[channels.delta]\ncolumn = "RUD"\nunit = "deg"\nsign = -1\noffset = 3.0\nscale = 2.0\n'
    found = imported(tmp_path / "a.csv", columns, HEADING + text)
    assert np.allclose(np.degrees(found["delta"]), -20.0 * np.sin(found.t) + 3.0)


def turned(axis: int, angle: Array) -> Array:
    """Quaternions x, y, z, w of a turn about one axis, shape (rows, 4)."""
    out = np.zeros((angle.size, 4))
    out[:, axis], out[:, 3] = np.sin(0.5 * angle), np.cos(0.5 * angle)
    return out


def times(p: Array, q: Array) -> Array:
    a, b = p[:, :3], q[:, :3]
    vector = p[:, 3:] * b + q[:, 3:] * a + np.cross(a, b)
    return np.column_stack([vector, p[:, 3] * q[:, 3] - (a * b).sum(axis=1)])


@pytest.mark.parametrize("frame", ["ned", "enu"])
def test_the_heading_of_a_quaternion_is_that_of_yaw_pitch_and_roll(tmp_path: Path, frame: str) -> None:
    """Turned by yaw about z, then pitch about y, then roll about x; roll and pitch leave the yaw as it is."""
    trial = sailed()
    yaw = trial["psi"] if frame == "ned" else 0.5 * math.pi - trial["psi"]
    q = times(times(turned(2, yaw), turned(1, 0.2 * np.sin(trial.t))), turned(0, 0.3 * np.cos(trial.t)))
    columns = dict(zip(("qx", "qy", "qz", "qw"), q.T, strict=True))
    text = f'[heading]\nquaternion = ["qx", "qy", "qz", "qw"]\nframe = "{frame}"\n'
    found = imported(tmp_path / "a.csv", columns, text)
    assert np.allclose(np.exp(1j * found["psi"]), np.exp(1j * trial["psi"]), atol=1e-6)


def test_a_wind_that_is_told_by_where_it_goes_comes_from_the_other_side(tmp_path: Path) -> None:
    columns = {"h": sailed()["psi"], "WS": 8.0 + 0.0 * sailed().t, "WD": 30.0 + 10.0 * np.sin(0.1 * sailed().t)}
    text = '[apparent]\nspeed = "WS"\nunit = "m/s"\ndirection = "WD"\ndirection_unit = "deg"\ntowards = true\n'
    found = imported(tmp_path / "a.csv", columns, HEADING + text)
    assert np.allclose(np.exp(1j * found["gamma_A"]), -np.exp(1j * np.radians(columns["WD"])), atol=1e-6)


def test_the_datum_is_the_first_fix_and_not_latitude_and_longitude_zero(tmp_path: Path) -> None:
    trial = sailed()
    here = Datum(63.44, 10.4)
    places = np.array([here.place(float(x), float(y)) for x, y in zip(trial["x"], trial["y"], strict=True)])
    places[:3] = 0.0
    columns = {"h": trial["psi"], "lat": places[:, 0], "lon": places[:, 1]}
    text = '[position]\nlatitude = "lat"\nlongitude = "lon"\nformat = "deg"\n'
    found = imported(tmp_path / "a.csv", columns, HEADING + text)
    assert np.allclose(found["x"][3:] - found["x"][3], trial["x"][3:] - trial["x"][3], atol=0.05)
    assert np.allclose(found["y"][3:] - found["y"][3], trial["y"][3:] - trial["y"][3], atol=0.05)
    assert np.isnan(found["x"][:3]).all()  # what a receiver without a fix says is none


# -- harbours


def test_a_hull_reaches_half_its_diagonal_and_a_fender_its_height(tmp_path: Path) -> None:
    """Every cell from a point of which the hull may touch a fender holds it, and none from which it never does."""
    quay = Quay(np.array([[0.0, 0.0], [400.0, 0.0]]), Fender(CURVES["linear"], 2.0, 1e6, 100.0))
    ship = Size(100.0, 20.0, 5.0)
    grid = grid_of(Chart("a", 30.0, quays=(quay,)), ship, 10.0)
    away = 0.5 * math.hypot(100.0, 20.0) + 2.0
    posts = np.array([[50.0 + 100.0 * k, 0.0] for k in range(4)])
    rows, columns = np.array(grid.field.which.shape)
    held = grid.field.sets[grid.field.which][..., : 6 * grid.stops].reshape(rows, columns, grid.stops, 6)
    for i in range(0, int(rows), 3):
        for j in range(0, int(columns), 3):
            middle = np.array([grid.field.north + 10.0 * (i + 0.5), grid.field.east + 10.0 * (j + 0.5)])
            known = {(float(one[0]), float(one[1])) for one in held[i, j] if one[3] > 0.0}
            for post in posts:
                far = float(np.linalg.norm(middle - post))
                if far < away:
                    assert tuple(post) in known
                elif far > away + 2.0 * 10.0:
                    assert tuple(post) not in known


def test_the_stiffness_of_fenders_is_of_all_along_a_ship() -> None:
    """A spring of 1 MN over 2 m has .5 MN/m; along 100 m there are five of them, 20 m apart."""
    quay = Quay(np.array([[0.0, 0.0], [400.0, 0.0]]), Fender(CURVES["linear"], 2.0, 1e6, 20.0))
    assert grid_of(Chart("a", 30.0, quays=(quay,)), Size(100.0, 20.0, 5.0)).stiffness == pytest.approx(5 * 0.5e6)


def test_a_sloped_bank_draws_like_a_wall_through_the_middle_of_its_slope() -> None:
    ship = Size(100.0, 20.0, 5.0)
    line = np.array([[-400.0, 0.0], [400.0, 0.0]])
    pulls = []
    for bank, side in ((Bank(line, 0.1), 60.0 + 50.0), (Bank(line), 60.0)):  # 10 m deep: the slope is 100 m wide
        grid = grid_of(Chart("a", 10.0, banks=(bank,), fairways=(line + np.array([0.0, 300.0]),)), ship, 5.0)
        j = round((side - grid.field.east) / 5.0)
        pulls.append(grid.field.table[len(grid.field.table) // 2, j, grid.field.names.index("chart.bank_y")])
    assert pulls[0] < 0.0
    assert pulls[0] == pytest.approx(pulls[1], rel=1e-9)


def test_mirror_ships_add_up_by_pairs_and_fade_with_the_fifth_power() -> None:
    """Deep water has one mirror ship, shallow water a pair for each multiple of the depth."""
    d, h, L = np.array([40.0]), np.array([12.0]), 100.0
    deep = suction(d, np.array([np.inf]), L)
    assert deep == pytest.approx(64.0 / math.pi * d / L * between(2.0 * d / L))
    pairs = sum(2.0 * between(2.0 * np.sqrt(d * d + (k * h) ** 2) / L) for k in range(1, 11))
    assert suction(d, h, L) == pytest.approx(deep + 64.0 / math.pi * d / L * pairs)
    assert between(np.array([40.0]))[0] == pytest.approx(between(np.array([20.0]))[0] / 32.0, rel=5e-3)
