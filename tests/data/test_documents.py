"""Documents, sidecars and messages: what is taken and what refused at each bound, and what comes back as it was."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from columns import signal

from seatrial.data import DataError, Trial
from seatrial.data.documents import read_json, read_toml, read_yaml, yaml_text
from seatrial.data.formats.usv_asw import FULL, STOP, _clock, _numbers, _unswapped, north_east
from seatrial.data.geodesy import Datum
from seatrial.data.guess.entries import Known, control_entries
from seatrial.data.robot.messages import FIX, NUMBER, ODOMETRY, TWIST, _angles, earth_fixed, packed, unpacked
from seatrial.data.robot.topics import Number
from seatrial.data.sidecar import began, check_meta, plain_meta, sidecar_text
from seatrial.data.trialfile import read_trial, write_trial

NAN = math.nan
WHERE = Path("a.yaml")


@pytest.mark.parametrize(("text", "value"), [
    ("no", "no"), ("010", 10), ("1:45", "1:45"), ("1e3", 1000.0), (".inf", math.inf), ("-.5", -0.5), ("true", True),
    ("FALSE", False), ("~", None), ("+7", 7), ("9999999999999999999", 9999999999999999999),
    ("2024-99-99", "2024-99-99"),
])  # fmt: skip
def test_a_scalar_of_yaml_is_that_of_the_core_schema(text: str, value: Any, tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text(f"k: {text}\n")
    found = read_yaml(path)["k"]
    assert (found, type(found)) == (value, type(value))
    path.write_text(yaml_text({"k": value, "t": text}))
    assert read_yaml(path) == {"k": value, "t": text}


@pytest.mark.parametrize(("text", "said"), [
    ("a: 1\na: 2", "line 2: not YAML .key 'a' twice"), ("a: &x 1", "anchors"), ("- 1", "must be keys with values"),
    ("a: 99999999999999999999", "more than 19 digits"), ("[a: 1", "line "), ("? [1]\n: 2", "a key is a plain text"),
])  # fmt: skip
def test_what_yaml_is_not_read(text: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text(text)
    with pytest.raises(DataError, match=said):
        read_yaml(path)


@pytest.mark.slow
def test_documents_have_a_most_size(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_text("#" * 200_000)
    with pytest.raises(DataError, match="must be keys"):
        read_yaml(path)
    path.write_text("#" * 200_001)
    with pytest.raises(DataError, match="200001 bytes; 200000 are the most"):
        read_yaml(path)
    path.write_text("{}".ljust(1_000_000))
    assert read_json(path) == {}
    path.write_text("{}".ljust(1_000_001))
    with pytest.raises(DataError, match="1000000 are the most"):
        read_json(path)
    for text, said in (('{"a": NaN}', "no number of JSON"), ('{"a": ' + "9" * 21 + "}", "a number of 21 digits")):
        path.write_text(text)
        with pytest.raises(DataError, match=said):
            read_json(path)
    path.write_text('{"a": ' + "9" * 20 + "}")
    assert read_json(path) == {"a": int("9" * 20)}
    path.write_text("a = 1")
    assert read_toml(path) == {"a": 1}
    with pytest.raises(DataError, match="not a file"):
        read_yaml(tmp_path)


@pytest.mark.parametrize(("key", "low", "high"), [
    ("scale", 0.01, 1e4), ("L_pp", 0.1, 600), ("water_density", 900, 1100),
])  # fmt: skip
def test_numbers_of_a_sidecar_are_within_what_there_is(key: str, low: float, high: float) -> None:
    check_meta(WHERE, {key: low})
    check_meta(WHERE, {key: high})
    for wrong in (0.99 * low, 1.01 * high, True, "1"):
        with pytest.raises(DataError, match=f"{key} is .*; it must be a number from {low:g} to {high:g}"):
            check_meta(WHERE, {key: wrong})


@pytest.mark.parametrize(("points", "good"), [
    ({"delta": math.pi}, True), ({"delta": 3.15}, False), ({"heading": 6.28}, True), ({"heading": 6.29}, False),
    ({"rudder [deg]": 180.0}, True), ({"rudder [deg]": -181.0}, False), ({"psi [deg]": 360.0}, True),
    ({"psi [deg]": 361.0}, False), ({"psi [gon]": 1.0}, False), ({"psi": True}, False), ({"speed": 99.0}, True),
])  # fmt: skip
def test_set_points_are_angles(points: dict[str, Any], good: bool) -> None:
    if good:
        check_meta(WHERE, {"set_points": points})
        return
    with pytest.raises(DataError, match="set_points"):
        check_meta(WHERE, {"set_points": points})


def test_a_sidecar_has_conventions_a_start_and_a_datum() -> None:
    assert began("a", {"start": "1970-01-01T00:00:01.000002+00:00"}) == 1_000_002_000
    assert began("a", {"start": "1970-01-01T02:00:00+02:00"}) == 0
    assert began("a", {"epoch_utc": "2000-01-01T00:00:00Z"}) == 946_684_800 * 10**9
    assert began("a", {}) == 0
    for wrong in ("2000-01-01T00:00:00", "1969-12-31T23:59:59+00:00", "2263-01-01T00:00:00+00:00", "soon"):
        with pytest.raises(DataError, match="a: start is"):
            began("a", {"start": wrong})
    for meta in ({"L_ppp": 1.0}, {"datum": {"latitude": 90.0, "longitude": 0.0}}, {"datum": {"latitude": 1.0}},
                 {"frame": "ENU"}, {"delta_positive": "up"}, {"ship": 3}, {"held": ["a", 1]},
                 {"restart": "1"}):  # fmt: skip
        with pytest.raises(DataError):
            check_meta(WHERE, meta)
    check_meta(WHERE, {"delta_positive": "port_turn", "held": ["a"], "restart": 1.5, "notes": [1]})
    said = plain_meta(WHERE, {"datum": {"latitude": np.float64(1.5)}, "held": ("a",), "notes": np.arange(2)})
    assert (said["datum"], said["held"], said["notes"], said["frame"]) == ({"latitude": 1.5}, ["a"], [0, 1], "NED")
    assert sidecar_text(WHERE, {}).startswith("schema: manoeuvre-trial/1\n")
    with pytest.raises(DataError, match="'notes' is a set"):
        plain_meta(WHERE, {"notes": {1}})


def test_a_rudder_to_port_is_turned_where_a_sidecar_says_so(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t [s],delta [deg],delta_cmd [deg],psi [deg]\n0,10,20,5\n1,-10,-20,6\n")
    (tmp_path / "a.yaml").write_text("schema: manoeuvre-trial/1\ndelta_positive: port_turn\n")
    found = read_trial(tmp_path / "a.csv")
    assert np.degrees(found["delta"]) == pytest.approx([-10.0, 10.0])
    assert np.degrees(found["delta_cmd"]) == pytest.approx([-20.0, 20.0])
    assert np.degrees(found["psi"]) == pytest.approx([5.0, 6.0])
    assert found.meta["delta_positive"] == "starboard_turn"
    write_trial(found, tmp_path / "b.csv")
    assert read_trial(tmp_path / "b.csv")["delta"].tolist() == found["delta"].tolist()


# -- messages of robots


@pytest.mark.parametrize("psi", [0.0, 1.0, math.pi, -2.0])
def test_an_orientation_is_yaw_from_east_and_roll_about_the_bow(psi: float) -> None:
    for phi in (0.0, 0.3, -0.4):
        half, tilt = 0.5 * (0.5 * math.pi - psi), 0.5 * phi
        q = SimpleNamespace(w=math.cos(half) * math.cos(tilt), x=math.cos(half) * math.sin(tilt),
                            y=math.sin(half) * math.sin(tilt), z=math.sin(half) * math.cos(tilt))  # fmt: skip
        found = _angles(q)
        assert math.cos(found["psi"] - psi) == pytest.approx(1.0)
        assert -math.pi < found["psi"] <= math.pi + 1e-12
        assert found["phi"] == pytest.approx(phi)
        assert found["theta"] == pytest.approx(0.0)
    for size, known in ((1.0004, True), (1.0006, False)):
        q = SimpleNamespace(x=0.0, y=0.0, z=0.0, w=size)
        assert ("psi" in _angles(q)) == known
    bow_up = SimpleNamespace(x=0.0, y=-math.sin(0.1), z=0.0, w=math.cos(0.1))  # about an axis to port
    assert _angles(bow_up)["theta"] == pytest.approx(0.2)


@pytest.mark.slow
def test_messages_come_back_with_their_stamps_and_frames() -> None:
    pytest.importorskip("rosbags")
    stamp = 1_793_275_200_123_456_789
    said = {"x": 3.0, "y": -4.0, "psi": 2.0, "phi": 0.1, "u": 5.0, "v_m": 0.3, "r": -0.02}
    found = unpacked(ODOMETRY, packed(ODOMETRY, stamp, said))
    assert (found.stamp, found.frames) == (stamp, ("map", "base_link"))
    assert dict(found.values) == pytest.approx({**said, "theta": 0.0})
    twist = unpacked(TWIST, packed(TWIST, stamp, said))
    assert (twist.frames, dict(twist.values)) == (("base_link",), {"u": 5.0, "v_m": 0.3, "r": -0.02})
    fix = unpacked(FIX, packed(FIX, stamp, {"latitude": 35.0, "longitude": -139.0}))
    assert (fix.frames, dict(fix.values)) == (("gnss",), {"latitude": 35.0, "longitude": -139.0})
    number = unpacked(NUMBER, packed(NUMBER, stamp, {"value": 1.5}))
    assert (number.stamp, dict(number.values)) == (None, {"value": 1.5})
    for frame, earth in (("map", True), ("odom_combined", True), ("base_link", False), ("ship/earth", True),
                         ("local_enu", True), ("mapped", False)):  # fmt: skip
        assert earth_fixed(frame) == earth
    degrees, pulses = Number("delta", "deg", -1), Number("throttle_port", "%", scale=0.25, offset=-375.0)
    assert degrees.of(np.array([10.0]))[0] == pytest.approx(-math.pi / 18.0)
    assert pulses.of(np.array([1500.0, 1900.0])).tolist() == pytest.approx([0.0, 1.0])
    assert Number("delta").of(np.array([10.0]))[0] == 10.0


# -- the public catamaran


def test_metres_of_the_catamaran_are_those_of_the_plane() -> None:
    here = Datum(38.9, 121.5)
    latitude, longitude = np.array([NAN, 38.9, 38.905, 38.895]), np.array([NAN, 121.5, 121.49, 121.51])
    found, exact = north_east(latitude, longitude), here.track(latitude, longitude)
    for one, other in zip(found, exact, strict=True):
        assert one[1:] == pytest.approx(other[1:], abs=0.12)  # a kilometre away
    assert (found[0][1], found[1][1]) == (0.0, 0.0)
    assert (STOP, FULL) == (1500.0, 500.0)


def test_cells_of_its_workbook() -> None:
    times = ["2025-07-24 15:45:54.179", "2025-07-24 15:45:54.289", "2025-07-24 15:46:54.289"]
    assert _clock(WHERE, times) == pytest.approx([0.0, 0.11, 60.11])
    assert _numbers(WHERE, "a", ["1.5", "", None]) == pytest.approx([1.5, NAN, NAN], nan_ok=True)
    for cell, said in (("x", "row 3: 'x' is no number"), ("inf", "row 3: 'inf' is not finite")):
        with pytest.raises(DataError, match=said):
            _numbers(WHERE, "a", ["1", cell])
    with pytest.raises(DataError, match="row 3: 'noon' is no time"):
        _clock(WHERE, [times[0], "noon"])


@pytest.mark.parametrize(("compass", "exchanged"), [(0.069, True), (0.071, False)])
def test_its_compass_is_the_column_that_does_not_follow_the_track(compass: float, exchanged: bool) -> None:
    t = np.arange(40.0)
    trial = Trial("a", t, {"x": 2.0 * t, "y": 0.0 * t, "psi": np.full(40, compass), "gamma_G": np.full(40, -0.1)})
    assert (_unswapped(trial)["psi"][0] == -0.1) == exchanged


# -- controls of a guess


def test_azimuths_and_shafts_beside_them_are_named_as_thrusters() -> None:
    t = np.arange(60.0)
    known = Known(t, None, np.full(60, -1.0), None, 0.01 + 0.0 * t, None)
    found = {"alpha_1": signal("alpha_1", np.linspace(-7.1, 7.0, 60)), "n_P_1": signal("n_P_1", np.full(60, 90.0)),
             "delta": signal("delta", np.full(60, 20.0), unit="deg"), "u": signal("u", t)}  # fmt: skip
    entries = {one.table: one for one in control_entries(found, known, set(), True)}
    assert set(entries) == {"channels.alpha_1", "channels.n_1", "channels.delta"}
    assert entries["channels.alpha_1"].keys["unit"] == '"deg"'
    assert entries["channels.n_1"].keys["unit"] == '"rpm"'
    doubts = entries["channels.delta"].answer.doubts
    assert any("turn its sign too" in one for one in doubts)
    assert any("astern most of the time" in one for one in doubts)
    small = {"alpha_1": signal("alpha_1", [0.0, 6.9]), "n_P": signal("n_P", [1.0, 2.0], unit="1/s")}
    plain = {one.table: one for one in control_entries(small, Known(t, None, None, None, None, None), set(), False)}
    assert plain["channels.alpha_1"].keys["unit"] == '"rad"'
    alone = list(control_entries({"n_P": small["n_P"]}, Known(t, None, None, None, None, None), set(), False))
    assert [one.table for one in alone] == ["channels.n_P"]


@pytest.mark.parametrize("text", ["a: 1\nb: [1, 2.5, no, 010, 1:45, ~, .inf, true]\nc: {d: 'x'}\n",
                                  "a: |\n  two\n  lines\n",
                                  "---\nk: v\n...\n", "a: 2024-99-99\n", "ключ: 'длина'\n"])  # fmt: skip
def test_both_readers_of_yaml_read_the_same(text: str) -> None:
    """libyaml reads, and where there is none PyYAML does."""
    import yaml

    from seatrial.data.documents import _loader

    assert yaml.load(text, Loader=_loader(True)) == yaml.load(text, Loader=_loader(False))


@pytest.mark.parametrize("text", ["a: &x 1\nb: *x\n", "a: 1\na: 2\n", "? [1]\n: 2\n", "a: [1\n", f"a: {'9' * 30}\n"])
def test_both_readers_of_yaml_refuse_the_same(text: str) -> None:
    import yaml

    from seatrial.data.documents import _loader

    for quick in (True, False):
        with pytest.raises(yaml.YAMLError):
            yaml.load(text, Loader=_loader(quick))
