"""Logs of PX4 and telemetry of MAVLink: the ship that they were made of comes back to the digits that they hold."""

from __future__ import annotations

import builtins
import math
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from recorded import DATUM, Ship
from telemetry import CODES, ULOG, Link, part, quaternion, tlog, ulog

from seatrial.cli.app import main
from seatrial.data import DataError, Trial
from seatrial.data.formats import reader
from seatrial.data.formats import tlog as tlogs
from seatrial.data.formats import ulog as ulogs
from seatrial.data.guess import guess
from seatrial.data.robot.topics import Number, Topics
from seatrial.workflow.data import importing

SHIP, BOOT, FAR = Ship(), 1_790_000_000.0, 12.5
T = 0.2 * np.arange(200) + FAR
NORTH, EAST = SHIP.place(T - FAR)
PSI, R = SHIP.psi(T - FAR), SHIP.r(T - FAR)
U, V = SHIP.velocity(T - FAR)
V_N, V_E = U * np.cos(PSI) - V * np.sin(PSI), U * np.sin(PSI) + V * np.cos(PSI)
PLACES = [DATUM.place(a, b) for a, b in zip(NORTH, EAST, strict=True)]


def off(got: Any, right: Any) -> float:
    return float(np.abs(np.mod(got - right + math.pi, math.tau) - math.pi).max())


def topics(new: bool = True) -> dict[str, Any]:
    """A log of PX4; of versions since 1.14, or of those before."""
    q = [quaternion(a, 0.1) for a in PSI]
    rows = list(zip(T, T, strict=True))
    fixes = ("double latitude_deg;double longitude_deg", PLACES) if new else (
        "int32_t lat;int32_t lon", [(round(1e7 * a), round(1e7 * b)) for a, b in PLACES])  # fmt: skip
    gps = [(t, *place, north, east, 3, round(1e6 * (BOOT + t)))
           for (t, _), place, north, east in zip(rows, fixes[1], V_N, V_E, strict=True)]  # fmt: skip
    return {
        "vehicle_attitude": ("float[4] q", [(t, *a) for t, a in zip(T, q, strict=True)]),
        "vehicle_angular_velocity": ("float[3] xyz", [(t, 0.0, 0.0, a) for t, a in zip(T, R, strict=True)]),
        "sensor_gps" if new else "vehicle_gps_position":
            (f"{fixes[0]};float vel_n_m_s;float vel_e_m_s;uint8_t fix_type;uint64_t time_utc_usec", gps),
        "actuator_motors": ("float[2] control", [(t, 0.5, 0.01 * k) for k, t in enumerate(T)]),
        "battery_status": ("float voltage_v", [(t, 12.0) for t in T]),
    }  # fmt: skip


@pytest.mark.parametrize("new", [True, False])
def test_a_log_of_px4_gives_the_ship(tmp_path: Path, new: bool) -> None:
    path = tmp_path / "run.ulg"
    path.write_bytes(ulog(topics(new)))
    got = ulogs.read(path)
    assert np.abs(got.t - (T - FAR)).max() < 1e-6
    assert off(got["psi"], PSI) < 1e-6  # single precision
    assert got["phi"] == pytest.approx(0.1, abs=1e-6)
    np.testing.assert_allclose(got["r"], R, rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(got.stack("x", "y"), np.column_stack([NORTH, EAST]), atol=1e-6 if new else 0.012)
    np.testing.assert_allclose(got["u"], U, atol=1e-6)
    np.testing.assert_allclose(got["v_m"], V, atol=1e-6)
    assert got.meta["start"].startswith("2026-09-21T14:13:32.5")
    assert got.meta["ignored"] == {"actuator_motors[1]": 200, "battery_status": 200}
    numbers = {f"actuator_motors[{k}]": Number(name, "-") for k, name in ((1, "throttle_port"), (0, "throttle"))}
    mapped = ulogs.read(path, Topics(numbers=numbers))
    np.testing.assert_allclose(mapped["throttle_port"], 0.01 * np.arange(200), rtol=1e-6)
    with pytest.raises(DataError, match=r"actuator_motors\[0\]"):
        ulogs.read(path, Topics(numbers={"actuator_motor[0]": Number("throttle")}))


def test_places_without_a_fix_are_gaps_and_those_of_the_estimator_have_its_zero(tmp_path: Path) -> None:
    found = topics()
    fields, rows = found["sensor_gps"]
    found["sensor_gps"] = fields, [(*row[:5], 1 if 50 <= k < 100 else 3, row[6]) for k, row in enumerate(rows)]
    path = tmp_path / "run.ulg"
    path.write_bytes(ulog(found))
    assert np.isfinite(ulogs.read(path)["x"]).tolist() == [not 50 <= k < 100 for k in range(200)]
    local = ("float x;float y;float vx;float vy;double ref_lat;double ref_lon;bool xy_valid;bool v_xy_valid",
             [(t, a, b, c, d, DATUM.latitude, DATUM.longitude, True, True)
              for t, a, b, c, d in zip(T, NORTH, EAST, V_N, V_E, strict=True)])  # fmt: skip
    path.write_bytes(ulog({**found, "vehicle_local_position": local}))
    got = ulogs.read(path)
    np.testing.assert_allclose(got.stack("x", "y"), np.column_stack([NORTH, EAST]), atol=2e-6)
    assert got.meta["datum"] == {"latitude": DATUM.latitude, "longitude": DATUM.longitude}
    moved = [(*row[:5], row[5] + (k > 100), *row[6:]) for k, row in enumerate(local[1])]
    path.write_bytes(ulog({**found, "vehicle_local_position": (local[0], moved)}))
    got = ulogs.read(path)
    assert "the zero of vehicle_local_position moves" in " ".join(got.meta["processing"])
    assert np.isnan(got["x"][60])


def link(version: int = 2, system: int = 1, delay: float = 0.0, first: float = FAR) -> Link:
    rng = np.random.default_rng(2)
    out = Link(system, version)
    for k, t in enumerate(T - FAR + first):
        at = BOOT + t + delay * float(rng.uniform(0.0, 2.0))
        out.attitude(at, t, PSI[k], R[k])
        out.place(at, t, *PLACES[k], V_N[k], V_E[k])
        out.servos(at, 1900, 0, 1300)
        out.say(at, out.dialect.MAVLink_system_time_message(0, 0))
    for number, function in ((1, 73), (3, 74)):
        out.parameter(BOOT + first, f"SERVO{number}_FUNCTION", function)
    return out


@pytest.mark.parametrize("version", [1, 2])
def test_telemetry_gives_the_ship(tmp_path: Path, version: int) -> None:
    """Times are those of the autopilot: the link delays each message by up to 0.1 s."""
    path = tmp_path / "run.tlog"
    station = Link(255, version)
    for t in T:
        station.attitude(BOOT + t, 0.0, 3.0, 1.0)
    path.write_bytes(tlog(link(version, delay=0.05), station))
    got = tlogs.read(path)
    assert np.abs(got.t - (T - FAR)).max() < 2e-3
    assert off(got["psi"], PSI) < 1e-6
    np.testing.assert_allclose(got["r"], R, rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(got.stack("x", "y"), np.column_stack([NORTH, EAST]), atol=0.015)
    np.testing.assert_allclose(got["u"], U, atol=0.008)
    assert set(got["throttle_port"][np.isfinite(got["throttle_port"])]) == {1.0}
    assert set(got["throttle_starboard"][np.isfinite(got["throttle_starboard"])]) == {-0.5}
    assert got.meta["ignored"] == {"SYSTEM_TIME": 200}
    assert abs(np.datetime64(got.meta["start"][:-6]).astype("datetime64[us]").astype(float) / 1e6 - BOOT - FAR) < 0.1


def test_signed_frames_are_read_as_others(tmp_path: Path) -> None:
    out = Link()
    out.codec.signing.secret_key, out.codec.signing.sign_outgoing = bytes(32), True
    for k, t in enumerate(T):
        out.attitude(BOOT + t, t, PSI[k], R[k])
    assert len(out.records[0][1]) > 40 + 13 - 4  # zeros at the end of a message are not sent
    (tmp_path / "run.tlog").write_bytes(tlog(out))
    got = tlogs.read(tmp_path / "run.tlog")
    assert off(got["psi"], PSI) < 1e-6
    assert not any("no whole message" in step for step in got.meta["processing"])


@pytest.mark.slow
def test_a_message_of_another_dialect_is_passed_over(tmp_path: Path) -> None:
    """Its checksum is not known, so the record behind it says whether it is whole."""
    whole = tlog(link())
    rows = len(tlogs.read(_written(tmp_path, whole)))
    frame = b"\xfd\x04\0\0\0\1\1\xff\xff\x7f" + b"abcd" + b"\0\0"
    other = struct.pack(">Q", round(1e6 * BOOT)) + frame
    at = whole.index(struct.pack(">Q", round(1e6 * (BOOT + T[9]))))
    got = tlogs.read(_written(tmp_path, whole[:at] + other + whole[at:]))
    assert len(got) == rows
    assert any("1 messages of other dialects" in step for step in got.meta["processing"])
    damaged = tlogs.read(_written(tmp_path, whole[:at] + other + b"\xff" * 7 + whole[at:]))
    assert len(damaged) == rows
    assert any(f"{len(other) + 7} of" in step for step in damaged.meta["processing"])


def _written(folder: Path, data: bytes) -> Path:
    (folder / "run.tlog").write_bytes(data)
    return folder / "run.tlog"


def test_of_several_systems_the_one_that_says_most_is_read(tmp_path: Path) -> None:
    other = Link(7)
    other.attitude(BOOT, 1.0, 2.0, 0.5)
    (tmp_path / "run.tlog").write_bytes(tlog(link(), other))
    got = tlogs.read(tmp_path / "run.tlog")
    assert off(got["psi"], PSI) < 1e-6
    assert any("system 1 is read; others speak too: 7" in step for step in got.meta["processing"])


def test_an_autopilot_that_was_started_again_has_no_clock(tmp_path: Path) -> None:
    both = link()
    for k, t in enumerate(T):
        both.attitude(BOOT + 100.0 + t, t - FAR, PSI[k], R[k])
    (tmp_path / "run.tlog").write_bytes(tlog(both))
    got = tlogs.read(tmp_path / "run.tlog")
    assert got.t[-1] == pytest.approx(100.0 + T[-1] - T[0], abs=1e-3)
    assert any("started again" in step for step in got.meta["processing"])


@pytest.mark.slow
def test_a_cut_or_damaged_telemetry_is_read_where_it_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "run.tlog"
    whole = tlog(link())
    for data in (whole[: len(whole) // 2 + 5], whole[:5000] + bytes(97) + whole[5000:], whole[:5000] + whole[5040:]):
        path.write_bytes(data)
        got = tlogs.read(path)
        assert 90 < len(got) <= 200
        assert off(got["psi"], SHIP.psi(got.t)) < 2e-3  # times to the millisecond
        assert any("bytes are of no whole message" in step for step in got.meta["processing"])


def test_a_recording_of_a_device_is_read(data_file: Any) -> None:
    """The sample log of pyulog: 6 s of a parked aircraft, by an other way of reading its topics."""
    path = data_file("public_logs", "pyulog", "sample_log_small.ulg")
    got: Trial = reader("ulog")(path)
    from pyulog import ULog

    q = ULog(str(path), ["vehicle_attitude"]).data_list[0].data
    yaw = np.arctan2(2 * (q["q[0]"] * q["q[3]"] + q["q[1]"] * q["q[2]"]), 1 - 2 * (q["q[2]"] ** 2 + q["q[3]"] ** 2))
    assert len(got) == np.unique(q["timestamp"]).size
    assert off(got["psi"][0], yaw[0]) < 1e-6
    assert got.meta["start"].startswith("2021-04-21T06:3")


@pytest.mark.parametrize(("format", "extra"), [("ulog", "ulog"), ("tlog", "mavlink")])
def test_a_reader_that_is_not_there_is_named(
    tmp_path: Path, format: str, extra: str, monkeypatch: pytest.MonkeyPatch
) -> None:  # fmt: skip
    path = tmp_path / "run.dat"
    path.write_bytes(ulog(topics()) if format == "ulog" else tlog(link()))
    assert importing(str(path), None, tmp_path)[0] == format
    before = builtins.__import__

    def without(name: str, *others: Any, **more: Any) -> Any:
        if name.partition(".")[0] in ("pyulog", "pymavlink"):
            raise ImportError(name)
        return before(name, *others, **more)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(DataError, match=rf"pip install 'seatrial\[{extra}\]'"):
        reader(format)(path)


HEAD = ULOG + b"\x01" + bytes(8) + part("B", bytes(40))
NESTED = b"".join(part("F", f"a{k}:uint64_t timestamp;a{k + 1}[999] b;".encode()) for k in range(12))
SUBSCRIBED = part("A", struct.pack("<BH", 0, 0) + b"vehicle_attitude")
HOSTILE = {
    "ulog": {
        "huge": HEAD + part("F", b"vehicle_attitude:uint64_t timestamp;float[999999] q;") + SUBSCRIBED,
        "nested": HEAD + NESTED + part("F", b"vehicle_attitude:uint64_t timestamp;a0 q;") + SUBSCRIBED,
        "itself": HEAD + part("F", b"vehicle_attitude:uint64_t timestamp;vehicle_attitude q;") + SUBSCRIBED,
        "length": HEAD + b"\xff\xffF" + b"abc",
        "short": HEAD + part("F", b"vehicle_attitude:float[4] q;") + SUBSCRIBED + part("D", b"\0\0" + bytes(3)),
        "timeless": HEAD + part("F", b"vehicle_attitude:float[4] q;") + SUBSCRIBED + part("D", b"\0\0" + bytes(16)),
        "empty": HEAD, "magic": ULOG, "zeros": ULOG + bytes(100_000),
    },
    "tlog": {
        "empty": b"", "random": np.random.default_rng(1).bytes(2_000_000), "marks": b"\xfd\xfe" * 500_000,
        "lengths": (struct.pack(">Q", round(1e6 * BOOT)) + b"\xfd\xff\x01") * 50_000,
    },
}  # fmt: skip


@pytest.mark.parametrize(("format", "name"), [(one, name) for one, cases in HOSTILE.items() for name in cases])
def test_a_log_made_to_do_harm_is_a_line(
    tmp_path: Path, format: str, name: str, capsys: pytest.CaptureFixture[str]
) -> None:  # fmt: skip
    path = tmp_path / "a.dat"
    path.write_bytes(HOSTILE[format][name])
    assert main(["import", format, str(path), "-o", str(tmp_path / "out")]) == 2
    said = capsys.readouterr()
    assert len(said.err.splitlines()) == 1
    assert "a.dat" in said.err
    assert said.out == ""


@pytest.mark.slow
def test_pulses_without_their_functions_are_numbers_of_a_mapping(tmp_path: Path) -> None:
    """The guess finds the servo that turns the boat, with its sense; what is not mapped is counted."""
    out, path = Link(), tmp_path / "run.tlog"
    t = 0.2 * np.arange(600)
    order = np.where(np.arange(t.size) // 60 % 2 == 0, 0.5, -0.5)
    r = np.zeros(t.size)
    for k in range(1, t.size):
        r[k] = r[k - 1] + 0.2 * (0.2 * order[k] - r[k - 1])
    psi = 0.3 + np.cumsum(0.2 * r)
    north, east = (np.cumsum(0.2 * one) for one in (1.5 * np.cos(psi), 1.5 * np.sin(psi)))
    for k, now in enumerate(t.tolist()):
        out.attitude(BOOT + now, now, float(psi[k]), float(r[k]))
        out.place(BOOT + now, now, *DATUM.place(float(north[k]), float(east[k])), 1.5 * math.cos(psi[k]),
                  1.5 * math.sin(psi[k]))  # fmt: skip
        out.servos(BOOT + now, round(1500 - 400 * order[k]), 0, 1600)
    path.write_bytes(tlog(out))
    plain = tlogs.read(path)
    assert "steering" not in plain
    assert plain.meta["ignored"]["SERVO_OUTPUT_RAW[1]"] == t.size
    found = guess(path)
    (tmp_path / "m.toml").write_text(found.text)
    got = tlogs.read(path, tlogs.read_mapping(tmp_path / "m.toml"))
    there = np.isfinite(got["steering"])
    assert there.mean() > 0.9
    np.testing.assert_allclose(got["steering"][there], order[there], atol=2e-3)
    assert "SERVO_OUTPUT_RAW[3]" not in found.text, "pulses that never change drive nothing"


def test_a_message_is_as_long_as_its_fields_and_those_of_the_messages_in_it() -> None:
    for kind, code in CODES.items():
        assert ulogs._size("m", {"m": [(kind, 3), ("uint8_t", 1)]}, {}, 0) == 3 * struct.calcsize(f"<{code}") + 1
    within = {"outer": [("inner", 2), ("double", 1)], "inner": [("float", 3)]}
    assert ulogs._size("outer", within, {}, 0) == 2 * 12 + 8
    assert ulogs._size("loop", {"loop": [("loop", 1)]}, {}, 0) > 65_535
