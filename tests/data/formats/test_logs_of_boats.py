"""Logs of MOOS, Signal K, GPX and ArduPilot by writers of their own, against what was put in."""

from __future__ import annotations

import json
import math
import struct
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from seatrial.data import DataError, Trial
from seatrial.data.formats import dataflash, gpx, moos, signalk
from seatrial.data.recognise import recognise

START = 1795694400.0
DEGREE = math.pi / 180.0


def _iso(t: float) -> str:
    return datetime.fromtimestamp(t, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")


def _truth(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times of random rate with gaps, headings and rudders in whole hundredths of a degree."""
    rng = np.random.default_rng(seed)
    ticks = np.flatnonzero(rng.random(30) > 0.2)
    t = np.round((ticks - ticks[0]) * rng.integers(5, 200) / 100.0, 3)
    return t, rng.integers(0, 35999, len(t)) / 100.0, rng.integers(-3500, 3500, len(t)) / 100.0


def _same_heading(trial: Trial, psi: np.ndarray) -> bool:
    return bool(np.allclose(np.cos(trial["psi"] - psi), 1.0, atol=1e-10))


@pytest.mark.parametrize("seed", range(5))
def test_moos(seed: int, tmp_path: Path) -> None:
    t, psi, delta = _truth(seed)
    lines = [f"%% LOGSTART {START}"]
    for one, heading, rudder in zip(t, psi, delta, strict=True):
        lines += [f"{one:.3f} NAV_HEADING iINS {heading:.2f}", f"{one:.3f} DESIRED_RUDDER pHelm {rudder:.2f}",
                  f"{one:.3f} NAV_X iGPS {one * 2.0:.3f}", f"{one:.3f} NAV_Y iGPS {one * 3.0:.3f}",
                  f"{one:.3f} NODE_REPORT pNode NAME=x,HDG={heading} y z"]  # fmt: skip
    file = tmp_path / "a.alog"
    file.write_text("\n".join(lines))
    trial = moos.read(file)
    assert np.array_equal(trial.t, t)
    assert _same_heading(trial, psi * DEGREE)
    assert np.allclose(trial["delta_cmd"], delta * DEGREE, atol=1e-14)
    assert np.allclose(trial["x"], 3.0 * t, atol=5e-4), "NAV_Y is north"
    assert np.allclose(trial["y"], 2.0 * t, atol=5e-4)
    assert trial.meta["ignored"] == {"NODE_REPORT": len(t)}
    assert datetime.fromisoformat(trial.meta["start"]).timestamp() == START


@pytest.mark.parametrize("seed", range(5))
def test_signal_k(seed: int, tmp_path: Path) -> None:
    t, psi, delta = _truth(seed)
    lines: list[str] = []
    for one, heading, rudder in zip(t, psi * DEGREE, delta * DEGREE, strict=True):
        values = {"navigation.headingTrue": heading, "steering.rudderAngle": rudder,
                  "propulsion.port.revolutions": 10.0 + one, "propulsion.starboard.revolutions": 20.0 + one,
                  "environment.wind.speedApparent": 5.0, "environment.wind.angleApparent": -0.5}  # fmt: skip
        told = [{"path": path, "value": value} for path, value in values.items()]
        delta_of = {"context": "vessels.self", "updates": [{"timestamp": _iso(START + one), "values": told}]}
        seen = [{"path": "navigation.headingTrue", "value": 1.0}]
        other = {"context": "vessels.urn:mrn:imo:mmsi:1", "updates": [{"timestamp": _iso(START + one), "values": seen}]}
        lines += [json.dumps(delta_of), f"{round((START + one) * 1000)};I;{json.dumps(other)}"]
    file = tmp_path / "a.jsonl"
    file.write_text("\n".join(lines))
    trial = signalk.read(file)
    assert np.allclose(trial.t, t, atol=1e-6)
    assert _same_heading(trial, psi * DEGREE)
    assert np.array_equal(trial["delta"], delta * DEGREE)
    assert np.allclose(trial["n_P_1"], 10.0 + t, atol=1e-12), "port, in hertz"
    assert np.allclose(trial["n_P_2"], 20.0 + t, atol=1e-12)
    assert np.allclose(trial["gamma_A"], 2.0 * math.pi - 0.5)
    assert trial.meta["ignored"] == {"of vessels.urn:mrn:imo:mmsi:1": len(t)}


@pytest.mark.parametrize("seed", range(5))
def test_what_a_server_of_signal_k_has_logged(seed: int, tmp_path: Path) -> None:
    """Heading by frames, rudder by deltas, course by sentences, and frames of no use."""
    t, psi, delta = _truth(seed)
    lines: list[str] = []
    for one, heading, rudder in zip(t, psi, delta, strict=True):
        at = round(1000.0 * (START + one))
        raw = struct.pack("<BHhhB", 1, round(heading * 100), 0x7FFF, 0x7FFF, 0xFC)
        values = [{"path": "steering.rudderAngle", "value": rudder * DEGREE}]
        lines += [f"{at};A;{_iso(at / 1000.0)},2,127250,35,255,8,{raw.hex(',')}",
                  f"{at};A;{_iso(at / 1000.0)},6,127505,35,255,2,00,01",
                  f"{at};I;" + json.dumps({"updates": [{"timestamp": _iso(at / 1000.0), "values": values}]}),
                  f"{at};N;$GPVTG,{heading:.2f},T,,M,10.0,N,,K"]  # fmt: skip
    file = tmp_path / "skserver-raw.log"
    file.write_text("\n".join(lines))
    known = recognise(file)
    assert known is not None
    assert known.format == "signalk"
    trial = signalk.read(file)
    assert trial.t == pytest.approx(t, abs=1e-6)
    assert _same_heading(trial, np.round(psi * 100) * 1e-4)
    assert np.allclose(trial["delta"], delta * DEGREE, atol=1e-14)
    assert np.allclose(trial["U_G"], 10.0 * 1852.0 / 3600.0)
    assert np.allclose(np.cos(trial["gamma_G"] - psi * DEGREE), 1.0, atol=1e-10)
    assert trial.meta["ignored"] == {"PGN 127505": len(t)}
    assert trial.meta["lines"]["invalid"] == 0


def test_gpx(tmp_path: Path) -> None:
    points = "".join(f'<trkpt lat="{35.0 + k * 1e-5:.7f}" lon="139.0"><time>{_iso(START + k)}</time>'
                     f"<speed>{1.0 + k}</speed><course>90</course></trkpt>" for k in range(5))  # fmt: skip
    file = tmp_path / "a.gpx"
    file.write_text(f'<?xml version="1.0"?><gpx xmlns="http://www.topografix.com/GPX/1/0"><trk>{points}</trk></gpx>')
    trial = gpx.read(file)
    assert np.array_equal(trial.t, np.arange(5.0))
    assert np.allclose(trial["x"] - trial["x"][0], 1.10941 * np.arange(5), rtol=1e-3), "110.94 km a degree at 35 deg"
    assert np.array_equal(trial["U_G"], 1.0 + np.arange(5))
    assert "psi" not in trial
    assert "u" not in trial, "no heading turns the course into speeds ahead and aside"
    file.write_text('<!DOCTYPE a [<!ENTITY b "c">]><gpx><trk></trk></gpx>')
    with pytest.raises(DataError, match="entities"):
        gpx.read(file)


FORMATS = (
    ("PARM", 64, "QNf", "TimeUS,Name,Value"), ("ATT", 65, "QccC", "TimeUS,Roll,Pitch,Yaw"),
    ("RCOU", 66, "QHH", "TimeUS,C1,C3"), ("IMU", 67, "QBf", "TimeUS,I,GyrZ"),
    ("GPS", 68, "QBBIHLLfC", "TimeUS,I,Status,GMS,GWk,Lat,Lng,Spd,GCrs"), ("XYZ", 69, "Qd", "TimeUS,V"),
)  # fmt: skip
CODES = {"Q": "Q", "N": "16s", "f": "f", "c": "h", "C": "H", "H": "H", "B": "B", "I": "I", "L": "i", "d": "d"}


def _flash(rows: list[tuple[str, tuple[object, ...]]]) -> bytes:
    out = b""
    for name, number, codes, labels in FORMATS:
        size = 3 + struct.calcsize("<" + "".join(CODES[one] for one in codes))
        texts = (one.encode() for one in (name, codes, labels))
        out += b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", number, size, *texts)
    of = {name: (number, codes) for name, number, codes, _ in FORMATS}
    for name, values in rows:
        number, codes = of[name]
        out += b"\xa3\x95" + bytes([number]) + struct.pack("<" + "".join(CODES[one] for one in codes), *values)
    return out


def _sailed(t: np.ndarray, psi: np.ndarray, shares: np.ndarray) -> list[tuple[str, tuple[object, ...]]]:
    said = {"SERVO1_FUNCTION": 73, "SERVO3_FUNCTION": 74, "SERVO1_MIN": 1000, "SERVO1_TRIM": 1500, "SERVO1_MAX": 2000,
            "SERVO3_MIN": 1100, "SERVO3_TRIM": 1500, "SERVO3_MAX": 1900, "SERVO3_REVERSED": 1}  # fmt: skip
    rows: list[tuple[str, tuple[object, ...]]] = [("PARM", (0, k.encode(), float(v))) for k, v in said.items()]
    week, second = divmod(START + 18.0 - 315964800.0, 604800.0)
    for one, heading, share in zip(t.tolist(), psi.tolist(), shares.tolist(), strict=True):
        us = round(one * 1e6)
        rows += [("ATT", (us, 125, -50, round(heading * 100))), ("IMU", (us, 0, 0.25)), ("IMU", (us, 1, 9.0)),
                 ("RCOU", (us, 1500 + 5 * share, 1500 - 4 * share)), ("XYZ", (us, 1.0)),
                 ("GPS", (us, 0, 3, round((second + one) * 1e3), int(week), 35 * 10**7, 139 * 10**7, 2.5, 9000))]
    return rows


@pytest.mark.parametrize("seed", range(5))
def test_ardupilot(seed: int, tmp_path: Path) -> None:
    """Pulses are shares of the throttles by the parameters of their servos, one of them reversed."""
    t, psi, _ = _truth(seed)
    shares = np.random.default_rng(seed).integers(-100, 100, len(t))
    file = tmp_path / "a.bin"
    file.write_bytes(_flash(_sailed(t, psi, shares)))
    trial = dataflash.read(file)
    assert np.allclose(trial.t, t, atol=1e-6)
    assert _same_heading(trial, psi * DEGREE)
    assert np.allclose(trial["phi"], 1.25 * DEGREE, atol=1e-15)
    assert np.allclose(trial["theta"], -0.5 * DEGREE, atol=1e-15)
    assert set(trial["r"].tolist()) == {0.25}, "the first gyro alone"
    assert np.allclose(trial["throttle_port"], shares / 100.0, atol=1e-12)
    assert np.allclose(trial["throttle_starboard"], shares / 100.0, atol=1e-12)
    assert np.allclose(trial["u"], 2.5 * np.cos(math.pi / 2 - psi * DEGREE), atol=1e-7)
    assert datetime.fromisoformat(trial.meta["start"]).timestamp() == pytest.approx(START, abs=1e-3)
    assert trial.meta["ignored"] == {"XYZ": len(t)}


def test_ardupilot_damaged(tmp_path: Path) -> None:
    """What lies between damaged bytes is read; pulses without the functions of their servos are no orders."""
    t, psi = np.arange(20.0), np.full(20, 30.0)
    rows = [one for one in _sailed(t, psi, np.zeros(20, dtype=int)) if one[0] != "PARM"]
    whole = _flash(rows)
    file = tmp_path / "a.bin"
    file.write_bytes(whole[:1200] + b"\xff" * 50 + whole[1200:-7])
    trial = dataflash.read(file)
    assert 18 <= len(trial) <= 20
    assert not [name for name in trial.channels if name.startswith("throttle")]
    assert any("SERVOn_FUNCTION" in step for step in trial.meta["processing"])
    assert any("of no message" in step for step in trial.meta["processing"])
    file.write_bytes(b"\xa3\x95\x80" * 5000)
    with pytest.raises(DataError, match="ArduPilot"):
        dataflash.read(file)


@pytest.mark.parametrize(("module", "content"), [
    (signalk, '{"updates": ' + "[" * 30000 + "\n"), (signalk, '{"updates": [{"timestamp": 5}]}\n' * 3),
    (signalk, '{"name": "a server", "version": "2.0"}\n' * 3),
    (signalk, '{"updates": [{"timestamp": "2026-11-26T12:00:00Z", "values": [{"path": "a"}]}]}\n' * 3),
    (moos, "1 2\n" * 5), (moos, "%% LOGSTART 1\n%% LOGSTART 2\n0 NAV_X a 1\n1 NAV_X a 1\n"),
    (gpx, '<?xml version="1.0" encoding="utf0x10"?><gpx/>'), (gpx, '<?xml version="1.0" encoding="utf-7"?><gpx/>'),
    (gpx, "<gpx><trk>"), (gpx, "<gpx>" + "<a>" * 50000), (dataflash, "FMT, 128, 89, FMT, B, A\nATT, 1\n"),
])  # fmt: skip
def test_damaged_logs_are_refused_in_one_line(module: object, content: str, tmp_path: Path) -> None:
    file = tmp_path / "damaged"
    file.write_text(content)
    with pytest.raises(DataError) as error:
        module.read(file)  # type: ignore[attr-defined]
    assert "\n" not in str(error.value)
    assert str(file) in str(error.value)


@pytest.mark.parametrize("named", [True, False])
def test_devices_of_signal_k_that_are_named_by_objects_are_two(named: bool, tmp_path: Path) -> None:
    """Two gyros 3 deg apart whose source is an object, as deltas of a gateway have it, or is not told at all."""
    lines = list[str]()
    for k in range(80):
        update = {"timestamp": _iso(START + 0.25 * k), "values": [
            {"path": "navigation.headingTrue", "value": 1.0 + 0.01 * k + 3.0 * DEGREE * (k % 2)}]}  # fmt: skip
        source = {"label": "n2k", "type": "NMEA2000", "src": f"{35 + k % 2}", "pgn": 127250}
        lines.append(json.dumps({"updates": [{**update, **({"source": source} if named else {})}]}))
    file = tmp_path / "a.jsonl"
    file.write_text("\n".join(lines))
    trial = signalk.read(file)
    assert trial["psi"] == pytest.approx(1.0 + 0.02 * np.arange(40))
    first, second = ("n2k.35", "n2k.36") if named else ("1/self", "2/self")
    assert trial.meta["sources"]["heading"].startswith(first)
    assert f"{second} left aside, differs by +3 deg" in trial.meta["sources"]["heading"]
    assert any(one.startswith("doubt: two instruments speak as self") for one in trial.meta["processing"]) != named


@pytest.mark.parametrize(("ids", "port"), [(("0", "1"), "0"), (("port", "starboard"), "port")])
def test_engines_of_signal_k_are_numbered_from_port(ids: tuple[str, str], port: str, tmp_path: Path) -> None:
    lines = [json.dumps({"updates": [{"timestamp": _iso(START + k), "values": [
        {"path": "navigation.headingTrue", "value": 1.0},
        *({"path": f"propulsion.{one}.revolutions", "value": 10.0 if one == port else 20.0} for one in ids)]}]})
        for k in range(10)]  # fmt: skip
    file = tmp_path / "a.jsonl"
    file.write_text("\n".join(lines))
    trial = signalk.read(file)
    assert (set(trial["n_P_1"]), set(trial["n_P_2"])) == ({10.0}, {20.0})


def test_what_a_server_of_signal_k_says_of_itself_is_no_delta(tmp_path: Path) -> None:
    own, other = "urn:mrn:imo:mmsi:257000001", "urn:mrn:imo:mmsi:257000002"
    lines = [json.dumps({"name": "signalk-server", "version": "2.9.0", "self": f"vessels.{own}", "roles": ["master"]})]
    for k in range(30):
        for who, heading, times in ((own, 1.0 + 0.01 * k, 1), (other, 2.0, 3)):
            values = [{"path": "navigation.headingTrue", "value": heading}] * times
            update = {"timestamp": _iso(START + k), "values": values}
            lines.append(json.dumps({"context": f"vessels.{who}", "updates": [update]}))
    lines.append('{"context": "vessels.self", "updates": [{"values": [{"path": "navigation.headingTrue"}]}]}')
    file = tmp_path / "a.json"
    file.write_text("\n".join(lines))
    assert signalk.read(file)["psi"] == pytest.approx(1.0 + 0.01 * np.arange(30))


@pytest.mark.parametrize("mark", ["D ", "D:", "<D>", ""])
def test_moos_with_types_marked(mark: str, tmp_path: Path) -> None:
    lines = ["%% DATATYPE MARKING ON", f"%% LOGSTART {START}", "0.5 IVPHELM_STATE pHelm S DRIVE"]
    lines += [f"{0.1 * k:.1f} NAV_HEADING iINS {mark}{10.0 + k:.2f}" for k in range(30)]
    file = tmp_path / "a.alog"
    file.write_text("\n".join(lines))
    assert moos.read(file)["psi"] == pytest.approx((10.0 + np.arange(30)) * DEGREE)


def test_the_line_protocol_of_influx_is_named(tmp_path: Path) -> None:
    file = tmp_path / "a.lp"
    file.write_text("".join(f"gnss,boat=A lat=59.43,sog={k / 10} 17888965610{k:08d}\n" for k in range(30)))
    known = recognise(file)
    assert known is not None
    assert "InfluxDB" in known.name
    file.write_text("".join(f"time={k} lat=59.43\n" for k in range(30)))
    assert recognise(file) is None or "InfluxDB" not in recognise(file).name  # type: ignore[union-attr]


def test_of_two_headings_alike_that_of_the_place_is_taken(tmp_path: Path) -> None:
    lines = [f"%% LOGSTART {START}"]
    for k in range(40):
        lines += [f"{k} NAV_X pNav {2.0 * k}", f"{k} NAV_Y pNav {3.0 * k}", f"{k} NAV_HEADING iComp {34.0 + 0.1 * k}",
                  f"{k} NAV_HEADING pNav {30.0 + 0.1 * k}"]  # fmt: skip
    file = tmp_path / "a.alog"
    file.write_text("\n".join(lines))
    trial = moos.read(file)
    assert trial["psi"] == pytest.approx((30.0 + 0.1 * np.arange(40)) * DEGREE)
    assert "iComp left aside, differs by +4 deg" in trial.meta["sources"]["heading"]
