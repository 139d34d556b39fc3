"""Columns that are not what their names say: thrust of two motors, servos, magnetic headings, degrees as x and y."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
from columns import signal
from turning_log import fixes, table, trials, truth

from seatrial.data import Array, Trial
from seatrial.data.guess import guess
from seatrial.data.guess.entries import Known
from seatrial.data.guess.helm import neutral_of
from seatrial.data.guess.naming import magnetic, meanings
from seatrial.data.guess.roles import held_over
from seatrial.data.guess.thrust import _scaled, thrust_entries

SCHEMA = 'schema = "seatrial-mapping/1"\n'


def imported(log: Path) -> Trial:
    """The trial of a log by its guess, which asks nothing."""
    found = guess(log)
    assert not found.asks
    return trials(log, found.text.replace(SCHEMA, ""))[0]


def driven(port: Array, starboard: Array, dt: float) -> tuple[Array, Array]:
    """Speed and rate of turn of a boat whose motors push at both sides: linear damping, exact from row to row."""
    u, r, keep = np.zeros(port.size), np.zeros(port.size), np.exp(-dt / np.array([3.0, 1.5]))
    for k in range(port.size - 1):
        u[k + 1] = keep[0] * u[k] + (1.0 - keep[0]) * 1.2 * (port[k] + starboard[k])
        r[k + 1] = keep[1] * r[k] + (1.0 - keep[1]) * 0.5 * (port[k] - starboard[k])
    return u, r


@pytest.mark.parametrize(("p", "q", "exchanged"), list(itertools.product((1, -1), (1, -1), (False, True))))
def test_motors_get_the_side_and_the_sense_that_the_boat_shows(p: int, q: int, exchanged: bool) -> None:
    dt, rng = 0.2, np.random.default_rng(3)
    t = dt * np.arange(1500)
    port, starboard = (np.repeat(rng.uniform(-0.9, 0.9, 75), 20) for _ in range(2))
    u, r = driven(port, starboard, dt)
    left, right = (starboard, port) if exchanged else (port, starboard)
    pulses = [np.round(1500.0 + 400.0 * sign * one) for sign, one in ((p, left), (q, right))]
    found = {f"throttle_{k}": signal(f"throttle_{k}", values, f"thr_{side}", means=tuple(meanings(f"thr_{side}")))
             for k, (side, values) in enumerate(zip(("left", "right"), pulses, strict=True), start=1)}  # fmt: skip
    entries = {one.table: one for one in thrust_entries(found, Known(t, np.cumsum(r) * dt, u, 0.0 * u, r, u))}
    columns = ("thr_right", "thr_left") if exchanged else ("thr_left", "thr_right")
    signs = (q, p) if exchanged else (p, q)
    for side, column, sign, true in zip(("port", "starboard"), columns, signs, (port, starboard), strict=True):
        keys = entries[f"channels.throttle_{side}"].keys
        assert keys["column"] == f'"{column}"'
        raw = pulses[0] if column == "thr_left" else pulses[1]
        read = raw * float(keys["scale"]) * float(keys.get("sign", "1")) + float(keys["offset"])
        assert read == pytest.approx(true, abs=0.5 / 400.0 + 1e-9)
        said = " ".join(entries[f"channels.throttle_{side}"].answer.doubts)
        assert ("exchanged" in said) == exchanged
        assert ("sign is turned" in said) == (sign < 0)


@pytest.mark.parametrize("zero", [1470.0, 1500.0, 1510.0])
def test_every_pulse_that_a_controller_takes_is_at_most_full_thrust(zero: float) -> None:
    pulses = np.array([zero] * 200 + [1100.0, 1900.0] * 50)
    keys, read, _ = _scaled(signal("throttle_1", pulses, "thr_left"), "throttle")
    assert read[0] == 0.0
    assert float(np.abs(read).max()) == pytest.approx(1.0)  # more would be refused as beyond the thruster's map
    assert read == pytest.approx(pulses * float(keys["scale"]) + float(keys["offset"]), abs=1e-7)


def test_motors_of_a_boat_at_rest_keep_their_names_and_say_that_nothing_shows_them() -> None:
    rest = np.zeros(400)
    found = {f"force_{k}": signal(f"force_{k}", rest + 5.0, f"{side}_force", means=tuple(meanings(f"{side}_force")))
             for k, side in enumerate(("left", "right"), start=1)}  # fmt: skip
    entries = list(thrust_entries(found, Known(np.arange(400.0), rest, rest, rest, rest, rest)))
    assert [one.table for one in entries] == ["channels.f_port", "channels.f_starboard"]
    assert all(any("does not show its side" in doubt for doubt in one.answer.doubts) for one in entries)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["winch_motor", "servo3_raw", "bow thruster", "ch4out", "pedal position", "C2"])
def test_a_column_like_a_control_is_not_left_out_in_silence(name: str, tmp_path: Path) -> None:
    true = truth()
    log = table(tmp_path / "log.csv", {
        "time": true.t.tolist(), "heading": np.degrees(true["psi"]).tolist(), "u [m/s]": true["u"].tolist(),
        "v [m/s]": true["v_m"].tolist(), "air pressure": (1000.0 + true.t).tolist(), name: np.sin(true.t).tolist(),
    })  # fmt: skip
    doubts = guess(log).doubts
    assert any(f"'{name}' looks like a control" in one for one in doubts)
    assert not any("pressure" in one for one in doubts)


@pytest.mark.parametrize(("neutral", "sign"), [(90.0, 1.0), (90.0, -1.0), (40.0, 1.0), (0.0, 1.0)])
def test_the_neutral_of_a_servo_is_what_its_order_differs_by_from_the_rudder(neutral: float, sign: float) -> None:
    rudder = 20.0 * np.sign(np.sin(np.arange(300) / 20.0))
    late = np.concatenate([np.zeros(5), rudder[:-5]])
    order = signal("rudder_cmd", (neutral + sign * rudder).tolist())
    assert neutral_of(order, signal("rudder", late.tolist())) == neutral


def test_a_servo_alone_has_its_neutral_at_90_and_a_rudder_that_is_held_has_none() -> None:
    both = 90.0 + 25.0 * np.sin(np.arange(300) / 20.0)
    assert neutral_of(signal("servo", both.tolist()), None) == 90.0
    assert neutral_of(signal("rudder", [20.0] * 300), None) == 0.0
    assert neutral_of(signal("rudder", np.linspace(0.0, 35.0, 300).tolist()), None) == 0.0


@pytest.mark.parametrize(("name", "said"), [
    ("HDG_M", True), ("hdgM", True), ("HDM", True), ("Compass Heading", True), ("Heading (mag)", True),
    ("Kompass", True),
    ("Kurs missweisend", True), ("navigation.headingMagnetic", True), ("Mag Heading", True), ("heading", False),
    ("HDT", False), ("gyro compass", False), ("heading_m_true", False), ("image heading", False),
])  # fmt: skip
def test_headings_that_are_magnetic_by_their_name(name: str, said: bool) -> None:
    assert magnetic(name) == said


@pytest.mark.slow
@pytest.mark.parametrize(("names", "map_like"), [(("pos_x", "pos_y"), False), (("X", "Y"), True)])
def test_degrees_in_columns_of_metres_are_a_position(names: tuple[str, str], map_like: bool, tmp_path: Path) -> None:
    true = truth()
    latitude, longitude = fixes(true)
    pair = (longitude, latitude) if map_like else (latitude, longitude)
    cells = [[f"{one:.8f}" for one in values] for values in pair]
    log = table(tmp_path / "log.csv", {
        "t": true.t.tolist(), names[0]: cells[0], names[1]: cells[1], "heading": np.degrees(true["psi"]).tolist(),
        "u [m/s]": true["u"].tolist(), "v [m/s]": true["v_m"].tolist(),
    })  # fmt: skip
    assert any("degrees by their size" in one for one in guess(log).doubts)
    found = imported(log)
    assert np.hypot(found["x"] - true["x"], found["y"] - true["y"]).max() < 0.01


@pytest.mark.parametrize("rows", [1, 2, 5, 10])
def test_a_position_that_is_held_over_rows_is_told_and_a_ship_at_rest_is_not(rows: int) -> None:
    t = np.arange(600.0)
    place = 63.4 + 1e-5 * (t // rows)
    assert held_over(place, 2.0 * place) == rows
    gaps = np.where(t % rows == 0, place, np.nan)
    assert held_over(gaps, gaps) == 1
    rest = np.where(t < 300.0, 63.4, 63.4 + 1e-5 * (t - 300.0))
    assert held_over(rest, rest) == 1
    assert held_over(63.4 + 0.0 * t, 10.4 + 0.0 * t) == 1


@pytest.mark.slow
def test_metres_stay_metres(tmp_path: Path) -> None:
    true = truth()
    log = table(tmp_path / "log.csv", {
        "t": true.t.tolist(), "x": [f"{60.0 + one:.6f}" for one in true["x"]], "y": [f"{one:.6f}" for one in true["y"]],
        "heading": np.degrees(true["psi"]).tolist(), "u [m/s]": true["u"].tolist(), "v [m/s]": true["v_m"].tolist(),
    })  # fmt: skip
    assert "[position]" not in guess(log).text


def test_a_row_without_a_fix_is_a_gap_and_told(tmp_path: Path) -> None:
    true = truth()
    latitude, longitude = ([0.0, 0.0, *one[2:]] for one in fixes(true))
    log = table(tmp_path / "log.csv", {"t": true.t.tolist(), "lat": latitude, "lon": longitude,
                                       "psi": true["psi"].tolist()})  # fmt: skip
    found = trials(log, 'time = { column = "t", unit = "s" }\n[position]\nlatitude = "lat"\nlongitude = "lon"\n'
                        '[channels.psi]\ncolumn = "psi"\nunit = "rad"\n')[0]  # fmt: skip
    assert np.isnan(found["x"][:2]).all()
    assert found["x"][2:] - found["x"][2] == pytest.approx(true["x"][2:] - true["x"][2], abs=0.01)
    assert any("2 positions of 0, 0 are gaps" in str(one) for one in found.meta["processing"])


def test_the_speed_of_a_receiver_without_a_fix_is_a_gap_and_that_of_one_at_rest_is_none(tmp_path: Path) -> None:
    true = truth()
    latitude, longitude = ([0.0, 0.0, 0.0, *one[3:]] for one in fixes(true))
    speed = [0.0, 0.0, 1.5, 0.0, *np.hypot(true["u"], true["v_m"])[4:].tolist()]
    log = table(tmp_path / "log.csv", {
        "t": true.t.tolist(), "sog": speed, "cog": [0.0, 0.0, *np.degrees(true["psi"])[2:].tolist()],
        "lat": latitude, "lon": longitude, "psi": true["psi"].tolist(),
    })  # fmt: skip
    found = trials(log, 'time = { column = "t", unit = "s" }\n[position]\nlatitude = "lat"\nlongitude = "lon"\n'
                        '[ground]\nspeed = "sog"\ncourse = "cog"\n[channels.psi]\ncolumn = "psi"\nunit = "rad"\n')[0]
    for name in ("U_G", "gamma_G", "u", "v_m"):
        assert np.isnan(found[name]).tolist() == [True, True, *[False] * (true.t.size - 2)], name
    assert found["U_G"][2:4] == pytest.approx([1.5, 0.0])


def test_a_speed_to_the_east_is_one_where_there_is_no_fix(tmp_path: Path) -> None:
    true = truth()
    latitude, longitude = ([0.0, 0.0, 0.0, *one[3:]] for one in fixes(true))
    log = table(tmp_path / "log.csv", {
        "t": true.t.tolist(), "vn": [0.0, 0.0, 1.5, *(0.1 * true.t[3:]).tolist()],
        "ve": [0.0, 2.5, *[0.0] * (true.t.size - 2)],
        "lat": latitude, "lon": longitude, "psi": true["psi"].tolist(),
    })  # fmt: skip
    found = trials(log, 'time = { column = "t", unit = "s" }\n[position]\nlatitude = "lat"\nlongitude = "lon"\n'
                        '[ground]\nnorth = "vn"\neast = "ve"\n[channels.psi]\ncolumn = "psi"\nunit = "rad"\n')[0]
    assert np.isnan(found["u"][:3]).tolist() == [True, False, False]
    assert np.hypot(found["u"], found["v_m"])[1:3] == pytest.approx([2.5, 1.5])


@pytest.mark.parametrize("mark", ["\x0b", "\x0c", "\x1c", "\x85", "\u2028"])
def test_a_mark_that_is_no_end_of_a_line_ends_none_for_the_guess_either(mark: str, tmp_path: Path) -> None:
    true = truth()
    rows = [f"{t:g};{np.degrees(one):.6f}" for t, one in zip(true.t, true["psi"], strict=True)]
    log = tmp_path / "log.csv"
    log.write_text("\n".join([f"Ship{mark} blue", "a line", "time;heading", *rows]) + "\n", encoding="utf-8")
    text = guess(log).text
    assert "skip = 2" in text
    assert trials(log, text.replace(SCHEMA, ""))[0]["psi"] == pytest.approx(true["psi"], abs=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize(("empty", "separator"), [((1,), ","), ((2,), ";"), ((1, 2, 4, 6), "\t")])
def test_empty_lines_anywhere_change_nothing(empty: tuple[int, ...], separator: str, tmp_path: Path) -> None:
    true = truth()
    log = table(tmp_path / "log.csv", {
        "Time": ["s", *true.t.tolist()], "Heading": ["deg", *np.degrees(true["psi"]).tolist()],
        "u": ["m/s", *true["u"].tolist()], "v": ["m/s", *true["v_m"].tolist()],
    }, separator)  # fmt: skip
    plain = imported(log)
    lines = log.read_text().splitlines()
    log.write_text("Sea trial\n\n" + "\n".join(f"\n{line}" if k in empty else line for k, line in enumerate(lines)))
    assert imported(log)["psi"] == pytest.approx(plain["psi"])


@pytest.mark.parametrize(("p", "q", "exchanged"), list(itertools.product((1, -1), (1, -1), (False, True))))
def test_motors_that_push_as_much_together_as_ever_are_told_by_going_ahead(p: int, q: int, exchanged: bool) -> None:
    """A boat that turns by its motors alone loses speed in the turn: the speed says nothing of their senses."""
    dt = 0.2
    t = dt * np.arange(1500)
    turn = np.repeat(np.random.default_rng(4).uniform(-0.3, 0.3, 75), 20)
    _, r = driven(0.6 + turn, 0.6 - turn, dt)
    u = 2.0 - 4.0 * np.abs(r)
    left, right = (0.6 - turn, 0.6 + turn) if exchanged else (0.6 + turn, 0.6 - turn)
    pulses = [np.round(1500.0 + 400.0 * sign * one) for sign, one in ((p, left), (q, right))]
    found = {f"throttle_{k}": signal(f"throttle_{k}", values, f"thr_{side}", means=tuple(meanings(f"thr_{side}")))
             for k, (side, values) in enumerate(zip(("left", "right"), pulses, strict=True), start=1)}  # fmt: skip
    entries = {one.table: one for one in thrust_entries(found, Known(t, np.cumsum(r) * dt, u, 0.0 * u, r, u))}
    sides = ("starboard", "port") if exchanged else ("port", "starboard")
    for side, own, sign in zip(sides, ("left", "right"), (p, q), strict=True):
        keys = entries[f"channels.throttle_{side}"].keys
        assert keys["column"] == f'"thr_{own}"'
        assert keys.get("sign") == (None if sign > 0 else "-1")


@pytest.mark.parametrize("east", [0.0, 130.0])
def test_positions_under_names_that_nobody_knows_are_read_and_doubted(east: float, tmp_path: Path) -> None:
    true = truth(dt=2.0)
    latitude, longitude = fixes(true)
    cells = {"Time [s]": list(true.t), "Qwa": [f"{one + east:.8f}" for one in longitude],
             "Qwb": [f"{one:.8f}" for one in latitude], "Heading": list(np.degrees(true["psi"]) % 360.0)}  # fmt: skip
    log = table(tmp_path / "a.csv", cells)
    found = guess(log)
    assert any("its name is none that is known" in one for one in found.doubts)
    trial = trials(log, found.text.replace(SCHEMA, ""))[0]
    for name in "xy":
        assert trial[name] - trial[name][0] == pytest.approx(true[name] - true[name][0], abs=0.05)


def test_degrees_minutes_and_seconds_with_dashes(tmp_path: Path) -> None:
    true = truth(dt=2.0)
    latitude, longitude = fixes(true)

    def dashed(value: float, letters: str) -> str:
        minutes = abs(value) % 1.0 * 60.0
        return f"{int(abs(value))}-{int(minutes):02d}-{minutes % 1.0 * 60.0:08.5f}{letters[value < 0.0]}"

    cells = {"Time [s]": list(true.t), "Lat": [dashed(one, "NS") for one in latitude],
             "Lon": [dashed(one, "EW") for one in longitude],
             "Heading": list(np.degrees(true["psi"]) % 360.0)}  # fmt: skip
    trial = imported(table(tmp_path / "a.csv", cells))
    for name in "xy":
        assert trial[name] - trial[name][0] == pytest.approx(true[name] - true[name][0], abs=0.05)


def test_places_in_a_form_that_is_not_known_are_a_doubt(tmp_path: Path) -> None:
    true = truth(dt=2.0)
    cells = {"Time [s]": list(true.t), "Latitude": [f"JO59{k:04d}x" for k in range(len(true))],
             "Longitude": [f"LK{k:04d}y" for k in range(len(true))],
             "Heading": list(np.degrees(true["psi"]) % 360.0)}  # fmt: skip
    doubts = guess(table(tmp_path / "a.csv", cells)).doubts
    assert any("written in a form that is not known, such as 'JO59" in one for one in doubts)


def test_the_variation_beside_a_magnetic_heading_is_added(tmp_path: Path) -> None:
    true = truth(dt=2.0)
    latitude, longitude = fixes(true)
    cells = {"Time [s]": list(true.t), "Lat": list(latitude), "Lon": list(longitude),
             "Heading_Mag": list((np.degrees(true["psi"]) - 6.5) % 360.0), "Variation": [6.5] * len(true)}  # fmt: skip
    log = table(tmp_path / "a.csv", cells)
    found = guess(log)
    assert any("+6.5 deg of 'Variation' are added" in one for one in found.doubts)
    psi = trials(log, found.text.replace(SCHEMA, ""))[0]["psi"]
    assert np.angle(np.exp(1j * (psi - true["psi"]))) == pytest.approx(0.0, abs=1e-3)


def test_the_last_numbers_of_two_bytes_are_gaps(tmp_path: Path) -> None:
    true = truth(dt=2.0)
    rudder = np.where(np.arange(len(true)) % 17 == 5, 327.67, np.round(np.degrees(true["delta"]), 2))
    cells = {"Time [s]": list(true.t), "Heading": list(np.degrees(true["psi"]) % 360.0), "Rudder": list(rudder)}
    log = table(tmp_path / "a.csv", cells)
    trial = trials(log, guess(log).text.replace(SCHEMA, "").replace('sign = "?"', "sign = 1"))[0]
    assert np.isnan(trial["delta"][5])
    assert np.nanmax(np.abs(trial["delta"] - true["delta"])) < 2e-4


def test_lines_of_separators_around_the_header_say_nothing(tmp_path: Path) -> None:
    true = truth(dt=2.0)
    rows = [f"{t:.1f};{np.degrees(psi) % 360.0:.5f}" for t, psi in zip(true.t, true["psi"], strict=True)]
    log = tmp_path / "a.csv"
    log.write_text("Sea trial;\n;\nTime;Heading\n[s];[deg]\n;\n" + "\n".join(rows) + "\n")
    off = imported(log)["psi"] - true["psi"]
    assert np.angle(np.exp(1j * off)) == pytest.approx(0.0, abs=1e-6)


def test_of_places_under_x_and_y_the_heading_tells_which_is_which(tmp_path: Path) -> None:
    """A map has x to the east; a yaw in radians turned by half would fit the other order nearly as well."""
    true = truth(dt=2.0)
    latitude, longitude = fixes(true)
    yaw = np.round((true["psi"] + np.pi) % (2.0 * np.pi) - np.pi, 4)
    cells = {"stamp": list(true.t), "pos.x": [f"{one:.8f}" for one in longitude],
             "pos.y": [f"{one:.8f}" for one in latitude], "yaw": list(yaw)}  # fmt: skip
    trial = imported(table(tmp_path / "a.csv", cells))
    for name in "xy":
        assert trial[name] - trial[name][0] == pytest.approx(true[name] - true[name][0], abs=0.05)
    assert np.angle(np.exp(1j * (trial["psi"] - true["psi"]))) == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize(("resting", "zero"), [(1100.0, 1500.0), (1900.0, 1500.0), (1470.0, 1470.0), (1530.0, 1530.0)])
def test_a_pulse_is_that_of_no_thrust_only_near_the_middle(resting: float, zero: float) -> None:
    """A motor may idle at a fifth of its thrust, or run full astern, most of the time."""
    values = np.concatenate([np.full(300, resting), np.linspace(1101.3, 1898.7, 200)])
    _, share, (doubt,) = _scaled(signal("throttle_1", values), "throttle")
    assert f"pulses of {zero:g} us for no thrust" in doubt
    assert np.sign(share[0]) == np.sign(resting - zero)


def test_two_temperatures_are_no_position(tmp_path: Path) -> None:
    true = truth(dt=2.0)
    warm = [[f"{23.0 + k + 0.1 * np.sin(0.05 * t + 2.0 * k):.6f}" for t in true.t] for k in (0, 1)]
    cells = {"Time [s]": list(true.t), "Qwa": warm[0], "Qwb": warm[1],
             "Heading": list(np.degrees(true["psi"] * 3.0) % 360.0)}  # fmt: skip
    found = guess(table(tmp_path / "a.csv", cells))
    assert 'latitude = "Qw' not in found.text
    assert any("no position is read, and 'Qwa', 'Qwb' look like one" in one for one in found.doubts)
